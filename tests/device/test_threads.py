"""Work on several threads gives what a loop gives."""

from threading import Barrier, get_ident

import pytest

from simulator.device.threads import THREADS, both, in_threads


@pytest.mark.parametrize("count", [0, 1, 2, 7])
def test_results_stand_in_the_order_of_the_items(count):
    assert in_threads(lambda item: 2 * item, iter(range(count))) == [2 * item for item in range(count)]


def test_several_items_are_computed_at_once():
    together = Barrier(THREADS, timeout=60.0)  # breaks unless so many threads wait for each other
    assert len(set(in_threads(lambda _: together.wait() >= 0 and get_ident(), range(THREADS)))) == THREADS


def test_both_are_computed_at_once_the_second_one_here():
    together = Barrier(2, timeout=60.0)
    one, other = both(lambda: together.wait() >= 0 and get_ident(), lambda: together.wait() >= 0 and get_ident())
    assert other == get_ident() != one


@pytest.mark.parametrize("place", [0, 1])
def test_an_error_of_either_is_raised(place):
    functions = [lambda: 1, lambda: 2]
    functions[place] = lambda: 1 // 0
    with pytest.raises(ZeroDivisionError):
        both(*functions)
    with pytest.raises(ZeroDivisionError):
        in_threads(lambda item: 1 // item, [1, 0, 2])
