"""Pixels of light behind a filter and photosites, along one axis: against sums over their parts."""

import math

import numpy as np
import pytest

from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.square_light import line_weights, shared_length

PARTS, PITCH_UM = 20000, 5.0
AWAY_PX = np.linspace(-3.1, 3.1, 23)


@pytest.mark.parametrize("is_tent", [False, True])
@pytest.mark.parametrize(("fill_factor", "low_pass_um", "width_px"), [(1.0, 0.0, 1.0), (0.5, 3.0, 0.4), (0.81, 4.0, 1.6)])
def test_photosites_share_a_pixel_by_length(fill_factor, low_pass_um, width_px, is_tent):
    x = (np.arange(PARTS) + 0.5) / PARTS * 8.0 - 4.0
    light = np.maximum(1.0 - np.abs(x / width_px), 0.0) if is_tent else (np.abs(x) < 0.5 * width_px).astype(float)
    expected = np.zeros(len(AWAY_PX))
    for spot in (-0.5, 0.5):
        middle = AWAY_PX + spot * low_pass_um / PITCH_UM
        open_ = np.abs(x - middle[:, None]) < 0.5 * math.sqrt(fill_factor)
        expected += 0.5 * (open_ * light).sum(axis=1) * 8.0 / PARTS / math.sqrt(fill_factor)
    found = shared_length(Sampling(fill_factor, low_pass_um), PITCH_UM, AWAY_PX, width_px, is_tent=is_tent)
    assert found == pytest.approx(expected, abs=2e-3)


def test_a_smooth_spot_spreads_the_pixel_that_photosites_share():
    """Cells of a Gaussian of 0.6 photosites, which pass no more than 0.001 beyond the cells' own frequencies."""
    per_photosite, count, sampling = 5, 35, Sampling(0.64, 3.0)
    edges = (np.arange(count + 1) - 0.5 * count) / per_photosite
    cells = np.diff([0.5 * math.erf(edge / (0.6 * math.sqrt(2.0))) for edge in edges])
    fine = np.linspace(-3.5, 3.5, 7001)
    spread = np.exp(-0.5 * (fine / 0.6) ** 2)
    spread /= spread.sum()
    expected = [spread @ shared_length(sampling, PITCH_UM, away - fine, 0.8, is_tent=False) for away in AWAY_PX]
    found = line_weights(sampling, PITCH_UM, AWAY_PX, 0.8, (count, per_photosite)) @ cells
    assert found == pytest.approx(np.array(expected), abs=1e-5)
