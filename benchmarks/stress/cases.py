"""Every case of the search, the sensor's first."""

from . import lens_cases, motion_cases, sensor_cases

CASES = (*sensor_cases.CASES, *lens_cases.CASES, *motion_cases.CASES)
