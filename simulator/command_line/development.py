"""`photosite develop`."""

from pathlib import Path
from typing import Any

from simulator.command_line.output_file import check_output
from simulator.errors import PhotositeError
from simulator.raw.development import PICTURE_SUFFIXES, develop, write_image


def develop_file(raw: Path, out: Path | None, settings: dict[str, Any], white_balance: str, bits: int | None) -> Path:
    """Develop `raw` into the picture `out` (default: beside it, as PNG; EXR for metric output) and return its path.

    settings: other arguments of `simulator.raw.development.develop`, which checks them. Raises PhotositeError.
    """
    metric = settings.get("output") == "metric"
    target = out or raw.with_suffix(".exr" if metric else ".png")
    if metric and target.suffix.lower() not in (".exr", ".tif", ".tiff"):
        raise PhotositeError("metric output goes below 0 and above 1; give an .exr or .tif file", key="--out", value=target)
    check_output(target, "--out", PICTURE_SUFFIXES, lambda: [raw])
    if bits is None:
        bits = 8 if target.suffix.lower() in (".png", ".jpg", ".jpeg") else 16
    choice = settings | {"white_balance": _parse_white_balance(white_balance), "bits": bits}
    write_image(target, develop(raw, **choice))
    return target


def develop_sheet(raw: Path, out: Path | None, settings: dict[str, Any], white_balance: str) -> Path:
    """Write truth, raw, development and their difference side by side (default: RAW.sheet.png) and return the path.

    Raises PhotositeError.
    """
    from simulator.command_line.development_sheet import draw_sheet
    from simulator.command_line.screen import show_waiting
    from simulator.measurement.report.figures import FORMATS, write_figure

    target = out or raw.with_suffix(".sheet.png")
    check_output(target, "--out", FORMATS, lambda: [raw])
    choice = settings | {"white_balance": _parse_white_balance(white_balance)}
    with show_waiting("sheet"):
        write_figure(draw_sheet(raw, choice), target)
    return target


def _parse_white_balance(text: str) -> str | tuple[float, ...]:
    if "," not in text:
        return text
    numbers: tuple[float, ...]
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in (3, 4):
        rule = "give camera, daylight, an illuminant, three factors such as 2.1,1,1.6, or a grey patch X,Y,WIDTH,HEIGHT"
        raise PhotositeError(rule, key="--white-balance", value=text)
    return numbers
