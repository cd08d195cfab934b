"""Notebooks show frames, shots, plans and cameras: what is shown is true, self-contained and readable without a picture."""

import base64
import dataclasses
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.html_pieces import Piece, check_piece
from helpers.raw_frame import random_frame
from typer.testing import CliRunner

import photosite
from simulator.command_line.commands import app
from simulator.config import shipped_names
from simulator.config.camera_file import list_sources, read_camera_document
from simulator.displays import display_html
from simulator.displays.camera_display import iso_table

SMALL = {"camera.window": {"x": 1800, "y": 1200, "width": 64, "height": 48}}


@pytest.fixture(scope="module")
def shot() -> photosite.Shot:
    return photosite.load_shot("color_checker", SMALL | {"exposure.iso": 1600})


@pytest.fixture(scope="module")
def raw(shot) -> photosite.Raw:
    return photosite.simulate(shot)


@pytest.mark.parametrize("kind", ["shot", "plan", "raw", "camera"])
def test_a_notebook_asks_an_object_for_its_display(kind, shot, raw):
    formatters = pytest.importorskip("IPython.core.formatters", reason="needs ipykernel, which notebooks run on")
    shown = {"shot": shot, "plan": photosite.plan(shot), "raw": raw, "camera": shot.camera}[kind]
    data, _ = formatters.DisplayFormatter().format(shown)
    assert data["text/html"] == display_html(shown)
    check_piece(data["text/html"])


def test_only_these_have_a_display():
    with pytest.raises(TypeError, match="int has no display"):
        display_html(3)


def test_a_raw_shows_its_picture_and_its_means(raw):
    piece = check_piece(display_html(raw))
    ((_, image),) = [one for one in piece.elements if one[0] == "img"]
    assert base64.b64decode(image["src"].partition("base64,")[2])[:3] == b"\xff\xd8\xff"  # JPEG
    assert "ISO 1600" in image["alt"] and image["width"] == "256" and image["height"] == "192"  # 64 x 48 in large pixels
    mean_e = raw.mean_electrons.astype(np.float64)
    means = {"R": mean_e[::2, ::2], "G": np.stack([mean_e[::2, 1::2], mean_e[1::2, ::2]]), "B": mean_e[1::2, 1::2]}
    colors = ", ".join(f"{name} {part.mean():.4g}" for name, part in means.items())
    assert piece.value("mean electrons") == f"{mean_e.mean():.4g} e⁻ ({colors})"
    assert piece.value("size") == "64 × 48 photosites, RGGB, 14 bit" and piece.value("exposure") == "1/15 s, f/4, ISO 1600"
    assert piece.value("files of photosite.save") == "color_checker.dng, color_checker.truth.exr, color_checker.json"


def test_the_share_at_white_is_that_of_the_lit_photosites():
    raw = random_frame(40, 40, active_area=(0, 10, 40, 40), mean_electrons=np.ones((40, 40), np.float32))
    raw.dn[:, :10], raw.dn[:, 10:] = 2**14 - 1, 700
    raw.dn[:12, 10:20] = 2**14 - 1
    assert check_piece(display_html(raw)).value("at the white level") == "10 % of the photosites"


def test_text_of_files_is_no_html():
    raw = random_frame(make="<script>alert(1)</script>", model="a'b\"c", lens_model="<img src=x onerror=y>")
    piece = check_piece(display_html(raw))
    assert piece.value("lens") == "<img src=x onerror=y>" and piece.value("camera") == "<script>alert(1)</script> a'b\"c"


@pytest.mark.parametrize("missing", ["rawpy", "OpenImageIO"])
def test_a_raw_without_a_library_for_pictures_shows_its_table(missing, raw, monkeypatch):
    monkeypatch.setitem(sys.modules, missing, None)
    piece = check_piece(display_html(raw))
    assert "No picture: " in piece.text and missing in piece.text and piece.value("size").startswith("64 × 48")


def test_a_raw_that_no_converter_develops_shows_its_table():
    piece = check_piece(display_html(random_frame(40, 5000, mean_electrons=np.ones((40, 5000), np.float32))))
    assert "No picture: preview = 5000 x 40 photosites: too narrow" in piece.text


def test_a_raw_whose_truth_cannot_be_made_says_why():
    def fail() -> np.ndarray:
        raise photosite.PhotositeError("the device is gone")

    assert check_piece(display_html(random_frame(mean_electrons=fail))).value("mean electrons") == "the device is gone"


def test_a_display_computes_no_truth_but_what_it_shows():
    def fail() -> np.ndarray:
        raise AssertionError("the noise-free codes were computed")

    display_html(random_frame(noise_free_dn=fail, resolved=fail))


def test_a_shot_shows_what_was_stated_and_what_holds_anyway(shot):
    rows = {row[0]: row[1:] for row in Piece(display_html(shot)).rows}
    assert rows["exposure.iso"] == ["1600", ""] and rows["exposure.time"] == ["1/15 s", ""]
    assert rows["lens.focal_length"] == ["50 mm", ""] and rows["lens.transmittance"] == ["1.0", "default"]
    assert rows["tolerance"] == ["0.1", "default"] and rows["camera.window.width"] == ["64", ""]
    assert rows["camera.iso_table"][0].endswith("lines, 50 to 25600") and "camera.source" not in rows


def test_a_shot_of_arrays_shows_its_parts(shot):
    rgb = np.full((30, 45, 3), 0.18)
    scene = photosite.scene_from_rgb(rgb, luminance_cd_m2=120, illuminant="D65")
    made = photosite.Shot(scene, photosite.ThinLens(35.0, 2.0, 3.0), shot.exposure, shot.camera)
    rows = {row[0]: row[1:] for row in check_piece(display_html(made)).rows}
    assert rows["scene"] == ["Scene", ""] and rows["lens.f_number"] == ["f/2", ""]
    assert not any(name.startswith("scene.") for name in rows)


def test_a_shot_that_no_file_can_hold_shows_the_classes_of_its_parts(shot):
    lens = SimpleNamespace(**{name: getattr(shot.lens, name) for name in ("f_number", "focal_length_mm")})
    piece = check_piece(display_html(dataclasses.replace(shot, lens=lens)))
    assert piece.value("lens") == "SimpleNamespace" and piece.value("camera") == "Camera"


@pytest.mark.parametrize("name", shipped_names("shots"))
def test_every_shot_of_the_library_has_a_display(name):
    piece = check_piece(display_html(photosite.load_shot(name)))
    assert any(row[0].startswith("scene.") for row in piece.rows)


def test_a_plan_shows_the_tables_of_explain(shot, tmp_path):
    words = ["color_checker", "--set", f"camera.window={SMALL['camera.window']}".replace("'", ""), "--set", "exposure.iso=1600"]
    page = Piece(CliRunner().invoke(app, ["explain", *words, "--format", "html"]).output)
    piece = check_piece(display_html(photosite.plan(shot)))
    steps = page.rows.index(["stage", "kept", "why"])
    passes = next(place for place, row in enumerate(page.rows) if row[:3] == ["pass", "kept", "method"])
    errors = next(place for place, row in enumerate(page.rows) if row[:2] == ["effect", "cause"])
    last = next(place for place, row in enumerate(page.rows) if row[:1] == ["quantity"])
    told = [*page.rows[steps + 1 : passes], *page.rows[passes + 1 : errors]]
    kept = [[row[0], *row[2:]] for row in told if row[1] == "yes"]
    skipped = [[row[0], row[2]] for row in told if row[1] == "no"]
    assert kept and skipped and all(row in piece.rows for row in [*kept, *skipped, *page.rows[errors:last]])
    assert len(piece.rows) == len(told) + last - errors + 4  # and the heads of four tables
    assert f"{sum(row[1] == 'no' for row in page.rows[steps:passes])} skipped, and why" in piece.text
    assert "predicted error [sigma]: 0" in piece.text and "predicted time [ms]" in piece.text


@pytest.mark.parametrize("name", shipped_names("cameras"))
def test_a_camera_shows_its_noise_and_where_its_numbers_come_from(name):
    camera = photosite.load_camera(name)
    piece = check_piece(display_html(camera))
    rows = {row[0]: row for row in piece.rows}
    for iso in camera.isos:
        setting = camera.iso_setting(iso)
        assert float(rows[f"{iso}"][1]) == pytest.approx(setting.gain_dn_per_e, rel=1e-4)
        assert [float(level) for level in rows[f"{iso}"][4:6]] == pytest.approx(setting.levels_dn, rel=1e-4)
    stated = list_sources(
        {key: part for key, part in read_camera_document(name).data["camera"].items() if key != "typical_stages"}
    )
    assert stated and [row for row in piece.rows if row[1:] and row[1] in dict(stated).values()] == [
        [keys or "all", text] for keys, text in stated
    ]


def test_the_noise_of_a_camera_is_that_of_its_iso_table():
    camera = photosite.load_camera("sony_a7s2")
    for iso, gain, noise_dn, noise_e, *_ in iso_table(camera).rows:
        setting = camera.iso_setting(iso)
        variance = setting.read_noise_dn**2 + (setting.row_noise_dn or 0.0) ** 2 + 1 / 12
        assert noise_dn == pytest.approx(np.sqrt(variance), rel=1e-6)
        assert noise_e == pytest.approx(noise_dn / gain, rel=1e-9)


def test_a_camera_without_matplotlib_shows_its_tables(monkeypatch):
    camera = photosite.load_camera("sony_a7s2")
    assert "image/svg+xml" in display_html(camera)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert "<img" not in display_html(camera) and check_piece(display_html(camera)).value("pixel pitch") == "8.4 µm"


def test_a_shot_keeps_the_sources_of_its_camera(shot):
    assert shot.camera.sources == photosite.load_camera("sony_a7s2").sources != ()
    assert shot.camera == dataclasses.replace(shot.camera, sources=())
