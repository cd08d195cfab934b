"""White level: the code at which a camera clips, from frames that clip."""

import numpy as np

LEAST_SHARE = 1e-3  # of all photosites; fewer at one high code are highlights or defects
STANDS_OUT = 2.0  # against every code below: the noise of a bright frame spreads over far more codes
MOST_ABOVE = 0.05  # of the pile; a peak of noise has as many codes above as below


def find_clipped_code(codes: np.ndarray) -> int | None:
    """Code at which photosites pile up at the top of a bright frame's histogram [DN], or None where nothing clips.

    codes: uint16 of any shape. It is the most frequent code near the top rather than the highest, since a few photosites of
    some cameras clip above the others.
    """
    counts = np.bincount(codes.ravel())
    reach = max(4, counts.size // 64)
    code = counts.size - reach + int(np.argmax(counts[-reach:]))
    pile, below = counts[code], counts[max(0, code - 4 * reach) : code]
    stands_out = pile > STANDS_OUT * max(below.max(initial=0), 1)
    piled = pile >= LEAST_SHARE * codes.size and stands_out and counts[code + 1 :].sum() <= MOST_ABOVE * pile
    return code if piled else None
