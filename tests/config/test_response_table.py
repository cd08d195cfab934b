"""Quantum efficiency from CSV: the numbers of the file, on an even grid, in whatever units and columns it has."""

import numpy as np
import pytest
from helpers.damaged_files import damaged

from simulator.config import load_camera, load_shot, load_sweep
from simulator.config.document import read_document
from simulator.config.document_merge import parse_override
from simulator.config.response_table import read_response_table
from simulator.config.study_file import Study
from simulator.errors import PhotositeError

COLORS = "wavelength_nm,red,green,blue\n400,0.02,0.05,0.4\n450,0.03,0.1,0.5\n550,0.1,0.55,0.1\n700,0.4,0.1,0.02\n"


def camera_of(tmp_path, text: str, more: str = "", name: str = "qe.csv"):
    (tmp_path / name).write_text(text, encoding="utf-8")
    (tmp_path / "camera.yaml").write_text(f"base: sony_a7s2\nresponse: {{file: {name}{more}}}\n", encoding="utf-8")
    return load_camera(str(tmp_path / "camera.yaml"))


def mono_camera(tmp_path, text: str):
    (tmp_path / "qe.csv").write_text(text, encoding="utf-8")
    (tmp_path / "camera.yaml").write_text("base: ideal\nresponse: {file: qe.csv}\n", encoding="utf-8")
    return load_camera(str(tmp_path / "camera.yaml")).response


def test_a_camera_has_the_curves_of_its_file(tmp_path):
    response = camera_of(tmp_path, COLORS).response
    at_nm = np.array([400.0, 450.0, 550.0, 700.0])
    chosen = np.searchsorted(response.wavelengths_nm, at_nm)
    assert response.wavelengths_nm[chosen].tolist() == at_nm.tolist()
    expected = [[0.02, 0.05, 0.4], [0.03, 0.1, 0.5], [0.1, 0.55, 0.1], [0.4, 0.1, 0.02]]
    np.testing.assert_allclose(response.quantum_efficiency[chosen], expected, rtol=1e-15)


def test_between_the_lines_the_curve_is_straight_on_the_coarsest_grid_that_holds_them(tmp_path):
    response = camera_of(tmp_path, COLORS).response
    assert np.diff(response.wavelengths_nm).tolist() == [50.0] * 6
    assert response.quantum_efficiency[2] == pytest.approx([0.065, 0.325, 0.3])


@pytest.mark.parametrize(
    "text",
    [
        "Wavelength (nm);R [%];G [%];B [%]\n400;2;5;40\n450;3;10;50\n550;10;55;10\n700;40;10;2\n",
        "lambda_um\tb\tg\tr\n0.4\t0.4\t0.05\t0.02\n0.7\t0.02\t0.1\t0.4\n0.55\t0.1\t0.55\t0.1\n0.45\t0.5\t0.1\t0.03\n",
        "\ufeff# a data sheet, figure 7\n" + COLORS.replace(",", ", "),
    ],
    ids=["percent and semicolons", "any order, micrometres", "byte order mark, comment, spaces"],
)
def test_units_order_and_separators_make_no_difference(tmp_path, text):
    one, other = camera_of(tmp_path, COLORS).response, camera_of(tmp_path, text, name="other.csv").response
    np.testing.assert_allclose(other.wavelengths_nm, one.wavelengths_nm, rtol=1e-15)
    np.testing.assert_allclose(other.quantum_efficiency, one.quantum_efficiency, rtol=1e-14)


def test_a_peak_beside_the_file_scales_the_curves(tmp_path):
    response = camera_of(tmp_path, COLORS, ", peak_quantum_efficiency: 0.3").response
    assert response.quantum_efficiency.max() == pytest.approx(0.3)


def test_a_file_replaces_curves_and_scale_of_the_base(tmp_path):
    (tmp_path / "qe.csv").write_text(COLORS, encoding="utf-8")
    (tmp_path / "camera.yaml").write_text("base: raspberry_pi_hq\nresponse: {file: qe.csv}\n", encoding="utf-8")
    assert load_camera(str(tmp_path / "camera.yaml")).response.quantum_efficiency.max() == pytest.approx(
        0.55, rel=1e-15
    )  # its own is 0.6
    own = "{file: qe.csv, wavelengths: {start: 400 nm, step: 10 nm}}"
    (tmp_path / "camera.yaml").write_text(f"base: raspberry_pi_hq\nresponse: {own}\n", encoding="utf-8")
    with pytest.raises(PhotositeError, match="camera.response.wavelengths: stands in qe.csv, too"):
        load_camera(str(tmp_path / "camera.yaml"))


SHOT = """\
scene: {chart: flat_field, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: f/4}
exposure: {time: 1/100 s, iso: 100}
camera: CAMERA
"""


def shots_with_file(tmp_path, camera: str, file: str, more: tuple[str, ...] = ()):
    """The shot of a camera whose response.file is set by --set, by a sweep and by a study."""
    (tmp_path / "shot.yaml").write_text(SHOT.replace("CAMERA", camera), encoding="utf-8")
    yield load_shot(tmp_path / "shot.yaml", [f"camera.response.file={tmp_path / file}", *more])
    sweep = f"sweep: {{vary: {{camera.response.file: [{file}]}}}}\n"
    (tmp_path / "sweep.yaml").write_text(SHOT.replace("CAMERA", camera) + sweep, encoding="utf-8")
    yield load_sweep(tmp_path / "sweep.yaml", more)[0].shot()
    study = f"study: s\nshot: ./shot.yaml\nvary:\n  - camera.response.file: [{file}]\n"
    (tmp_path / "study.yaml").write_text(study, encoding="utf-8")
    settings = [parse_override(text) for text in more]
    yield Study(read_document(tmp_path / "study.yaml"), {}, settings)[0].shot()


@pytest.mark.parametrize("camera", ["raspberry_pi_hq", "nikon_d850", "./own.yaml", "{base: ./own.yaml, make: Nobody}"])
def test_a_file_that_is_set_replaces_curves_and_scale_of_the_base_too(tmp_path, camera):
    """The base has a file and a scale beside it, and own.yaml curves of its own over another base's."""
    (tmp_path / "qe.csv").write_text(COLORS, encoding="utf-8")
    curves = "{file: null, wavelengths: {start: 400 nm, step: 100 nm}, relative: [[1, 1, 1], [1, 1, 1]], source: none}"
    (tmp_path / "own.yaml").write_text(f"base: nikon_d850\nresponse: {curves}\n", encoding="utf-8")
    for shot in shots_with_file(tmp_path, camera, "qe.csv"):
        assert shot.camera.response.quantum_efficiency.max() == pytest.approx(0.55, rel=1e-15)
        assert not [keys for keys, _ in shot.camera.sources if keys.startswith("response")]


def test_a_scale_of_the_shot_or_that_is_set_too_holds_beside_a_file_that_is_set(tmp_path):
    (tmp_path / "qe.csv").write_text(COLORS, encoding="utf-8")
    (tmp_path / "shape.csv").write_text("wavelength_nm,red,green,blue\n400,0,0,1\n700,1,1,0\n", encoding="utf-8")
    own = "{base: nikon_d850, response: {file: shape.csv, peak_quantum_efficiency: 0.3}}"
    for camera, more in ((own, ()), ("nikon_d850", ("camera.response.peak_quantum_efficiency=0.3",))):
        for shot in shots_with_file(tmp_path, camera, "qe.csv", more):
            assert shot.camera.response.quantum_efficiency.max() == pytest.approx(0.3, rel=1e-15)


def test_a_camera_without_filters_has_one_curve(tmp_path):
    response = mono_camera(tmp_path, "wavelength,QE (%)\n400,30\n700,60\n")
    assert response.channels == 1 and response.quantum_efficiency.ravel().tolist() == pytest.approx([0.3, 0.6])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "its columns are none; its first line names the columns, such as wavelength_nm,red,green,blue"),
        ("nm,red\n400,1\n", "its columns are nm,red; its first line"),
        ("wavelength,red,green\n400,1,1\n500,1,1\n", "its columns are wavelength,red,green; "),
        ("wavelength,qe\n400,0.5\n", "holds 1 lines of numbers"),
        ("wavelength,qe\n400,0.5\n500,half\n", "line 2 of its numbers is 500,half; give 2 finite numbers"),
        ("wavelength,qe\n400,0.5\n500,nan\n", "line 2 of its numbers is 500,nan"),
        ("wavelength,qe\n400,0.5\n400,0.6\n", "names a wavelength twice"),
        ("wavelength,qe\n400,30\n500,60\n", "run from 30 to 60 electrons per photon.*write % behind"),
        ("wavelength,qe\n400,-0.1\n500,0.6\n", "run from -0.1 to 0.6"),
        ("wavelength,qe\n0.4,0.1\n0.5,0.6\n", "run from 0.4 nm to 0.5 nm; give nm, or name the column wavelength_um"),
        ("wavelength_%,qe\n400,0.1\n500,0.6\n", "wavelength has the unit %; give nm or um"),
        ("wavelength,qe_nm\n400,0.1\n500,0.6\n", "mono has the unit nm; give % or percent"),
        ("wavelength,qe\n" + "".join(f"{400.01 * n},0.1\n" for n in (1, 2.123, 4.4)), "no even grid"),
    ],
)
def test_tables_that_are_none_are_told_with_file_and_fix(tmp_path, text, message):
    with pytest.raises(PhotositeError, match=f"qe.csv.*{message}|{message}"):
        mono_camera(tmp_path, text)


def test_a_file_that_is_not_there_is_told_with_its_path(tmp_path):
    (tmp_path / "camera.yaml").write_text("base: ideal\nresponse: {file: no.csv}\n", encoding="utf-8")
    with pytest.raises(PhotositeError, match=r"camera.response.file = no.csv: no such file: .*no.csv"):
        load_camera(str(tmp_path / "camera.yaml"))


def test_damaged_tables_are_refused_with_a_message_or_read(tmp_path):
    path, refused = tmp_path / "qe.csv", 0
    for number in range(60):
        path.write_bytes(damaged(COLORS.encode(), np.random.default_rng([3, number])))
        try:
            read_response_table(path)
        except PhotositeError as error:
            assert f"{error}".isprintable()
            refused += 1
    assert refused > 10


def test_bytes_that_are_no_text_are_told(tmp_path):
    (tmp_path / "qe.csv").write_bytes(b"wavelength,qe\n\xff\xfe,1\n")
    (tmp_path / "camera.yaml").write_text("base: ideal\nresponse: {file: qe.csv}\n", encoding="utf-8")
    with pytest.raises(PhotositeError, match=r"qe.csv: cannot be read .* export it again as CSV"):
        load_camera(str(tmp_path / "camera.yaml"))
