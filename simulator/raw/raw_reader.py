"""Reading of raw files of any camera with LibRaw: codes before development, and the metadata that describe them."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from simulator.errors import PhotositeError, check_file, reading
from simulator.raw.filter_pattern import color_index
from simulator.raw.white_balance import xyz_to_camera
from simulator.sensor.camera.cfa import BAYER

if TYPE_CHECKING:
    import rawpy
    from rawpy import RawPy as OpenRaw

PLANES = ("R", "Gr", "Gb", "B")


@dataclass(frozen=True)
class RawFile:
    """The visible part of a raw file.

    mosaic: (height, width) uint16 codes as stored, pedestal included [DN].
    cfa: colours from the upper left corner on, of one period of the filter pattern, as `Cfa.named` reads it, or "MONO".
    black_level_dn: float64 by place in that period, (2, 2) for MONO [DN]. LibRaw rounds fractions; dark frames are more exact.
    white_level_dn: saturation level in the file's metadata [DN].
    iso, exposure_time_s: of the metadata, None where missing. LibRaw returns 65535 for every ISO above it.
    white_balance: gains of R, G, B that the camera chose, green = 1; None where the file has none, and for MONO.
    color_matrix: (3, 3) XYZ to camera under D65; None where the file holds none, and for MONO.
    """

    path: str
    mosaic: np.ndarray
    cfa: str
    black_level_dn: np.ndarray
    white_level_dn: int
    iso: float | None
    exposure_time_s: float | None
    white_balance: tuple[float, float, float] | None = None
    color_matrix: tuple[tuple[float, ...], ...] | None = None

    def planes(self) -> dict[str, np.ndarray]:
        """Views of the colour planes, all of one shape: R, Gr (green in the rows of red), Gb and B, or MONO.

        An odd last row or column is left out, since it contains only half of the planes.
        """
        if self.cfa == "MONO":
            return {"MONO": self.mosaic}
        height, width = (side // 2 * 2 for side in self.mosaic.shape)
        return {name: self.mosaic[y:height:2, x:width:2] for name, (y, x) in plane_places(self.cfa).items()}


def plane_places(cfa: str) -> dict[str, tuple[int, int]]:
    """Row and column in the 2x2 block of each plane of a pattern such as "GBRG", in the order R, Gr, Gb, B; MONO: (0, 0)."""
    if cfa == "MONO":
        return {"MONO": (0, 0)}
    red_row, red_column = divmod(cfa.index("R"), 2)
    here, other = (red_row, 1 - red_row), (red_column, 1 - red_column)
    return dict(zip(PLANES, [(row, column) for row in here for column in other], strict=True))


def read_raw_file(path: str | os.PathLike[str], any_pattern: bool = False) -> RawFile:
    """Read any raw file with a Bayer pattern or none.

    any_pattern: other patterns, too, as LibRaw tells them, such as X-Trans; they have no `planes`.
    Raises PhotositeError for a file that is missing, damaged or not a raw file, and for another pattern
    or demosaiced data, which have no such planes.
    """
    label = os.fspath(path)
    with open_raw(label, label) as frame:
        mosaic = None if frame.raw_type.name != "Flat" else frame.raw_image_visible
        if mosaic is None or mosaic.dtype != np.uint16:
            raise PhotositeError("holds no mosaic of integer codes; give a raw file that was not demosaiced", file=label)
        cfa, index = _pattern(frame, label, any_pattern)
        black = np.asarray(frame.black_level_per_channel, dtype=np.float64)[index]
        other = frame.other
        return RawFile(
            path=label,
            mosaic=mosaic.copy(),
            cfa=cfa,
            black_level_dn=black,
            white_level_dn=int(frame.white_level),
            iso=positive_or_none(other.iso_speed),
            exposure_time_s=positive_or_none(other.shutter_speed),
            white_balance=None if cfa == "MONO" else _white_balance(frame),
            color_matrix=None if cfa == "MONO" else _color_matrix(frame),
        )


@contextmanager
def open_raw(source: str | bytes, label: str) -> Iterator["OpenRaw"]:
    """Open a path, or the bytes of a file, with LibRaw for a block that reads it; failures of both become PhotositeError."""
    import rawpy

    if isinstance(source, str):
        check_file(source)
    with reading(label, "damaged or cut short: write or copy it again"):
        try:
            with rawpy.imread(io.BytesIO(source) if isinstance(source, bytes) else source) as frame:
                yield frame
        except rawpy.LibRawFileUnsupportedError as error:
            raise PhotositeError("not a raw file that LibRaw can read; give a DNG or another raw file", file=label) from error
        except rawpy.LibRawError as error:
            reason = error.args[0].decode("utf-8", "replace") if error.args and isinstance(error.args[0], bytes) else error
            raise PhotositeError(f"damaged or cut short ({reason}); write or copy it again", file=label) from error


def _pattern(frame: "rawpy.RawPy", label: str, any_pattern: bool) -> tuple[str, np.ndarray]:
    """Return the pattern of the visible part, and LibRaw's colour index by place; each green of Bayer has its own index."""
    if frame.num_colors == 1:  # rawpy gives a meaningless pattern then
        return "MONO", np.zeros((2, 2), dtype=int)
    index, letters = color_index(frame, label), frame.color_desc.decode("ascii", "replace")
    rows = [] if index is None else ["".join(letters[place] for place in row) for row in index]
    pattern = ("" if len(rows) == 2 else "/").join(rows)
    if index is None or not (pattern in BAYER or (any_pattern and len(rows) == 6)):
        shown = f"{index.shape[0]} x {index.shape[1]} filter pattern" if index is not None else f"{letters} without a pattern"
        raise PhotositeError(
            f"{shown}: only 2 x 2 Bayer patterns of R, G, G, B and monochrome files can be measured", file=label
        )
    return pattern, index.astype(int)


def _white_balance(frame: "rawpy.RawPy") -> tuple[float, float, float] | None:
    gains = np.asarray(frame.camera_whitebalance[:3], dtype=np.float64)
    return tuple((gains / gains[1]).tolist()) if np.isfinite(gains).all() and (gains > 0).all() else None


def _color_matrix(frame: "rawpy.RawPy") -> tuple[tuple[float, ...], ...] | None:
    matrix = xyz_to_camera(frame)
    return None if matrix is None else tuple(map(tuple, matrix.tolist()))


def positive_or_none(value: float) -> float | None:
    """Return a number of the file's metadata; None for the 0 that LibRaw gives where the file has none."""
    return float(value) if np.isfinite(value) and value > 0 else None
