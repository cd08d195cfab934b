"""Marks of dials belong to true stops, and their deviations are known."""

import math

import pytest

from simulator.exposure.stops import (
    F_MARKS,
    TIME_MARKS_S,
    equal_exposures,
    f_number_of,
    mark_of_f_number,
    mark_of_time,
    time_of,
    write_time,
)


def test_every_mark_lies_within_a_seventh_of_a_stop_of_its_true_stop():
    """The worst are f/1.2, which is 2^(1/3) = 1.26, and 1/6 s and 1/60 s."""
    f_stops = [abs(2 * math.log2(mark / mark_of_f_number(mark)[1])) for mark in F_MARKS]
    time_stops = [abs(math.log2(mark / mark_of_time(mark)[1])) for mark in TIME_MARKS_S]
    assert max(f_stops) == pytest.approx(2 * math.log2(2 ** (1 / 3) / 1.2)) and max(time_stops) < 0.1
    true = [mark_of_f_number(mark)[1] for mark in F_MARKS]
    assert all(after / before == pytest.approx(2 ** (1 / 6)) for before, after in zip(true[:-1], true[1:], strict=True))
    times = [mark_of_time(mark)[1] for mark in TIME_MARKS_S]
    assert all(after / before == pytest.approx(2 ** (1 / 3)) for before, after in zip(times[:-1], times[1:], strict=True))


@pytest.mark.parametrize(
    ("mark", "true"),
    [(0.5, 0.5), (1.4, 2**0.5), (2.8, 2**1.5), (5.6, 2**2.5), (11.0, 2**3.5), (22.0, 2**4.5), (32.0, 32.0), (64.0, 64.0)],
)
def test_whole_stops_of_f_numbers_are_powers_of_the_root_of_two(mark, true):
    assert mark_of_f_number(mark) == (mark, pytest.approx(true))
    assert mark_of_f_number(true)[0] == mark


@pytest.mark.parametrize(
    ("mark", "true"),
    [(1 / 8000, 2**-13), (1 / 500, 2**-9), (1 / 125, 1 / 128), (1 / 60, 1 / 64), (1 / 15, 1 / 16), (15.0, 16.0), (30.0, 32.0)],
)
def test_whole_stops_of_times_are_powers_of_two(mark, true):
    assert mark_of_time(mark) == (mark, pytest.approx(true))
    assert mark_of_time(true)[0] == mark


def test_beyond_the_dials_there_is_no_mark():
    assert mark_of_f_number(200.0) is None and mark_of_f_number(0.4) is None
    assert mark_of_time(3600.0) is None and mark_of_time(1e-6) is None


def test_equal_exposures_go_from_a_fast_lens_to_a_small_one_and_say_what_their_marks_are_worth():
    """f/1.4 at 1/500 s to f/32 at 1 s. Truth: the deviation of each mark, by hand."""
    pairs = equal_exposures(32.0, 1.0)
    assert [(f, round(1 / t)) for f, t, _ in pairs] == [
        (1.4, 500), (2.0, 250), (2.8, 125), (4.0, 60), (5.6, 30), (8.0, 15), (11.0, 8), (16.0, 4), (22.0, 2), (32.0, 1)
    ]  # fmt: skip
    assert pairs[0][2] == pytest.approx(math.log2(512 / 500) - 2 * math.log2(1.4 / 2**0.5))
    assert pairs[4][2] == pytest.approx(math.log2(32 / 30) - 2 * math.log2(5.6 / 2**2.5))
    assert pairs[-1][2] == 0.0
    assert max(abs(off) for *_, off in pairs) == pytest.approx(0.122, abs=1e-3)  # f/5.6 at 1/30 s


def test_times_are_written_as_on_a_dial():
    assert [write_time(t) for t in (1 / 125, 0.25, 0.3, 30.0)] == ["1/125 s", "1/4 s", "0.3 s", "30 s"]
    assert f_number_of(6) == 2.0 and time_of(-3) == 0.5
