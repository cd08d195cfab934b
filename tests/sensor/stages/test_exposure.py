"""Exposure: H = E t, and what cannot be set."""

import pytest

from simulator.errors import PhotositeError
from simulator.exposure.settings import Exposure
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.stage import Moments


@pytest.mark.parametrize("time_s", [0.0, -1.0])
def test_a_shutter_that_does_not_open_is_refused(time_s):
    with pytest.raises(PhotositeError, match="exposure.time.*1/125 s"):
        Exposure(time_s)


def test_iso_must_be_positive():
    with pytest.raises(PhotositeError, match="exposure.iso"):
        Exposure(0.01, 0)


def test_electrons_grow_with_time_and_area():
    assert Integration(0.5, 8.0).moments(Moments(10.0, 0.0)) == Moments(40.0, 0.0)


@pytest.mark.parametrize(
    "date", ["yesterday", "2025-02-29 12:00:00", "2026-05-01", "2026-5-1 12:30:00", "2026:05:01 12:30:00", ""]
)
def test_a_date_is_one_of_the_calendar_in_one_form(date):
    with pytest.raises(PhotositeError, match=f"exposure.date_time = {date}: give .*2026-05-01 12:30:00"):
        Exposure(0.01, date_time=date)
    assert Exposure(0.01, date_time="2024-02-29 23:59:59").date_time == "2024-02-29 23:59:59"
