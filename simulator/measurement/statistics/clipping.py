"""Clipped codes: how many a measurement bears, and the white level of a camera, from frames that clip."""

import numpy as np

from simulator.errors import PhotositeError

MOST_CLIPPED = 0.01  # share of photosites at the white level, above which what is measured of them is not told
MOST_AT_ZERO = 0.1  # the same at code 0 of an edge, of which half is dark
LEAST_SHARE = 1e-3  # of all photosites; fewer at one high code are highlights or defects
STANDS_OUT = (
    2.0  # count at the clipping code over that of every code below: the noise of a bright frame spreads over more codes
)
MOST_ABOVE = 0.05  # of the count at the clipping code; a peak of noise has as many codes above as below


def require_unclipped(codes: np.ndarray, white_level_dn: int) -> None:
    """Raise PhotositeError where too many of the codes of an edge are clipped: how many, and what helps.

    These are MOST_CLIPPED at the white level, and MOST_AT_ZERO at code 0, where a camera without pedestal ends: photosites that
    counted no electron have it, too.
    """
    at_white, at_zero = (int(np.count_nonzero(there)) for there in (codes >= white_level_dn, codes == 0))
    if at_white <= MOST_CLIPPED * codes.size and at_zero <= MOST_AT_ZERO * codes.size:
        return
    ends = (
        (at_white, f"at or above the white level of {white_level_dn} DN", "expose it less"),
        (at_zero, "at code 0", "expose it more, or light its dark side"),
    )
    parts = [(count, place, fix) for count, place, fix in ends if count]
    told = " and ".join(f"{count} {place}" for count, place, _ in parts)
    help_text = "; ".join(fix for *_, fix in parts)
    rule = f"{told} of {codes.size} photosites, so that the edge is cut off and would count as sharper than it is"
    raise PhotositeError(f"{rule}; {help_text}, or give another area")


def find_clipped_code(codes: np.ndarray) -> int | None:
    """Find the code at which the histogram of a bright frame has a peak at its upper end [DN]; None where nothing clips.

    codes: uint16 of any shape. The result is the most frequent code near the upper end rather than the highest one, since a
    few photosites of some cameras clip above the others.
    """
    counts = np.bincount(codes.ravel())
    reach = max(4, counts.size // 64)
    code = counts.size - reach + int(np.argmax(counts[-reach:]))
    pile, below = counts[code], counts[max(0, code - 4 * reach) : code]
    stands_out = pile > STANDS_OUT * max(below.max(initial=0), 1)
    piled = pile >= LEAST_SHARE * codes.size and stands_out and counts[code + 1 :].sum() <= MOST_ABOVE * pile
    return code if piled else None
