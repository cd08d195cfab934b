"""Stops: what the marks of a camera's dials mean, and how far each lies from its true stop.

A stop is a factor of two in exposure. True f-numbers are 2^(k/6) and true times 2^(k/3) s, where k counts thirds of a stop
from f/1 and 1 s. Dials are engraved with rounded numbers: f/5.6 for 5.657, 1/125 s for 1/128 s, 30 s for 32 s. The marks are
those of Exif (CIPA DC-008-2012, Annex C: APEX values and their approximate f-numbers and times) in whole stops, and of
common dials in thirds (Wikipedia, "F-number", table of the typical one-third-stop scale).
"""

import math

STEPS_PER_STOP = 3
# Marks in thirds of a stop: f-numbers from k = -6 on, times [s] from k = -45 on.
_FIRST_F, _FIRST_TIME = -6, -45
F_MARKS = (
    (0.5, 0.56, 0.63, 0.7, 0.8, 0.9)
    + (1.0, 1.1, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.5, 2.8, 3.2, 3.5, 4.0, 4.5, 5.0, 5.6, 6.3, 7.1, 8.0, 9.0, 10.0)
    + (11.0, 13.0, 14.0, 16.0, 18.0, 20.0, 22.0, 25.0, 29.0, 32.0, 36.0, 40.0, 45.0, 51.0, 57.0, 64.0)
)
_FRACTIONS = (
    32000,
    25600,
    20000,
    16000,
    12800,
    10000,
    8000,
    6400,
    5000,
    4000,
    3200,
    2500,
    2000,
    1600,
    1250,
    1000,
    800,
    640,
) + (500, 400, 320, 250, 200, 160, 125, 100, 80, 60, 50, 40, 30, 25, 20, 15, 13, 10, 8, 6, 5, 4)
_SECONDS = (0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.3, 1.6, 2.0, 2.5, 3.2, 4.0, 5.0, 6.0, 8.0, 10.0, 13.0, 15.0, 20.0, 25.0, 30.0)
TIME_MARKS_S = tuple(1.0 / number for number in _FRACTIONS) + _SECONDS


def f_number_of(thirds: float) -> float:
    """Return the f-number this many thirds of a stop from f/1: 2^(k/6), since the exposure goes as 1/N^2."""
    return 2.0 ** (thirds / (2 * STEPS_PER_STOP))


def time_of(thirds: float) -> float:
    """Return the time this many thirds of a stop from 1 s: 2^(k/3) [s]."""
    return 2.0 ** (thirds / STEPS_PER_STOP)


def thirds_of_f_number(f_number: float) -> float:
    """Return how many thirds of a stop an f-number lies from f/1."""
    return 2 * STEPS_PER_STOP * math.log2(f_number)


def thirds_of_time(time_s: float) -> float:
    """Return how many thirds of a stop a time lies from 1 s."""
    return STEPS_PER_STOP * math.log2(time_s)


def mark_of_f_number(f_number: float) -> tuple[float, float] | None:
    """Return the mark of the nearest third of a stop and its true f-number; None beyond f/0.5 to f/64.

    A mark itself belongs to its own stop, although f/3.5 lies nearer to that of f/3.6.
    """
    if f_number in F_MARKS:
        place = F_MARKS.index(f_number)
    else:
        place = round(thirds_of_f_number(f_number)) - _FIRST_F
    return (F_MARKS[place], f_number_of(place + _FIRST_F)) if 0 <= place < len(F_MARKS) else None


def mark_of_time(time_s: float) -> tuple[float, float] | None:
    """Return the mark of the nearest third of a stop and its true time [s]; None beyond 1/32000 s to 30 s."""
    if time_s in TIME_MARKS_S:
        place = TIME_MARKS_S.index(time_s)
    else:
        place = round(thirds_of_time(time_s)) - _FIRST_TIME
    return (TIME_MARKS_S[place], time_of(place + _FIRST_TIME)) if 0 <= place < len(TIME_MARKS_S) else None


def equal_exposures(
    f_number: float, time_s: float, widest: float = 1.4, narrowest: float = 32.0
) -> list[tuple[float, float, float]]:
    """Return pairs of marks in whole stops whose true stops give the exposure of the true stops nearest to these settings.

    Each is f-number, time [s], and how far the marks' exposure t / N^2 is above that of their true stops [stops].
    widest, narrowest: marks of the f-numbers. Pairs whose time has no mark are left out.
    """
    value = round(thirds_of_time(time_s)) - round(thirds_of_f_number(f_number))
    first, last = (round(thirds_of_f_number(mark)) for mark in (widest, narrowest))
    found = []
    for place in range(first, last + 1, STEPS_PER_STOP):
        time_place = value + place - _FIRST_TIME
        if not 0 <= time_place < len(TIME_MARKS_S) or not 0 <= place - _FIRST_F < len(F_MARKS):
            continue
        mark, mark_s = F_MARKS[place - _FIRST_F], TIME_MARKS_S[time_place]
        off = math.log2(mark_s / time_of(value + place)) - 2.0 * math.log2(mark / f_number_of(place))
        found.append((mark, mark_s, off))
    return found


def write_time(time_s: float) -> str:
    """Return a time as dials show it: `1/125 s` below a quarter of a second, else `0.3 s`."""
    return f"1/{1.0 / time_s:.5g} s" if 0.0 < time_s < 0.26 else f"{time_s:.4g} s"
