"""Lists of point spread functions: a CSV file with one line for each kernel over blur radius, field and colour."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.optics.lens.psf_list import listed_file, read_lines
from simulator.optics.psf.psf_table import PsfTable

COLUMNS = ("file", "field", "outwards", "blur_radius_px", "channel")
CHANNELS = ("red", "green", "blue")
QUARTERS = {"right": 0, "down": 1, "left": 2, "up": 3}  # turns that bring the direction to the right


@dataclass(frozen=True)
class _Line:
    """One kernel of the list; channel: "" for all."""

    field: float
    blur_radius_px: float
    channel: str
    kernel: np.ndarray
    cells: int


def read_listing(path: Path, pitch_um: float, read: Callable[[str, float], PsfTable]) -> PsfTable:
    """Return the table of a list's kernels.

    path: of the CSV. Columns: `file`, relative to the list; `field`, share of the half diagonal; `outwards`, where the centre
    of the picture is not, seen from the image point, in the grid as printed (right, left, up or down; needed off the axis);
    `blur_radius_px`, signed; `channel`, red, green, blue or nothing for all. Those left out are 0 and all.
    read: reads a file of one kernel. Raises PhotositeError for a list in which a combination is missing or there twice.
    """
    label = str(path)
    header, rows = read_lines(path)
    strange = [name for name in header if name not in COLUMNS]
    rule = f"give the columns {', '.join(COLUMNS)}, of which file is needed"
    require("file" in header and not strange, "columns", ", ".join(header) or "none", rule, file=label)
    lines: dict[tuple[float, float, str], _Line] = {}
    for number, row in rows:
        line = _read_line(row, path, number, pitch_um, read)
        key = (line.blur_radius_px, line.field, line.channel)
        require(key not in lines, "line", number, "has the blur radius, field and channel of another line", file=label)
        lines[key] = line
    require(bool(lines), "lines", 0, "list one kernel or more", file=label)
    return _join(list(lines.values()), pitch_um, label)


def _read_line(row: dict[str, str], path: Path, number: int, pitch_um: float, read: Callable[[str, float], PsfTable]) -> _Line:
    label, part = str(path), f"line {number}"
    try:
        field, radius = (float(row.get(name) or 0.0) for name in ("field", "blur_radius_px"))
    except ValueError:
        raise PhotositeError("has a field or blur radius that is no number", file=label, part=part) from None
    channel, outwards = row.get("channel", ""), row.get("outwards", "")
    require(channel in ("", *CHANNELS), "channel", channel, f"give {', '.join(CHANNELS)} or nothing", file=label, part=part)
    require(0 <= field <= 1.5, "field", field, "give a share of the half diagonal, 0 or more", file=label, part=part)
    wanted = f"say where the picture's centre is not, seen from the image point: {', '.join(QUARTERS)}"
    require(
        outwards in QUARTERS or field == 0 and not outwards, "outwards", outwards or "nothing", wanted, file=label, part=part
    )
    try:
        table = read(str(listed_file(path, row)), pitch_um)
    except PhotositeError as error:
        raise error.inside(f"{label}: {part}") from None
    single = table.kernels.shape[:3] == (1, 1, 1)
    require(single, "file", row["file"], "holds several kernels; list files of one kernel each", file=label, part=part)
    return _Line(field, radius, channel, np.rot90(table.kernels[0, 0, 0], QUARTERS.get(outwards, 0)), table.cells)


def _join(lines: list[_Line], pitch_um: float, label: str) -> PsfTable:
    """Put the kernels into one grid, in the cells of the finest and as wide as the widest."""
    cells = {line.cells for line in lines}
    require(len(cells) == 1, "cells", sorted(cells), "list files of one kind, .txt or .npy", file=label)
    size = max(len(line.kernel) for line in lines)
    radii, fields = sorted({line.blur_radius_px for line in lines}), sorted({line.field for line in lines})
    found = {line.channel for line in lines}
    channels = ("",) if found == {""} else CHANNELS
    kernels = np.zeros((len(radii), len(fields), len(channels), size, size))
    by_key = {(line.blur_radius_px, line.field, line.channel): line.kernel for line in lines}
    for place in itertools.product(range(len(radii)), range(len(fields)), range(len(channels))):
        radius, field, channel = radii[place[0]], fields[place[1]], channels[place[2]]
        kernel = by_key.get((radius, field, channel), by_key.get((radius, field, "")))
        if kernel is None:
            missing = f"blur radius {radius:g} px, field {field:g}" + (f", {channel}" if channel else "")
            raise PhotositeError(f"has no kernel for {missing}; list every combination", file=label)
        margin = (size - len(kernel)) // 2
        kernels[place][margin : margin + len(kernel), margin : margin + len(kernel)] = kernel
    return PsfTable(kernels, np.array(radii), np.array(fields), cells.pop(), pitch_um, source=label)
