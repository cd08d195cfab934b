"""The gallery: every topic has a shot that loads and a section of its page, and its series are what physics says they are."""

import re
import shlex
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from data_gen.sources import gallery_scenes
from data_gen.sources.gallery_scenes import (
    BOARDS,
    LAMP_DISTANCES_M,
    SENSOR_WIDTH_MM,
    TOPICS,
    draw_lamps,
    draw_yard,
    write_topic,
)
from simulator.color.color_tables import CONFIGS
from simulator.config import load_shot, load_sweep
from simulator.errors import PhotositeError
from simulator.raw.image_files import write_picture

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "gallery.md").read_text(encoding="utf-8")
SECTIONS = {
    match[1]: text for text in re.split(r"^## ", PAGE, flags=re.M)[1:] if (match := re.match(r".*`(\w+)\.yaml`\n", text))
}


def points_of(name, folder):
    """Return the shots of a topic, with small files in place of its scene."""
    path = CONFIGS / "shots" / f"{name}.yaml"
    for file in re.findall(r"\w+\.exr", path.read_text()):
        write_picture(folder / file, np.full((4, 6, 5), 1.0, np.float32), ("R", "G", "B", "A", "Z"))
    copy = folder / path.name
    copy.write_text(path.read_text())
    sweep = load_sweep(copy)
    return [load_shot(copy)] if sweep is None else [point.shot() for point in sweep]


@pytest.mark.parametrize("name", TOPICS)
def test_a_topic_has_a_shot_that_loads_and_a_section_with_picture_commands_and_what_to_try(name, tmp_path):
    assert points_of(name, tmp_path)
    section = SECTIONS[name]
    assert f"(images/gallery/{name}.jpg)" in section and (ROOT / "docs" / "images" / "gallery" / f"{name}.jpg").is_file()
    assert f"python -m data_gen gallery {name} gallery\nphotosite simulate gallery/{name}.yaml --out gallery\n" in section
    assert re.search(r"^Try `", section, re.M)


def test_the_page_has_no_section_beside_those_of_topics_and_its_pictures_are_small():
    assert set(SECTIONS) == set(TOPICS)
    files = [ROOT / "docs" / "images" / "gallery" / f"{name}.jpg" for name in TOPICS]
    assert sum(file.stat().st_size for file in files) < 2e6


@pytest.mark.parametrize("name", TOPICS)
def test_what_a_section_advises_to_try_loads(name, tmp_path):
    points_of(name, tmp_path)
    advice = SECTIONS[name].partition("\nTry ")[2]
    words = [shlex.split(span.replace("\n", " ")) for span in re.findall("`([^`]+)`", advice)]
    settings = [after for span in words for word, after in pairwise(span) if word == "--set"]
    assert settings or "photosite" in advice
    sweep = load_sweep(tmp_path / f"{name}.yaml", settings)
    assert (load_shot(tmp_path / f"{name}.yaml", settings) if sweep is None else sweep[0].shot()).name.startswith(name)


def exposure_of(shot):
    """Electrons of a surface in focus, but for a factor: area of a photosite, time and solid angle of the pupil."""
    pitch_um = shot.camera.pixel_pitch_um
    lens = shot.lens
    magnification = lens.focal_length_mm / (1e3 * lens.focus_distance_m - lens.focal_length_mm)
    return pitch_um**2 * shot.exposure.time_s / (lens.f_number * (1.0 + magnification)) ** 2


def test_equal_exposures_have_equal_electrons(tmp_path):
    electrons = [exposure_of(shot) for shot in points_of("equal_exposure", tmp_path)]
    assert electrons == pytest.approx([electrons[0]] * 3, rel=1e-6)


def test_the_series_are_stops(tmp_path):
    for name, factor in (("aperture_series", 0.5), ("shutter_series", 2.0), ("iso_series", 0.25)):
        electrons = np.array([exposure_of(shot) for shot in points_of(name, tmp_path)])
        assert electrons[1:] / electrons[:-1] == pytest.approx([factor] * 3, rel=1e-6)
    assert all(
        shot.exposure.iso * shot.exposure.time_s == pytest.approx(100 / 12) for shot in points_of("iso_series", tmp_path)
    )


def test_the_small_sensor_has_the_same_field_pupil_and_light(tmp_path):
    large, small, same_number = points_of("small_sensor", tmp_path)

    def field(shot):
        f_mm, z_mm = shot.lens.focal_length_mm, 1e3 * shot.lens.focus_distance_m
        return shot.camera.width_px * shot.camera.pixel_pitch_um * 1e-3 / (f_mm * z_mm / (z_mm - f_mm))

    def pupil(shot):
        return shot.lens.focal_length_mm / shot.lens.f_number

    assert field(small) == pytest.approx(field(large), rel=2e-5) and field(same_number) == pytest.approx(field(large), rel=2e-5)
    assert pupil(small) == pytest.approx(pupil(large), rel=2e-5)
    assert exposure_of(small) == pytest.approx(exposure_of(large), rel=2e-5)
    assert exposure_of(same_number) == pytest.approx(0.25 * exposure_of(large), rel=0.02)


def test_the_subject_of_the_dolly_zoom_is_equally_large_within_a_photosite(tmp_path):
    for shot, focal_mm in zip(points_of("dolly_zoom", tmp_path), (24.0, 50.0, 135.0), strict=True):
        assert shot.lens.focal_length_mm == focal_mm
        assert 1e3 * shot.lens.focus_distance_m == pytest.approx(64.0 * focal_mm)
        assert shot.camera.width_px * shot.camera.pixel_pitch_um * 1e-3 == pytest.approx(SENSOR_WIDTH_MM, rel=1e-3)
    pytest.importorskip("skimage", reason="scikit-image, whose pictures the yard shows, is not installed")
    widths = []
    for focal_mm in (24.0, 135.0):
        coverage = draw_yard(focal_mm, width_px=300)["subject"][100, :, 3]
        widths.append(coverage.sum())
    board_mm = 1e3 * (BOARDS["subject"].width_m + 2 * 0.03) / 63.0
    assert widths == pytest.approx([board_mm / SENSOR_WIDTH_MM * 300] * 2, abs=0.6)


def test_lamps_are_where_the_shot_says(tmp_path):
    layers = draw_lamps()
    depths = [float(layer[..., 4].min()) for layer in layers.values()]
    shot = points_of("circle_of_confusion", tmp_path)[0]
    assert [layer.depth_m for layer in shot.scene.layers] == depths == [*LAMP_DISTANCES_M, 20.0]


def test_a_topic_is_written_with_its_shot(tmp_path):
    path = write_topic("circle_of_confusion", tmp_path / "new")
    assert load_shot(path).name == "circle_of_confusion" and len(list(path.parent.glob("lamps_*.exr"))) == 8


def test_an_unknown_topic_is_named_with_those_there_are(tmp_path):
    with pytest.raises(PhotositeError, match="give one of bare_sensor_pinhole_lens, dolly_zoom"):
        write_topic("selfie", tmp_path)


def test_gallery_scenes_name_what_is_missing(tmp_path):
    blocked = tmp_path / "file"
    blocked.write_text("")
    with pytest.raises(PhotositeError, match="cannot be written"):
        gallery_scenes.write_topic("circle_of_confusion", blocked)
