"""What upright parts leave of photosites that lean, against fine parts of their parallelograms."""

import dataclasses

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS
from helpers.scene_builders import band_scene
from scipy.ndimage import map_coordinates
from scipy.signal import fftconvolve

from simulator.exposure.settings import Exposure
from simulator.optics.defocus.aperture_kernel import disk_weights
from simulator.optics.geometry.leaning_photosites import lean_error, upright_parts
from simulator.optics.lens.distortion import Distortion
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.error_budget import DISTORTION
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot


@pytest.mark.parametrize("radius_px", [0.5, 1.0, 3.5])
@pytest.mark.parametrize("scale", [1.0, 1.25, 2.0])
def test_circles_hide_that_photosites_lean_as_is_told(scale, radius_px):
    """Black and white pixels on 64 x 64 fine parts of each photosite, whose sides all lean alike.

    Even squares, two per photosite and axis, or linear between the middles of one.
    """
    fine, side, beside, points = 64, 32, 4, 24
    squares = (np.random.default_rng(1).random((int(scale * (side + 2 * beside)),) * 2) > 0.5).astype(float)
    lens = dataclasses.replace(LENS, distortion=Distortion(k1=-0.06, unit="half_diagonal"))
    shot = Shot(band_scene(squares, 2.0), lens, Exposure(1e-3), small_camera(side + 2 * beside, side + 2 * beside))
    projection, size = plan(shot).optics.projection, (side + 2 * beside,) * 2
    lean, parts = projection.warp.tilt(*size), upright_parts(projection)
    places = np.meshgrid(*2 * [(np.arange(fine * size[0]) + 0.5) * scale / fine - 0.5], indexing="ij")
    light = map_coordinates(squares, places, order=int(scale == 1.0), mode="nearest")
    light = fftconvolve(light, disk_weights(fine * radius_px), mode="same")
    y, x = (np.indices((points, points)).reshape(2, -1) + 0.5) / points
    first = beside + np.arange(side)

    def means(of_x, of_y):
        """Means over parallelograms whose sides lean by these numbers of where a point lies along the other axis."""
        found = np.zeros((side, side))
        for places in zip(y + lean * of_x, x + lean * of_y, strict=True):
            (above, past_y), (left, past_x) = (divmod(away * fine - 0.5, 1.0) for away in places)
            for below, share_y in ((0, 1.0 - past_y), (1, past_y)):
                for right, share_x in ((0, 1.0 - past_x), (1, past_x)):
                    rows, columns = (first * fine + int(away) for away in (above + below, left + right))
                    found += share_y * share_x * light[np.ix_(rows, columns)]
        return found / len(x)

    in_parts = [(np.floor(place * parts) + 0.5) / parts - 0.5 for place in (x, y)]
    left = np.quantile(np.abs(means(x - 0.5, y - 0.5) - means(*in_parts)), 0.999)
    told = lean_error(projection, *size, parts, radius_px, 1.0)
    print("LEFT", radius_px, left / told, lean)
    assert 0.3 * told < left <= told


def test_nothing_is_told_of_squares_that_nothing_blurs():
    """They are exact means; samples that lens or diffraction blur are upright, and light between pixels has parts."""

    def told(scale, depth_m, diffraction):
        pixels = np.random.default_rng(2).random((round(48 * scale), round(64 * scale)))
        distortion = Distortion(k1=-0.06, unit="half_diagonal")
        lens = ThinLens(50.0, 8.0, focus_distance_m=2.0, cos4=False, distortion=distortion, diffraction=diffraction)
        budget = plan(Shot(band_scene(pixels, depth_m), lens, Exposure(0.01), small_camera(64, 48))).error_budget
        return sum(term.sigma for term in budget.terms if term.effect == DISTORTION)

    assert told(2.0, 2.0, False) == 0.0
    assert min(told(2.0, 2.3, False), told(2.0, 2.0, True), told(1.0, 2.0, False)) > 1e-3
