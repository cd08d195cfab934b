"""`photosite mtf`: edges of a raw file."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.markup import escape
from rich.table import Table

from simulator.command_line.output_file import check_output
from simulator.command_line.screen import console, show_files, tell
from simulator.config import length_um
from simulator.errors import PhotositeError
from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.mtf import Mtf
from simulator.measurement.quantities.quantity import Measured
from simulator.measurement.report.figures import FORMATS, write_figure
from simulator.measurement.statistics.edge_search import SIDES_PX, find_edges

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLANES: tuple[Plane, ...] = ("R", "Gr", "Gb", "B")
COLORS = {"R": "#c0392b", "Gr": "#1e8449", "Gb": "#58b368", "B": "#2060b0", "MONO": "#333333"}
SHOWN_PER_PX = 0.75  # frequencies of the plot


def measure_edges(path: Path, areas: list[str], most: int, pixel_pitch: str | None, plot: Path | None, as_json: bool) -> None:
    """Print a line for each colour of each edge, and draw them. Raises PhotositeError."""
    if plot is not None:
        check_output(plot, "--plot", FORMATS, lambda: [path])
    pitch_um = None if pixel_pitch is None else length_um(pixel_pitch, "--pixel-pitch")
    frame = MeasuredFrame.from_file(path)
    edges = {area: _measure_planes(frame, area) for area in ([_to_area(text) for text in areas] or _search(frame, most))}
    if as_json:
        print(json.dumps(_to_data(frame, edges, pitch_um), indent=2))
    else:
        console().print(_make_table(frame, edges, pitch_um))
    if plot is not None:
        write_figure(edge_figure(frame.name, edges), plot)
        show_files(plot, is_data=as_json)


def _to_area(text: str) -> Area:
    """Read TOP,LEFT,HEIGHT,WIDTH. Raises PhotositeError."""
    parts = text.split(",")
    if len(parts) != 4 or not all(part.strip().isdecimal() for part in parts):
        raise PhotositeError("give TOP,LEFT,HEIGHT,WIDTH in photosites, such as 400,600,160,160", key="--area", value=text)
    top, left, height, width = map(int, parts)
    return top, left, height, width


def _search(frame: MeasuredFrame, most: int) -> list[Area]:
    """Return the areas of the frame's edges. Raises PhotositeError where it has none."""
    height, width = (side // 2 * 2 for side in frame.dn.shape)
    black = np.tile(frame.black_level_dn, (height // 2, width // 2))
    codes = frame.dn[:height, :width]
    found = find_edges(codes - black, codes >= frame.white_level_dn, most)
    if not found:
        told = (
            f"no square of {min(SIDES_PX)} to {max(SIDES_PX)} photosites holds one straight edge and nothing else, unclipped, "
        )
        rule = (
            "2 to 43 degrees off the axes; give a part with one by --area TOP,LEFT,HEIGHT,WIDTH, or photograph a slanted edge"
        )
        raise PhotositeError(told + rule, file=frame.name)
    return [edge.area for edge in found]


def _measure_planes(frame: MeasuredFrame, area: Area) -> dict[Plane, Measured]:
    """Measure an edge in each colour; those that cannot be measured are told and left out, all of them an error."""
    found: dict[Plane, Measured] = {}
    planes: tuple[Plane, ...] = ("MONO",) if frame.cfa == "MONO" else PLANES
    for plane in planes:
        try:
            found[plane] = Mtf(area, plane).measure(frame)
        except PhotositeError as error:
            problem = error.replace(part=f"{_area_text(area)}, {plane}")
            if plane == planes[-1] and not found:
                raise problem from error
            tell(f"note: {problem}")
    return found


def _area_text(area: Area) -> str:
    return f"area {','.join(map(str, area))}"


def _make_table(frame: MeasuredFrame, edges: dict[Area, dict[Plane, Measured]], pitch_um: float | None) -> Table:
    from rich.box import SIMPLE_HEAD

    title = f"Edges of {escape(frame.name)}: e-SFR of ISO 12233, of photosites of one colour"
    table = Table(title=title, box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
    heads = ["area", "colour", "MTF50 [c/px]", "[lw/ph]", "MTF at 0.5 c/px", "10-90 % [px]", "angle [deg]", "step [DN]"]
    if pitch_um is not None:
        heads.insert(3, "[c/mm]")
    for head in heads:
        table.add_column(escape(head), justify="left" if head in ("area", "colour") else "right")
    for area, planes in edges.items():
        for index, (plane, measured) in enumerate(planes.items()):
            names = ("mtf50", "mtf50_lw_ph", "nyquist", "rise_px", "angle_deg", "step_dn")
            cells = [_number(measured.figures[name].value) for name in names]
            if pitch_um is not None:
                cells.insert(1, _number(1e3 * measured.figures["mtf50"].value / pitch_um))
            table.add_row(",".join(map(str, area)) if index == 0 else "", plane, *cells)
    return table


def _number(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:.4g}"


def _to_data(frame: MeasuredFrame, edges: dict[Area, dict[Plane, Measured]], pitch_um: float | None) -> dict[str, Any]:
    """Return all numbers and curves as plain data; None for what an edge does not show."""

    def of(measured: Measured) -> dict[str, Any]:
        values = {name: None if math.isnan(figure.value) else figure.value for name, figure in measured.figures.items()}
        if pitch_um is not None and values["mtf50"] is not None:
            values["mtf50_cy_mm"] = 1e3 * measured.figures["mtf50"].value / pitch_um
        curves = {
            name: {"x": one.x.tolist(), "y": one.y.tolist(), "x_unit": one.x_unit, "y_unit": one.y_unit}
            for name, one in measured.curves.items()
        }
        return {**values, "curves": curves}

    found = [
        {"area": list(area), "planes": {plane: of(measured) for plane, measured in planes.items()}}
        for area, planes in edges.items()
    ]
    return {"file": frame.name, "pattern": frame.cfa, "pixel_pitch_um": pitch_um, "edges": found}


def edge_figure(name: str, edges: dict[Area, dict[Plane, Measured]]) -> "Figure":
    """Draw transfer and profile of each edge, a row each. Raises PhotositeError when matplotlib is missing."""
    from simulator.measurement.report.figures import new_figure

    figure, axes = new_figure(len(edges), 2, 10.0, 0.6 + 3.2 * len(edges))
    figure.suptitle(name)
    for (area, planes), left, right in zip(edges.items(), axes[0::2], axes[1::2], strict=True):
        for plane, measured in planes.items():
            transfer, edge = measured.curves["transfer"], measured.curves["edge"]
            kept = transfer.x <= SHOWN_PER_PX
            mtf50 = measured.figures["mtf50"].value
            label = plane if math.isnan(mtf50) else f"{plane}, MTF50 = {mtf50:.3f}"
            left.plot(transfer.x[kept], transfer.y[kept], color=COLORS[plane], linewidth=1, label=label)
            right.plot(edge.x, edge.y, color=COLORS[plane], linewidth=1, label=plane)
        left.axvline(0.5, color="#888888", linewidth=0.8, linestyle=":")
        left.axhline(0.5, color="#888888", linewidth=0.8, linestyle=":")
        left.set(xlabel="cycles per pixel", ylabel="transfer", ylim=(0, None), xlim=(0, SHOWN_PER_PX), title=_area_text(area))
        right.set(xlabel="distance from the edge [px]", ylabel="signal [DN]", title="profile")
        left.legend(frameon=False, fontsize="small")
    return figure
