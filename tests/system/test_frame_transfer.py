"""What a lens does to a frame, measured back: transfer by slanted edge from the DNG, colour by distance, the sharpest hole."""

import math

import numpy as np
import pytest
from helpers.camera_builders import green_camera, small_camera
from helpers.green_frames import PITCH_UM, lens, point_frame
from helpers.scene_builders import band_scene, scene_edge
from helpers.wave_optics import half_light_radius, pupil_transfer

from simulator.exposure.settings import Exposure
from simulator.measurement.statistics.slanted_edge import edge_of_raw_file
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations, ChromaticShift
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.save import save
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

FREQUENCY = np.linspace(0.02, 0.5, 25)
ANGLE = math.radians(5.7)


def edge_measured(folder, through, camera, seed=1):
    """Edge of a DNG exposed to 50,000 e- on the bright side."""
    scene = band_scene(scene_edge(5.7), math.inf, interpolation="nearest")
    light = simulate(Shot(scene, through, Exposure(0.01), camera)).mean_electrons.max()
    shot = Shot(scene, through, Exposure(0.01 * 50000.0 / float(light)), camera, Seeds(frame=seed))
    return edge_of_raw_file(save(simulate(shot), folder).dng, "MONO")


def expected_transfer(f_number, side=1.0, apart=0.0) -> np.ndarray:
    """Pupil, photosite and filter along the normal of the edge; frequencies per photosite."""
    across, down = FREQUENCY * math.cos(ANGLE), FREQUENCY * math.sin(ANGLE)
    pupil = np.array([pupil_transfer(q / PITCH_UM, f_number) for q in FREQUENCY])
    squares = [np.sinc(side * q) * np.cos(math.pi * apart * q) for q in (across, down)]
    return pupil * squares[0] * squares[1]


CASES = {
    "f/4": (4.0, {}),
    "f/11": (11.0, {}),
    "f/5.6, half the area sensitive": (5.6, {"fill_factor": 0.5}),
    "f/5.6, low-pass filter of 3 um": (5.6, {"low_pass_um": 3.0}),
}


@pytest.mark.parametrize("case", [pytest.param(case, marks=[] if case == "f/4" else [pytest.mark.slow]) for case in CASES])
def test_a_dng_without_noise_has_the_transfer_of_lens_and_photosite(tmp_path, case):
    f_number, settings = CASES[case]
    found = edge_measured(tmp_path, lens(f_number, diffraction=True), green_camera(96, 128, **settings))
    side, apart = math.sqrt(settings.get("fill_factor", 1.0)), settings.get("low_pass_um", 0.0) / PITCH_UM
    assert np.max(np.abs(found.at(FREQUENCY) - expected_transfer(f_number, side, apart))) < 0.015


@pytest.mark.slow
def test_noisy_dngs_have_it_on_average(tmp_path):
    """Five frames with shot noise and read noise: the mean lies within its standard errors and what the method is off by."""
    noise = {"stages": {"photon_shot_noise": PhotonShotNoise()}, "iso_table": {100: IsoSetting(1.0, 3.0)}}
    camera, through = green_camera(96, 128, **noise), lens(11.0, diffraction=True)
    found = np.array([edge_measured(tmp_path, through, camera, seed).at(FREQUENCY) for seed in range(5)])
    error = np.abs(found.mean(axis=0) - expected_transfer(11.0))
    spread = found.std(axis=0, ddof=1) / math.sqrt(len(found))
    assert spread.min() > 0.0 and np.all(error < 4.0 * spread + 0.015)


def contrasts(radius_um: float) -> np.ndarray:
    """Contrast of a fine texture in red, green and blue at a distance of this signed blur radius, f/4."""
    colour = (ChromaticShift(450.0, 60.0), ChromaticShift(550.0), ChromaticShift(650.0, -60.0))
    through = ThinLens(50.0, 4.0, 2.0, cos4=False, aberrations=Aberrations(chromatic=colour))
    per_dioptre = float(through.blur_radius_um(math.inf) - through.blur_radius_um(1.0))
    texture = np.random.default_rng(4).random((90, 90, 1)).repeat(3, axis=2)
    scene = band_scene(texture, 1.0 / (0.5 - radius_um / per_dioptre), interpolation="nearest")
    found = simulate(Shot(scene, through, Exposure(0.01), small_camera(90, 90, "RGGB"))).mean_electrons
    planes = found[0::2, 0::2], found[0::2, 1::2], found[1::2, 1::2]
    return np.array([plane.std() / plane.mean() for plane in planes])


def test_the_sharpest_colour_depends_on_the_distance():
    """Blue comes to focus 60 um behind the sensor, so of things farther away; red of nearer ones: radius 60 um / 2 N."""
    near, focus, far = (contrasts(radius_um) for radius_um in (-7.3, 0.0, 7.3))
    assert [int(np.argmax(found)) for found in (near, focus, far)] == [0, 1, 2]
    assert near[0] > 1.5 * near[2] and far[2] > 1.5 * far[0]


def half_light_px(frame: np.ndarray) -> float:
    """Radius around the middle of the frame's light with half of it [photosites]."""
    y, x = np.indices(frame.shape)
    middle = [float((frame * axis).sum() / frame.sum()) for axis in (y, x)]
    radius = np.hypot(y - middle[0], x - middle[1]).ravel()
    order = np.argsort(radius)
    inside = np.cumsum(frame.ravel()[order])
    return float(np.interp(0.5 * inside[-1], inside, radius[order]))


def test_the_sharpest_hole_draws_the_smallest_points():
    """Half of the light of a pictured far point, as the Fresnel integral has it, for holes around the sharpest."""
    distance_mm, scale_px = 10.0, 1e3 * math.sqrt(1e-6 * 550.0 * 10.0) / PITCH_UM
    sharpest = Pinhole(0.1, distance_mm).sharpest_diameter_mm()
    camera, found = green_camera(141, 141), {}
    for share in (0.6, 1.0, 1.5):
        hole = Pinhole(share * sharpest, distance_mm, cos4=False, diffraction=True)
        found[share] = half_light_px(point_frame(camera, hole)) / scale_px
        assert found[share] == pytest.approx(half_light_radius(1.4944 * share), rel=0.04)
    assert found[1.0] < 0.8 * found[0.6] and found[1.0] < 0.8 * found[1.5]


def test_a_hole_without_diffraction_is_sharper_the_smaller_it_is():
    camera = green_camera(91, 91)
    holes = [Pinhole(diameter, 10.0, cos4=False, diffraction=False) for diameter in (0.05, 0.1, 0.15)]
    sizes = [half_light_px(point_frame(camera, hole)) for hole in holes]
    assert sizes == sorted(sizes)
