"""A preview that was late makes those that follow coarser, and one at rest brings them back."""

from simulator.explore.pace import COLUMNS_PX, MOST_S, Pace


def test_a_late_preview_makes_the_next_so_coarse_that_it_is_in_time():
    pace = Pace()
    assert pace.columns_px(True) == pace.columns_px(False) == COLUMNS_PX[0]
    pace.note(COLUMNS_PX[0], 2.0 * MOST_S, True)
    assert 2.0 * (pace.columns_px(True) / COLUMNS_PX[0]) ** 2 <= 1.0  # time grows with the area
    assert pace.columns_px(False) == COLUMNS_PX[0]
    pace.note(240, 100.0, True)
    assert pace.columns_px(True) == COLUMNS_PX[-1]


def test_a_quick_preview_of_few_columns_changes_nothing_and_rest_brings_them_back_step_by_step():
    pace = Pace()
    pace.note(COLUMNS_PX[0], 100.0, True)
    pace.note(COLUMNS_PX[-1], 0.001, True)  # it may have been computed before
    assert pace.columns_px(True) == COLUMNS_PX[-1]
    seen = []
    for _ in COLUMNS_PX:
        pace.note(COLUMNS_PX[0], 0.5 * MOST_S, False)
        seen.append(pace.columns_px(True))
    assert seen == [*COLUMNS_PX[-2::-1], COLUMNS_PX[0]]


def test_a_slow_preview_at_rest_takes_one_step_since_it_may_have_compiled():
    pace = Pace()
    pace.note(COLUMNS_PX[0], 100.0, False)
    assert pace.columns_px(True) == COLUMNS_PX[1]
