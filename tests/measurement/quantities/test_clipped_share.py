"""Clipped shares are counts of codes, in all photosites or in those of one colour."""

import numpy as np

from simulator.measurement.quantities import QUANTITIES, ClippedShare, MeasuredFrame


def frame() -> MeasuredFrame:
    dn = np.full((10, 20), 500, np.uint16)
    dn[2:4, 3:7] = (4095, 4095, 4094, 0)
    dn[8, 0] = 5000  # above white counts as white
    return MeasuredFrame(dn, "RGGB", np.full((2, 2), 64.0), 4095)


def shares(**settings) -> tuple[float, float]:
    found = ClippedShare(**settings).measure(frame()).figures
    assert all(figure.unit == "" and figure.sigma == 0.0 for figure in found.values())
    return found["white"].value, found["black"].value


def test_shares_are_exact_counts():
    assert shares() == (5 / 200, 2 / 200)
    assert shares(area=(2, 3, 2, 4)) == (0.5, 0.25)
    assert shares(area=(0, 0, 2, 20)) == (0.0, 0.0)


def test_a_colour_is_counted_alone():
    assert shares(plane="R") == (2 / 50, 1 / 50)  # (2, 4), (2, 6) and (8, 0) are red


def test_the_table_has_the_word_of_each_quantity():
    assert QUANTITIES["clipped_share"] is ClippedShare
