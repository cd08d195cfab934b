"""Which spots follow the motion from row to row, by what skew, and what error is left."""

from dataclasses import replace

import numpy as np
import pytest

from simulator.optics.geometry.fixed_blur import MOST_SKEW, FixedBlur, Skew

BLUR = FixedBlur(1, 0.8, 2.0, own_spread_px=0.1, can_skew=True)
EVEN = Skew(0.03, -0.04, 0.0, 0.05)


@pytest.mark.parametrize(
    ("blur", "skew"),
    [
        (replace(BLUR, can_skew=False), EVEN),
        (replace(BLUR, slope=0.01), EVEN),
        (BLUR, replace(EVEN, of_rows=False)),
        (BLUR, Skew(MOST_SKEW, 0.1, 0.0, 0.6)),
        (BLUR, Skew(0.0, 0.0, 0.05, 0.05)),
        (BLUR, Skew()),
    ],
    ids=["cannot", "tilted", "columns", "too far", "to and fro", "at rest"],
)
def test_spots_stay_upright_where_a_skew_is_not_possible_or_no_better(blur, skew):
    assert blur.following(skew) == blur and blur.spot_skew == (0.0, 0.0)


def test_the_law_holds_for_what_spots_do_not_follow():
    followed = BLUR.following(EVEN)
    assert BLUR.skew_error(EVEN, 10.0) == pytest.approx(0.8 * 0.05 * 0.25 * 2.0 / 10.0)
    assert followed.skew_error(EVEN, 10.0) == pytest.approx(0.8 * 0.05 * 0.25 * 0.1 / 10.0)
    uneven = replace(EVEN, apart_px=0.02)
    more = BLUR.following(uneven).skew_error(uneven, 10.0) - followed.skew_error(EVEN, 10.0)
    assert more == pytest.approx(0.8 * 0.02 * 0.25 * 2.0 / 10.0)
    assert followed.error(EVEN, 0.0) == pytest.approx(0.8 * 0.05 * 0.25)  # no path: the spot's lever alone


def test_a_skewed_place_sees_what_its_own_row_would_see():
    """Light that row y sees at x, at the row's own time, is what row 0 sees at x + k y: the skewed place is there."""
    across, down = BLUR.following(EVEN).spot_skew
    x, y = np.array([0.0, 3.0, -2.0]), np.array([2.0, -1.5, 0.0])
    skewed = np.stack([x + across * y, y + down * y])
    assert np.allclose(skewed + np.array([[EVEN.x_px], [EVEN.y_px]]) * skewed[1], [x, y])
