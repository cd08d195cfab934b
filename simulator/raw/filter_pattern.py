"""Filter pattern of a raw file as LibRaw tells it."""

from typing import TYPE_CHECKING

import numpy as np

from simulator.errors import require

if TYPE_CHECKING:
    import rawpy


def color_index(frame: "rawpy.RawPy", label: str, of_development: bool = False) -> np.ndarray | None:
    """Return LibRaw's colour index of each photosite of one period of the filter pattern; None where it has none.

    The period begins at the corner of the visible part. rawpy counts from that of the whole frame.
    of_development: LibRaw is to develop the file, which knows an X-Trans pattern that rawpy does not tell.
    Raises PhotositeError for an X-Trans file with a wide margin, where rawpy 0.28 reads past the end of its table, and for a
    pattern that LibRaw misreads: it knows those of 6 x 6, and others only up to two columns.
    """
    index, margins = frame.raw_pattern, (frame.sizes.top_margin, frame.sizes.left_margin)
    hidden = index is not None and index.shape == (6, 6) and max(margins) > 6 and not of_development
    rule = (
        "rawpy does not tell the pattern behind so many rows and columns of optical black; develop reads the file, "
        "with a white balance that is no patch"
    )
    require(not hidden, "margins", margins, rule, file=label)
    rule = (
        "LibRaw misreads the pattern, which is wider than 2 and not 6 x 6; simulate it with camera.remosaic or camera.binning"
    )
    shown = [] if index is None else index.tolist()
    is_read = index is None or index.shape == (6, 6) or (index.shape == (2, 2) and len({*index.ravel()}) == 4)
    require(is_read, "cfa", shown, rule, file=label)
    return None if index is None else np.roll(index, (-margins[0], -margins[1]), axis=(0, 1))
