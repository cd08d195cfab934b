"""A raw frame: a developed preview, and what there is to know before it is measured."""

import base64
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.stops import write_time
from simulator.measurement.report.html import table
from simulator.raw.image_files import write_picture
from simulator.raw.preview import preview
from simulator.raw.raw_image import Raw
from simulator.raw.save import files_of
from simulator.sensor.camera.cfa import Cfa

LEAST_WIDTH_PX = 240  # of the picture on the page; smaller ones are shown with large pixels


def raw_title(raw: Raw) -> str:
    """Return the name of a frame."""
    return f"Raw {raw.name}"


def show_raw(raw: Raw) -> str:
    """Return a preview, where LibRaw is there and develops the frame, and a table of facts."""
    rows = [[name, text] for name, text in _facts(raw)]
    try:
        shown = _picture(raw)
    except (PhotositeError, ImportError) as error:
        shown = f"<p>No picture: {escape(str(error))}</p>"
    return f"{shown}\n{table(['frame', 'value'], rows, first_number=2)}"


def _picture(raw: Raw) -> str:
    pixels = preview(raw)
    height, width = pixels.shape[:2]
    with TemporaryDirectory() as folder:
        path = Path(folder) / "preview.jpg"
        write_picture(path, pixels, (), **{"compression": "jpeg:85", "jpeg:subsampling": "4:4:4"})
        text = base64.b64encode(path.read_bytes()).decode("ascii")
    scale = max(1, -(-LEAST_WIDTH_PX // width))
    style = " style='image-rendering: pixelated'" if scale > 1 else ""
    told = escape(f"{raw.name}, developed: {raw.make} {raw.model}, {_exposure(raw)}", quote=True)
    size = f"width='{scale * width}' height='{scale * height}'"
    return f"<img src='data:image/jpeg;base64,{text}' {size} alt='{told}'{style}>"


def _exposure(raw: Raw) -> str:
    return f"{write_time(raw.exposure_time_s)}, f/{raw.f_number:.4g}, ISO {raw.iso}"


def _facts(raw: Raw) -> list[tuple[str, str]]:
    """Return quantities and their values with units."""
    height, width = raw.dn.shape
    codes = raw.dn[raw.active]
    at_white = np.count_nonzero(codes >= raw.white_level_dn) / codes.size
    files = ", ".join(path.name for path in vars(files_of(raw.name, "")).values())
    found = [
        ("size", f"{width} × {height} photosites, {raw.cfa}, {raw.bit_depth} bit"),
        ("camera", f"{raw.make} {raw.model}"),
        ("lens", raw.lens_model),
        ("exposure", _exposure(raw)),
        ("mean electrons", _mean_electrons(raw)),
        ("mean code", f"{codes.mean():.5g} DN, black {raw.black_level_dn:g} DN, white {raw.white_level_dn} DN"),
        ("at the white level", f"{100 * at_white:.3g} % of the photosites"),
        ("taken", raw.date_time or ""),
        ("truth", ", ".join(["mean electrons", "noise-free codes", *raw.truth])),
        ("files of photosite.save", files),
    ]
    return [(name, text) for name, text in found if text]


def _mean_electrons(raw: Raw) -> str:
    """Return the means of all photosites and of each colour, of the truth; a frame whose truth cannot be made tells why."""
    try:
        electrons = raw.mean_electrons[raw.active]
    except PhotositeError as error:
        return str(error)
    pattern = Cfa.named(raw.cfa)
    rows, columns = pattern.period
    top, left = raw.edges[:2]
    sums: dict[str, list[float]] = {}
    for y, planes in enumerate(pattern.block(left, top)):
        for x, plane in enumerate(planes):
            part = electrons[y::rows, x::columns]
            if part.size:
                own = sums.setdefault(pattern.letters[plane], [0.0, 0.0])
                own[0] += float(part.sum(dtype=np.float64))
                own[1] += part.size
    text = f"{electrons.mean(dtype=np.float64):.4g} e⁻"
    if raw.cfa == "MONO":
        return text
    colors = sorted(sums, key=pattern.letters.index)
    return f"{text} ({', '.join(f'{color} {sums[color][0] / sums[color][1]:.4g}' for color in colors)})"
