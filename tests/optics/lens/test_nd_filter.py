"""Grey filters take exactly their share of the light, whatever is engraved on them and whatever lens they are on."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.nd_filter import NeutralDensity
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate


@pytest.mark.parametrize(
    ("made", "share"),
    [
        (NeutralDensity(density=0.3), 0.5011872336272722),  # not half
        (NeutralDensity(density=0.9), 10**-0.9),
        (NeutralDensity(stops=3), 1 / 8),
        (NeutralDensity(factor=1000), 1e-3),
        (NeutralDensity(density=0.0), 1.0),
    ],
)
def test_a_filter_passes_ten_to_the_minus_density(made, share):
    assert made.transmittance == pytest.approx(share, rel=1e-15)
    for lens in (ThinLens(50.0, 4.0, t_stop=4.5), Pinhole(0.3, 50.0), BareSensor()):
        filtered = replace(lens, nd_filter=made)
        assert filtered.irradiance_per_radiance_sr() == pytest.approx(share * lens.irradiance_per_radiance_sr(), rel=1e-14)


def test_the_frame_behind_a_filter_has_its_share_of_the_electrons():
    lens = ThinLens(50.0, 4.0, t_stop=4.5)
    shot = Shot(band_scene(np.ones((4, 4))), lens, Exposure(1e-3), small_camera(32, 24))
    behind = replace(shot, lens=replace(lens, nd_filter=NeutralDensity(stops=10)))
    ratio = simulate(behind).mean_electrons / simulate(shot).mean_electrons
    assert ratio == pytest.approx(2.0**-10, rel=1e-6)
    assert behind.lens.t_number == pytest.approx(4.5)  # the T-stop is that of the lens


def test_a_t_stop_gives_the_light_of_a_lossless_lens():
    """Truth: E goes as 1 / T^2 in the aplanatic formula."""
    lossless = ThinLens(50.0, 4.5, irradiance="aplanatic")
    assert ThinLens(50.0, 4.0, irradiance="aplanatic", t_stop=4.5).irradiance_per_radiance_sr() == pytest.approx(
        lossless.irradiance_per_radiance_sr(), rel=1e-14
    )


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({}, "lens.nd_filter = {}: give one of density, stops and factor"),
        ({"density": 0.3, "stops": 1}, "lens.nd_filter = density, stops"),
        ({"density": -0.1}, "lens.nd_filter.density = -0.1"),
        ({"stops": math.nan}, "lens.nd_filter.stops = nan"),
        ({"factor": 0.5}, "lens.nd_filter.factor = 0.5"),
    ],
)
def test_a_filter_that_adds_light_or_says_nothing_is_refused(settings, message):
    with pytest.raises(PhotositeError, match=message):
        NeutralDensity(**settings)
