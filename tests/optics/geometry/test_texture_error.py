"""Instants over random pixels: errors of very many places in float64, and counts whose distances do not fit those of pixels."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.line_times import open_at_once
from simulator.optics.geometry.end_spacing import EndSpacing
from simulator.optics.geometry.image_motion import ImageGeometry, ImageMotion, Surface
from simulator.optics.geometry.instants import TimedPath
from simulator.optics.geometry.texture_error import OF_PHOTOSITES, texture_deviation, textured_instants

PIXELS = np.random.default_rng(3).uniform(0.0, 1.0, (240, 240))
DEVIATION = float(PIXELS.std())


def straight(right_px: float, down_px: float, spacing: EndSpacing | None = None) -> TimedPath:
    """A straight path over so many photosites in a second."""
    motion = SteadyMotion(right_m_per_s=1e-3 * right_px, up_m_per_s=-1e-3 * down_px)
    surface = ImageMotion(ImageGeometry(1000.0, 64, 48), (Surface(1.0, 1.0),), motion)
    return TimedPath(surface, open_at_once(1.0), 0.0).spaced(spacing)


def errors(path: TimedPath, way_px: tuple[float, float], count: int) -> np.ndarray:
    """Errors of the mean along a way from the places of pixels and between them, of many photosites: the worst phase."""
    y, x = np.mgrid[20:220:4, 20:220:4].astype(float)
    borders, worst = path.borders(count), np.zeros(1)
    for phase in np.arange(8) / 16.0:
        found = np.zeros(x.shape)
        for edges, sign in ((borders, 1.0), (np.linspace(0.0, 1.0, 8 * count + 1), -1.0)):
            for middle, share in zip(0.5 * (edges[1:] + edges[:-1]), np.diff(edges), strict=True):
                place = y + phase + way_px[1] * middle, x + phase + way_px[0] * middle
                found += sign * share * map_coordinates(PIXELS, place, order=1)
        worst = max(worst, found, key=lambda one: float(np.abs(one).std()))
    return worst.ravel()


@pytest.mark.parametrize(
    ("way_px", "count", "least"),
    [((6.0, 6.0), 24, 0.95), ((6.0, 6.0), 26, 0.65), ((8.5, 0.0), 17, 0.65), ((5.0, 3.0), 17, 0.65)],
)
def test_the_deviation_is_that_of_random_pixels(way_px, count, least):
    """That of the worst phase, which is one of those looked at where bends are met alike."""
    path = straight(*way_px)
    found, told = errors(path, way_px, count), DEVIATION * texture_deviation(path, count)
    assert least < found.std() / told < 1.03
    assert np.quantile(np.abs(found), 0.999) < OF_PHOTOSITES * told


def test_distances_that_fit_those_of_pixels_are_avoided():
    """On a diagonal of six pixels 24 instants and 30 meet all bends at one phase, twice as wrong as those between."""
    path = straight(6.0, 6.0)
    deviations = {count: texture_deviation(path, count) * count**2 for count in range(24, 31)}
    assert min(deviations[24], deviations[30]) > 1.8 * min(deviations.values())
    allowed = 1.01 * OF_PHOTOSITES / np.sqrt(2.0) * texture_deviation(path, 26)
    count, error = textured_instants(path, 24, 1.0, allowed)
    assert count in (25, 26) and error <= allowed
    assert textured_instants(path, 26, 1.0, allowed) == (26, pytest.approx(allowed / 1.01))


def test_instants_denser_at_the_ends_fit_pixels_in_the_middle():
    """Where a search found 0.129 sigma of 0.1: 73 instants, which lie like 72 even ones in the middle of the path."""
    dense = straight(6.0, 6.0, EndSpacing(72.0**0.5, 1.11))
    assert texture_deviation(dense, 73) > 1.3 * texture_deviation(dense, 75)
