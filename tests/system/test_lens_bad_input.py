"""What no lens can draw ends in one message that names the key, the value and a fix; what one can is drawn."""

import os

import numpy as np
import pytest
from helpers.bad_input import SHOT
from helpers.deep_files import deep_file
from helpers.picture_files import write_exr

import simulator
from simulator.command_line.main import main
from simulator.errors import PhotositeError
from simulator.optics.defocus.defocus import LARGEST_PX
from simulator.pipeline.planner import plan
from simulator.pipeline.simulate import simulate

LAYERS = """\
  layers:
    - {image: half.exr, depth: 1 m}
    - {image: good.exr, depth: 2 m}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A good shot, one of two layers and a deep one, beside files that are bad in every way."""
    here, rng = tmp_path_factory.mktemp("bad lens input"), np.random.default_rng(0)
    good, half = rng.random((40, 60, 3)), np.ones((40, 60, 1))
    half[:, :30] = 0.0
    write_exr(here / "good.exr", good)
    for name, alpha in {
        "half": half,
        "empty": 0 * half,
        "above": 1.5 * half,
        "nan_alpha": np.where(half == 0, np.nan, 1),
    }.items():
        write_exr(here / f"{name}.exr", np.dstack([good * (alpha > 0), alpha]))
    write_exr(here / "small.exr", good[:20])
    for name, value in {"zero": 0.0, "negative": -2.0, "nan": np.nan, "tiny": 1e-6, "denormal": 1e-40}.items():
        depth = np.full((40, 60, 1), 2.0)
        depth[5, 7] = value
        write_exr(here / f"{name}.exr", depth)
    write_exr(here / "far.exr", np.full((40, 60, 1), 2e6))
    write_exr(here / "near.exr", np.full((40, 60, 1), 2e-4))
    light = good.copy()
    light[20, 30] = 9000.0
    write_exr(here / "light.exr", light)
    whole = deep_file(here / "deep.exr", 4, [[(0.5, 0.5, 0.5, 1.0, 2.0)] for _ in range(12)]).read_bytes()
    (here / "cut.exr").write_bytes(whole[: len(whole) * 2 // 3])
    (here / "rotten.exr").write_bytes(whole[:-30] + b"\xff" * 30)
    picture = "  image: good.exr\n  depth: 2 m\n"
    for name, scene in {"shot": picture, "layers": LAYERS, "deep": "  deep: deep.exr\n"}.items():
        (here / f"{name}.yaml").write_text(SHOT.replace(picture, scene))
    return here


CASES = {  # file, settings, and what the message must hold
    "focus inside the focal length": ("shot", ["lens.focus_distance=4 cm"], ["focus_distance = 0.04 m", "than 0.05 m"]),
    "focus at the focal length": ("shot", ["lens.focus_distance=50 mm"], ["lens.focus_distance", "more than 0.05 m"]),
    "focus a hair beyond it": ("shot", ["lens.focus_distance=50.0000001 mm"], ["lens.f_number = f/4", "3.627e+11 photosites"]),
    "negative focus": ("shot", ["lens.focus_distance=-2 m"], ["lens.focus_distance = -2 m"]),
    "NaN focus": ("shot", ["lens.focus_distance=.nan"], ["lens.focus_distance = nan"]),
    "negative focal length": ("shot", ["lens.focal_length=-50 mm"], ["lens.focal_length = -50.0 mm"]),
    "endless focal length": ("shot", ["lens.focal_length=1e9 mm", "lens.focus_distance=inf"], ["lens.f_number", "photosites"]),
    "f-number 0": ("shot", ["lens.f_number=0"], ["lens.f_number = f/0", "f/0.5"]),
    "NaN f-number": ("shot", ["lens.f_number=.nan"], ["lens.f_number = nan"]),
    "NaN transmittance": ("shot", ["lens.transmittance=.nan"], ["lens.transmittance = nan", "finite"]),
    "NaN glare": ("shot", ["lens.veiling_glare=.nan"], ["lens.veiling_glare = nan"]),
    "all light is glare": ("shot", ["lens.veiling_glare=1"], ["lens.veiling_glare = 1.0", "such as 0.02"]),
    "NaN distortion": ("shot", ["lens.distortion={k1: .nan}"], ["lens.distortion.k1 = nan"]),
    "distortion folds": ("shot", ["lens.distortion={k1: -0.9, unit: half_diagonal}"], ["lens.distortion", "folds"]),
    "rim closes the pupil": ("shot", ["lens.vignetting={front: {distance: 30 mm, diameter: 4 mm}}"], ["= 4 mm", "12.31 mm"]),
    "hole wider than its distance": ("shot", ["lens={pinhole: {diameter: 60 mm, distance: 50 mm}}"], ["diameter = 60"]),
    "hole that blurs everything": ("shot", ["lens={pinhole: {diameter: 49 mm, distance: 50 mm}}"], ["16.7 mm"]),
    "depth 0": ("shot", ["scene.depth=0 m"], ["scene.depth = 0.0 m"]),
    "negative depth": ("shot", ["scene.depth=-1 m"], ["scene.depth = -1.0 m"]),
    "NaN depth": ("shot", ["scene.depth=.nan"], ["scene.depth = nan"]),
    "depth inside the lens": ("shot", ["scene.depth=1e-30 m"], ["lens.f_number = f/4", "at 1e-30 m", "correct its depth"]),
    "spot larger than the frame": ("shot", ["scene.depth=2 cm", "lens.f_number=f/0.5", "lens.focus_distance=1 m"],
                                   ["lens.f_number = f/0.5", "at 0.02 m", "1.535e+04 photosites", "f/7.53 or more"]),
    "near layer larger than the frame": ("layers", ["scene.layers.0.depth=2 cm", "lens.f_number=f/0.5"], ["at 0.02 m"]),
    "a zero in the map": ("shot", ["scene.depth={image: zero.exr}"], ["zero.exr", "1 of 2400 pixels", "x = 7, y = 5"]),
    "a negative number in the map": ("shot", ["scene.depth={image: negative.exr}"], ["negative.exr", "1 of 2400 pixels"]),
    "a NaN in the map": ("shot", ["scene.depth={image: nan.exr}"], ["nan.exr", "1 of 2400 pixels"]),
    "a micrometre in the map": ("shot", ["scene.depth={image: tiny.exr}"], ["lens.f_number", "at 1e-06 m"]),
    "a denormal number in the map": ("shot", ["scene.depth={image: denormal.exr}"], ["lens.f_number", "at 1e-40 m"]),
    "a map of another size": ("shot", ["scene.depth={image: small.exr, channel: R}"], ["scene.depth.image", "60x20", "60x40"]),
    "alpha above 1": ("layers", ["scene.layers.0.image=above.exr"], ["scene.layers.0.image", "alpha is 1.5", "0 to 1"]),
    "NaN alpha": ("layers", ["scene.layers.0.image=nan_alpha.exr"], ["scene.layers.0.image", "NaN"]),
    "layers of two sizes": ("layers", ["scene.layers.1.image=small.exr"], ["scene.layers.1.image", "60x20", "60x40"]),
    "no layers": ("layers", ["scene.layers=[]"], ["scene.layers = []", "one layer or more"]),
    "layers in the wrong order": ("layers", ["scene.layers.0.depth=5 m"], ["scene.layers.1.depth", "front to back"]),
    "deep file cut short": ("deep", ["scene.deep=cut.exr"], ["scene.deep", "cut.exr", "cut short"]),
    "deep file damaged": ("deep", ["scene.deep=rotten.exr"], ["scene.deep", "rotten.exr", "damaged"]),
}  # fmt: skip


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("command", ["simulate", "explain"])
def test_a_lens_or_scene_that_cannot_be_is_one_message(folder, capsys, monkeypatch, case, command):
    file, settings, expected = CASES[case]
    monkeypatch.chdir(folder)
    arguments = [part for setting in settings for part in ("--set", setting)] + ["--out", "frames"] * (command == "simulate")
    with pytest.raises(SystemExit) as ended:
        main([command, f"{file}.yaml", *arguments])
    message = capsys.readouterr().err
    assert ended.value.code == 1 and message.count("error:") == 1 and "Traceback" not in message
    for words in expected:
        assert words in message, message
    assert not (folder / "frames").exists()


def test_the_f_number_that_is_advised_is_enough(folder):
    settings = {"scene.depth": "2 cm", "lens.focus_distance": "1 m"}
    with pytest.raises(PhotositeError, match="give f/7.53 or more"):
        plan(simulator.load_shot(folder / "shot.yaml", settings | {"lens.f_number": "f/7.4"}))
    advised = plan(simulator.load_shot(folder / "shot.yaml", settings | {"lens.f_number": "f/7.53"}))
    assert 0.99 * LARGEST_PX < advised.optics.defocus.largest_px <= LARGEST_PX


def frame(folder, file, **settings):
    return simulate(simulator.load_shot(folder / file, settings))


@pytest.mark.parametrize("layers", [[{"image": "empty.exr", "depth": "1 m"}], [{"image": "empty.exr", "depth": "1 m"}] * 2])
def test_layers_that_show_nothing_give_a_dark_frame(folder, monkeypatch, layers):
    monkeypatch.chdir(folder)
    assert not frame(folder, "layers.yaml", **{"scene.layers": layers}).mean_electrons.any()


def test_a_layer_that_shows_nothing_changes_nothing(folder, monkeypatch):
    monkeypatch.chdir(folder)
    settings = {"lens.f_number": "f/2", "lens.focus_distance": "3 m", "scene.layers.1.depth": "5 m"}
    empty = frame(folder, "layers.yaml", **settings, **{"scene.layers.0.image": "empty.exr"}).mean_electrons
    alone = frame(folder, "shot.yaml", **{**dict(list(settings.items())[:2]), "scene.depth": "5 m"}).mean_electrons
    np.testing.assert_allclose(empty, alone, rtol=2e-6)


def test_a_light_of_a_million_electrons_disturbs_nothing_beyond_its_spot(folder, monkeypatch):
    """Its column's running sums are float32: below the light they leave less than 0.01 sigma of some 500 e-."""
    monkeypatch.chdir(folder)
    settings = {"camera": {"base": "sony_a7s2", "width": 64, "height": 48}, "scene.depth": "4 m", "lens.f_number": "f/16"}
    dark, lit = (frame(folder, "shot.yaml", **settings, **{"scene.image": image}) for image in ("good.exr", "light.exr"))
    dark, lit = dark.mean_electrons.astype(float), lit.mean_electrons.astype(float)
    y, x = np.mgrid[:48, :64] + 0.5
    away = np.hypot(x - 32.5, y - 24.5) > 8.0  # radius 2.4 photosites, and the pixel's own size
    assert 0.5e6 < lit.max() < 2e6
    assert np.all(np.abs(lit - dark)[away] < 0.01 * np.sqrt(dark[away] + 4.0))


@pytest.mark.slow
def test_a_near_thing_blurred_over_the_whole_window_has_the_bits_of_a_larger_one(folder, monkeypatch):
    """300 photosites of radius: what reaches a tile comes from far outside the window."""
    monkeypatch.chdir(folder)
    window = {"x": 1000, "y": 900, "width": 96, "height": 64}
    settings = {"lens.f_number": "f/2", "scene.layers.0.depth": "30 cm"}
    larger = window | {"x": 904, "y": 836, "width": 288, "height": 192}
    part, whole = (
        frame(folder, "layers.yaml", **settings, camera={"base": "sony_a7s2", "window": read}).mean_electrons
        for read in (window, larger)
    )
    assert np.array_equal(part, whole[64:128, 96:192])


@pytest.mark.parametrize("f_number", ["f/1e30", "f/5e9"])
def test_an_f_number_that_exif_cannot_hold_is_left_out_of_it(folder, tmp_path, f_number):
    with pytest.raises(SystemExit) as ended:
        main(["simulate", str(folder / "shot.yaml"), "--set", f"lens.f_number={f_number}", "--out", str(tmp_path)])
    assert ended.value.code == 0 and os.path.getsize(tmp_path / "shot.dng") > 0


@pytest.mark.parametrize(("image", "told"), [("far.exr", "from 2e+06 m"), ("near.exr", "to 0.0002 m")])
def test_a_map_in_another_unit_is_noted(folder, monkeypatch, image, told):
    monkeypatch.chdir(folder)
    shot = simulator.load_shot("shot.yaml", {"scene.depth": {"image": image}})
    assert any(told in note and "check its unit, which is m" in note for note in shot.scene.load().notes)
    shot = simulator.load_shot("shot.yaml", {"scene.depth": {"image": "tiny.exr"}})
    assert not any("unit" in note for note in shot.scene.load().notes)
