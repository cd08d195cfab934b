"""Which plots the axes of a study suggest, and which lines they have."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.camera_builders import small_camera

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.measurement.quantities import Curve, MeasuredFrame
from simulator.measurement.quantities.registry import QUANTITIES
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.scene.charts import ChartScene
from simulator.sensor.camera.camera_sections import IsoSetting
from simulator.studies.report.study_data import StudyFolder, format_value
from simulator.studies.report.study_plots import MOST_LINES, study_plots
from simulator.studies.report.worst_points import WORSE, worst_points


@dataclass
class Table:
    """A table in memory. curves: of points, by the point's name."""

    columns: dict[str, dict[str, Any]]
    rows: list[dict[str, Any]]
    curves: dict[str, Curve] = field(default_factory=dict)

    def curve(self, name: str, label: str) -> Curve:
        if name not in self.curves:
            raise PhotositeError("no curves", file=name)
        return self.curves[name]


def study_of(axes: dict[str, str], measured: dict[str, str], rows: list[dict[str, Any]], **more: Any) -> StudyFolder:
    """A study. axes: units by key. measured: quantities by column."""
    columns: dict[str, dict[str, Any]] = {
        key: {"kind": "axis", "unit": unit, "title": key.rpartition(".")[2]} for key, unit in axes.items()
    }
    for name, quantity in measured.items():
        columns[name] = {"kind": "measured", "unit": "", "title": name.replace(".", " "), "quantity": quantity}
    columns |= {
        "seconds": {"kind": "run", "unit": "s", "title": "time"},
        "predicted_error_sigma": {"kind": "point", "unit": "", "title": "error"},
    }
    full = [
        {"name": f"p{place}", "state": "done", "seconds": 1.0, "predicted_error_sigma": 0.1, **row}
        for place, row in enumerate(rows)
    ]
    table = Table(columns, full, more.get("curves", {}))
    return StudyFolder(table, Path("nowhere"), "s", "", more.get("labels", []), "", {})


def lines(study: StudyFolder, name: str) -> dict[str, list[tuple[float, float]]]:
    (plot,) = (plot for plot in study_plots(study) if plot.name == name)
    return {line.label: list(zip(line.curve.x.tolist(), line.curve.y.tolist(), strict=True)) for line in plot.lines}


def test_a_line_for_each_value_of_the_other_axis_in_the_order_of_the_axis():
    rows = [{"exposure.iso": iso, "b": b, "g.snr": iso * b} for b in (2, 1) for iso in (400, 100)]
    study = study_of({"exposure.iso": "", "b": ""}, {"g.snr": "patch"}, rows)
    assert lines(study, "g.snr_exposure.iso") == {"b 2": [(100, 200), (400, 800)], "b 1": [(100, 100), (400, 400)]}
    assert [plot.name for plot in study_plots(study)] == ["g.snr_exposure.iso"]  # SNR is drawn against the ISO where it varies


def test_an_axis_that_does_not_matter_makes_no_lines():
    rows = [{"exposure.iso": iso, "b": b, "g.snr": iso + 1.0} for b in (2, 1) for iso in (400, 100)]
    study = study_of({"exposure.iso": "", "b": ""}, {"g.snr": "patch"}, rows)
    assert lines(study, "g.snr_exposure.iso") == {"": [(100, 101.0), (400, 401.0)]}


def test_axes_that_vary_together_are_one():
    rows = [{"lens.f_number": stop, "exposure.time": 1.0 / stop, "o.a": stop**2} for stop in (2.0, 4.0, 8.0)]
    study = study_of({"lens.f_number": "", "exposure.time": "s"}, {"o.a": "python"}, rows)
    assert lines(study, "o.a_lens.f_number") == {"": [(2, 4), (4, 16), (8, 64)]}


def test_random_values_are_points_that_are_not_joined():
    drawn = np.random.default_rng(1).uniform(1.0, 9.0, (6, 2)).tolist()
    rows = [{"a": a, "b": b, "o.a": a * b} for a, b in drawn]
    plots = study_plots(study_of({"a": "m", "b": ""}, {"o.a": "python"}, rows))
    assert [plot.name for plot in plots] == ["o.a_a", "o.a_b"]
    assert all(not line.has_line and line.has_points and len(line.curve.x) == 6 for plot in plots for line in plot.lines)


def test_variants_are_lines_and_no_axis():
    rows = [{"lens": lens, "exposure.iso": iso, "g.snr": iso * len(lens)} for lens in ("bare", "t") for iso in (100, 200)]
    found = lines(study_of({"lens": "", "exposure.iso": ""}, {"g.snr": "patch"}, rows), "g.snr_exposure.iso")
    assert list(found) == ["lens bare", "lens t"]


def test_of_many_lines_some_are_drawn_in_even_steps():
    rows = [{"exposure.iso": iso, "b": b, "g.snr": 1.0 * iso * b} for b in range(1, 30) for iso in (100, 400)]
    found = lines(study_of({"exposure.iso": "", "b": ""}, {"g.snr": "patch"}, rows), "g.snr_exposure.iso")
    assert len(found) == MOST_LINES and list(found)[0] == "b 1" and list(found)[-1] == "b 29"


def test_photon_transfer_has_a_line_for_each_of_eight_isos_of_many():
    """Signals of several ISOs overlap, so that one line through all of them would go back and forth."""
    isos = [100 * step for step in range(1, 20)]
    rows = [
        {"exposure.iso": iso, "exposure.time": time, "g.mean_dn": iso * time, "g.noise_dn": iso * time**0.5}
        for iso in isos
        for time in (1.0, 4.0, 9.0)
    ]
    study = study_of({"exposure.iso": "", "exposure.time": "s"}, {"g.mean_dn": "patch", "g.noise_dn": "patch"}, rows)
    found = lines(study, "transfer_g")
    assert len(found) == MOST_LINES and list(found)[0] == "ISO 100" and list(found)[-1] == "ISO 1900"
    assert found["ISO 100"] == [(100.0, 100.0), (400.0, 200.0), (900.0, 300.0)]
    (plot,) = (plot for plot in study_plots(study) if plot.name == "transfer_g")
    assert plot.note.endswith("8 of 19 ISOs.")


def test_what_is_the_same_at_all_points_or_is_not_there_has_no_plot():
    rows = [{"exposure.iso": iso, "g.snr": 7.0, "g.noise_dn": None, "g.mean_dn": float("nan")} for iso in (100, 200)]
    measured = {"g.snr": "patch", "g.noise_dn": "patch", "g.mean_dn": "patch"}
    assert study_plots(study_of({"exposure.iso": ""}, measured, rows)) == []
    assert study_plots(study_of({"exposure.iso": ""}, measured, [])) == []


def test_curves_are_those_along_the_axis_that_suits_them():
    rows = [{"exposure.iso": iso, "lens.f_number": stop, "e.mtf50": 1.0 / stop} for iso in (100, 200) for stop in (2.0, 4.0)]
    x = np.linspace(0.0, 1.0, 3)
    curves = {f"p{place}": Curve(x, x * place, "frequency", "cycles/px", "transfer", "") for place in (0, 1, 2)}
    study = study_of({"exposure.iso": "", "lens.f_number": ""}, {"e.mtf50": "mtf"}, rows, curves=curves, labels=["e.transfer"])
    assert list(lines(study, "curve_e.transfer")) == ["ISO 100, f_number 2", "ISO 100, f_number 4"]


def test_the_worst_points_are_failed_ones_then_extremes_that_differ():
    rows = [{"exposure.iso": iso, "g.snr": 100.0 / iso, "g.mean_dn": 5.0, "seconds": 1.0 * iso} for iso in (100, 200, 400)]
    rows.append(
        {"exposure.iso": 800, "state": "failed", "error": "no light", "g.snr": None, "g.mean_dn": None, "seconds": None}
    )
    found = worst_points(study_of({"exposure.iso": ""}, {"g.snr": "patch", "g.mean_dn": "patch"}, rows))
    assert [(one.reason, one.row["name"]) for one in found] == [
        ("failed: no light", "p3"),
        ("least g SNR", "p2"),
        ("most run time", "p2"),
    ]


def test_every_figure_that_can_be_worst_is_one_that_its_quantity_yields():
    scenes = {name: ChartScene(name, 100.0) for name in ("color_checker", "slanted_edge")}
    camera = small_camera(144, 96, "RGGB", iso_table={100: IsoSetting(0.01, 1.0)})
    frames = {}
    for name, scene in scenes.items():
        shot = Shot(scene, ThinLens(50.0, 8.0, 2.0, cos4=False), Exposure(0.01), camera)
        frames[name] = MeasuredFrame.from_raw(simulate(shot), shot)
    for quantity, worse in WORSE.items():
        frame = frames["slanted_edge" if quantity in ("mtf", "blur_length") else "color_checker"]
        figures = QUANTITIES[quantity]().measure(frame).figures
        assert worse.keys() <= figures.keys(), quantity
    assert set(WORSE) == set(QUANTITIES) - {"python"}


@pytest.mark.parametrize(
    ("quantity", "figure", "reason"),
    [
        ("dynamic_range", "range_ev", "least"),
        ("mtf", "mtf50_lw_ph", "least"),
        ("color_error", "largest", "most"),
        ("blur_length", "residual", "most"),
    ],
)
def test_figures_of_every_quantity_have_a_worst_point(quantity, figure, reason):
    rows = [{"a": a, f"x.{figure}": 1.0 + a} for a in (1, 2)]
    found = worst_points(study_of({"a": ""}, {f"x.{figure}": quantity}, rows))
    assert [(one.reason.split()[0], one.row["name"]) for one in found] == [(reason, "p0" if reason == "least" else "p1")]
    assert worst_points(study_of({"a": ""}, {f"x.{figure}": "python"}, rows)) == []


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (3, "3"), (0.123456, "0.12346"), (165963.4, "165963"), (1.5e9, "1.5e+09"), (float("nan"), "nan"), ("a", "a")],
)
def test_values_are_read_with_five_digits(value, text):
    assert format_value(value) == text
