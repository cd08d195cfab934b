"""`photosite develop --sheet`: truth, mosaic, development and their difference side by side."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from simulator.errors import PhotositeError
from simulator.measurement.report.figures import new_figure
from simulator.raw.development import develop, srgb_encoded
from simulator.raw.raw_reader import RawFile, read_raw_file
from simulator.raw.truth_exr import NOISE_FREE_DN, read_twin

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DETAIL_PX = 96  # side of the cut-out in the second row
OVERVIEW_PX = 900  # longer side of the pictures in the first row, about
SHOWN_DIFFERENCE = 0.35  # of the range from black to white, for the 99.5th percentile of the difference


def draw_sheet(path: Path, settings: dict[str, Any]) -> "Figure":
    """Draw a frame beside its truth, whole and as a detail from its middle.

    settings: arguments of `simulator.raw.development.develop`, which checks them. The truth is the twin's noise-free codes,
    rounded and developed with the same settings and the frame's white balance, so that the difference shows noise and fixed
    pattern, and no demosaicing error that both share.
    Raises PhotositeError when the twin is missing or of another size, and without matplotlib.
    """
    twin = path.with_name(path.stem + ".truth.exr")
    if not twin.is_file():
        raise PhotositeError(f"--sheet compares with the truth, but {twin} is missing; simulate writes it", file=path)
    codes = np.rint(read_twin(twin)[NOISE_FREE_DN]).astype(np.uint16)
    truth, found = (_scale_to_one(develop(path, **settings, codes=one)) for one in (codes, None))
    difference = found - truth
    enlarged = SHOWN_DIFFERENCE / max(_bright_level(np.abs(difference)), 1e-6)
    encode = settings["output"] != "srgb"
    rms = float(np.sqrt(np.mean(difference**2)))
    mosaic = mosaic_picture(read_raw_file(path, any_pattern=True))
    lighter = max(1.0, 1.0 / max(_bright_level(mosaic.max(axis=2)), 1e-6))
    panels = {
        "truth: noise-free codes, developed": _encode(truth, encode),
        f"raw as seen, each photosite in its colour, x {lighter:.3g}": _encode(lighter * mosaic, True),
        "developed": _encode(found, encode),
        f"developed - truth, x {enlarged:.3g}, rms {rms:.2g}": np.clip(0.5 + enlarged * difference, 0.0, 1.0),
    }
    return _draw_panels(panels, f"{path.name}: output {settings['output']}, demosaic {settings['demosaic']}")


def mosaic_picture(raw: RawFile) -> np.ndarray:
    """Signal of each photosite in its own colour (height, width, 3), 0 at black and 1 at white; grey for MONO."""
    height, width = raw.mosaic.shape
    rows, columns = raw.black_level_dn.shape
    black_dn = np.tile(raw.black_level_dn, (height // rows + 1, width // columns + 1))[:height, :width]
    signal = (raw.mosaic - black_dn) / (raw.white_level_dn - raw.black_level_dn.mean())
    if raw.cfa == "MONO":
        return np.repeat(signal[..., np.newaxis], 3, axis=2)
    picture = np.zeros((height, width, 3), np.float32)
    for index, letter in enumerate(raw.cfa.replace("/", "")):
        place = (slice(index // columns, None, rows), slice(index % columns, None, columns))
        picture[(*place, "RGB".index(letter))] = signal[place]
    return picture


def _scale_to_one(picture: np.ndarray) -> np.ndarray:
    return picture.astype(np.float32) / np.float32(np.iinfo(picture.dtype).max if picture.dtype.kind == "u" else 1.0)


def _bright_level(picture: np.ndarray) -> float:
    """Return the 99.5th percentile; of a large picture, that of every ninth row and column."""
    step = 9 if picture.shape[0] > 1000 else 1
    return float(np.percentile(picture[::step, ::step], 99.5))


def _average_blocks(picture: np.ndarray) -> np.ndarray:
    """Return the means of square blocks, so that the longer side has about OVERVIEW_PX pixels."""
    block = max(1, max(picture.shape[:2]) // OVERVIEW_PX)
    height, width = (side // block for side in picture.shape[:2])
    return picture[: height * block, : width * block].reshape(height, block, width, block, 3).mean(axis=(1, 3))


def _encode(picture: np.ndarray, encode: bool) -> np.ndarray:
    clipped = np.clip(picture, 0.0, 1.0)
    return srgb_encoded(clipped) if encode else clipped


def _draw_panels(panels: dict[str, np.ndarray], title: str) -> "Figure":
    figure, axes = new_figure(2, len(panels), 4.0 * len(panels), 7.0)
    figure.suptitle(title)
    for column, (name, picture) in enumerate(panels.items()):
        height, width = picture.shape[:2]
        side = min(DETAIL_PX * height // panels["developed"].shape[0] if column == 1 else DETAIL_PX, height, width)
        top, left = (height - side) // 2, (width - side) // 2
        detail = picture[top : top + side, left : left + side]
        for one, pixels, text in (
            (axes[column], _average_blocks(picture), name),
            (axes[column + len(panels)], detail, f"middle, {side} px"),
        ):
            one.imshow(pixels, interpolation="nearest" if pixels is detail else "antialiased")
            one.set_title(text, fontsize=9)
            one.set_axis_off()
    return figure
