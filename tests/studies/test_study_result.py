"""The table of a study holds what was varied, resolved and measured, with units, and reads back as rows, table and dataset."""

import csv
import sys

import numpy as np
import pytest
from helpers.small_study import STUDY, small_study

from simulator.errors import PhotositeError
from simulator.studies.study_result import load
from simulator.studies.study_run import run_study
from simulator.studies.study_table import has_parquet

TEXT = STUDY + "  mine: {python: own.rows}\n"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    folder = tmp_path_factory.mktemp("study")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        run_study(small_study(folder, TEXT), folder / "out")
        sys.modules.pop("own")
    return load(folder / "out")


def test_columns_say_what_they_hold(result):
    assert result.keys("axis") == ["exposure.iso", "lens.f_number", "exposure.time"]
    axis = {name: (result.columns[name]["unit"], result.columns[name]["type"]) for name in result.keys("axis")}
    assert axis == {"exposure.iso": ("", "number"), "lens.f_number": ("", "number"), "exposure.time": ("s", "number")}
    assert result.columns["grey.noise_e"] == {
        "kind": "measured", "unit": "e-", "title": "grey noise e", "type": "number", "quantity": "patch"
    }  # fmt: skip
    assert result.columns["grey.mean_dn.sigma"]["kind"] == "sigma" and result.keys("run") == ["seconds"]
    assert {"index", "name", "state", "error", "command", "predicted_error_sigma", "predicted_seconds"} == set(
        result.keys("point")
    )


def test_resolved_values_have_units_and_no_curves(result):
    row, columns = result.rows[0], result.columns
    assert (row["lens.focal_length"], columns["lens.focal_length"]["unit"]) == (50.0, "mm")
    assert (row["lens.focus_distance"], columns["lens.focus_distance"]["unit"]) == (np.inf, "m")
    assert (row["scene.chart"], columns["scene.chart"]["type"]) == ("flat_field", "text")
    assert row["camera.window.width"] == 64 and row["camera.stages.full_well.capacity"] == 165963
    assert not any(key.startswith(("camera.iso_table", "camera.response.quantum")) for key in columns)
    assert "exposure.iso" not in result.keys("resolved")  # it is an axis


def test_what_a_metered_camera_chose_is_the_resolved_value(tmp_path):
    shot = "{mode: aperture_priority, iso: 100}"
    text = STUDY.replace(", exposure.time: [1/60 s, 1/15 s]", "").replace("measure:", "set: {exposure: " + shot + "}\nmeasure:")
    study = small_study(tmp_path, text)
    run_study(study, tmp_path / "out")
    rows = load(tmp_path / "out").rows
    times = {(row["exposure.iso"], row["lens.f_number"]): row["exposure.time"] for row in rows}
    # H of the meter falls with the ISO and rises with the square of the f-number: 4 times each, up to steps of the dial.
    assert times[100, 4.0] / times[400, 4.0] == pytest.approx(4, rel=0.13)
    assert times[100, 8.0] / times[100, 4.0] == pytest.approx(4, rel=0.13)


def test_curves_are_read_with_their_units(result):
    point = result.rows[2]["name"]
    curve = result.curve(point, "mine")
    assert (curve.x_name, curve.x_unit, curve.y_name, curve.y_unit) == ("row", "", "mean", "DN")
    assert result.rows[2]["mine.range"] == np.ptp(curve.y) and len(curve.x) == 48
    assert (result.curve(point, "mine.profile").y == curve.y).all()
    with pytest.raises(PhotositeError, match="no such curve; there are mine.profile"):
        result.curve(point, "yours")
    with pytest.raises(PhotositeError, match="no curves of nobody"):
        result.curve("nobody", "mine")


def test_the_csv_is_the_table(result):
    with open(result.folder / "points.csv", newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert list(lines[0]) == list(result.columns)
    for line, row in zip(lines, result.rows, strict=True):
        assert [float(line[name]) for name in result.keys("measured")] == [row[name] for name in result.keys("measured")]


def test_the_study_and_its_shot_stand_in_the_folder(result):
    assert result.study["measure"]["mine"] == {"python": {"function": "own.rows"}}
    assert result.study["resolved"]["shot"]["lens"]["focal_length"] == "50 mm"


def test_a_table_of_pandas(result):
    pandas = pytest.importorskip("pandas", reason="an extra of studies")
    table = result.table()
    assert isinstance(table, pandas.DataFrame) and list(table) == list(result.columns) and len(table) == 6
    assert table["grey.snr"].tolist() == [row["grey.snr"] for row in result.rows]
    assert table["exposure.iso"].dtype == np.int64 and table["lens.focus_distance"].dtype == np.float64


def test_a_dataset_of_xarray_over_the_axes(result):
    pytest.importorskip("xarray", reason="an extra of studies")
    found = result.dataset()
    assert dict(found.sizes) == {"exposure.iso": 3, "lens.f_number": 2}
    assert found["exposure.time"].dims == ("lens.f_number",) and found["exposure.time"].values.tolist() == [1 / 60, 1 / 15]
    one = found["grey.snr"].sel({"exposure.iso": 400, "lens.f_number": 8.0})
    row = next(row for row in result.rows if (row["exposure.iso"], row["lens.f_number"]) == (400, 8.0))
    assert float(one) == row["grey.snr"] and found["grey.noise_e"].attrs["units"] == "e-"


@pytest.mark.slow
def test_the_parquet_file_is_the_table(result):
    pyarrow = pytest.importorskip("pyarrow", reason="170 MB; `make test-all` installs it")
    from pyarrow import parquet

    table = parquet.read_table(result.folder / "points.parquet")
    assert table.column_names == list(result.columns)
    assert table["grey.snr"].to_pylist() == [row["grey.snr"] for row in result.rows]
    assert table.schema.field("exposure.time").metadata[b"unit"] == b"s" and table.schema.field("name").type == pyarrow.string()


@pytest.mark.parametrize("package, ask", [("pandas", "table"), ("xarray", "dataset")])
def test_what_needs_a_package_that_is_missing_says_so(result, monkeypatch, package, ask):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(PhotositeError, match=r"pip install 'photosite\[study\]'"):
        getattr(result, ask)()


def test_parquet_is_written_where_pyarrow_is_installed(result):
    assert (result.folder / "points.parquet").is_file() == has_parquet()


def test_a_folder_without_results_is_told(tmp_path):
    with pytest.raises(PhotositeError, match="holds no results of a study"):
        load(tmp_path)
    (tmp_path / "points.csv").write_text("index\n0\n")
    (tmp_path / "columns.json").write_text("{")
    with pytest.raises(PhotositeError, match="columns.json: cannot be read"):
        load(tmp_path)


def test_the_table_of_a_run_that_is_interrupted_has_all_that_is_known(tmp_path):
    """Done before, taken until then, and what is left: stale where there is a record, else missing."""
    study, out = small_study(tmp_path), tmp_path / "out"
    run_study(study, out)
    for index, text in ((1, None), (3, "{}"), (4, None)):
        path = out / "points" / f"{study[index].name}.json"
        path.unlink() if text is None else path.write_text(text)

    def interrupt(outcome):
        if outcome.how == "taken":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, out, report=interrupt)
    rows = load(out).rows
    states = [row["state"] for row in rows]
    assert [states[index] for index in (0, 2, 5)] == ["done"] * 3
    assert sorted(states[index] for index in (1, 3, 4)) in (["done", "missing", "stale"], ["done", "missing", "missing"])
    others = [row for row in rows if row["state"] != "done"]
    assert all(row["grey.snr"] is None and row["exposure.time"] is not None for row in others)
