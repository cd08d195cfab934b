"""White level: the code at which a camera clips, from frames that clip."""

import numpy as np

LEAST_SHARE = 1e-3  # of all photosites; fewer at one high code are highlights or defects
STANDS_OUT = (
    2.0  # count at the clipping code over that of every code below: the noise of a bright frame spreads over more codes
)
MOST_ABOVE = 0.05  # of the count at the clipping code; a peak of noise has as many codes above as below


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
