"""Pictures of frames for the page, and histograms of electrons."""

import numpy as np
from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene

from simulator.explore.pictures import BINS, LARGEST_WIDTH_PX, histogram, paint
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.sensor.camera.camera import IsoSetting

LENS = ThinLens(50.0, 8.0, cos4=False)


def frame(height=64, width=96, cfa="RGGB", **settings):
    picture = np.random.default_rng(1).uniform(0.1, 1.0, (height, width, 3))
    camera = small_camera(width, height, cfa=cfa, black_level_dn=100.0, **settings)
    return simulate(Shot(band_scene(picture, np.inf), LENS, Exposure(0.005), camera))


def test_a_picture_is_opaque_and_at_most_as_wide_as_the_page_shows():
    small = paint(frame())
    assert small.shape == (64, 96, 4) and (small[..., 3] == 255).all() and small[..., :3].std() > 2
    wide = paint(frame(24, 2 * LARGEST_WIDTH_PX + 8))
    assert wide.shape[1] <= LARGEST_WIDTH_PX and wide.shape[0] >= 2


def test_a_histogram_counts_every_photosite_once_at_its_electrons():
    raw = frame(iso_table={100: IsoSetting(0.5, 0.0, color_bias_dn=(0.0, 8.0, 8.0, 16.0))})
    found = histogram(raw, 0.5, 40000.0)
    assert {name: int(counts.sum()) for name, counts in found.counts.items()} == {"R": 1536, "G": 3072, "B": 1536}
    middle = 0.5 * (found.edges_e[1:] + found.edges_e[:-1])
    width = found.edges_e[1] - found.edges_e[0]
    for name, part in (("R", np.s_[0::2, 0::2]), ("B", np.s_[1::2, 1::2])):
        counts = found.counts[name]
        assert len(counts) == BINS
        mean = (counts * middle).sum() / counts.sum()
        assert abs(mean - raw.mean_electrons[part].mean(dtype=float)) < 0.5 * width
