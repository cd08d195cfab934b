"""Every case of the search, the sensor's first."""

from . import function_cases, lens_cases, light_cases, motion_cases, neighbor_cases, place_cases, psf_cases, sensor_cases

CASES = (
    *light_cases.CASES,
    *neighbor_cases.CASES,
    *sensor_cases.CASES,
    *function_cases.CASES,
    *place_cases.CASES,
    *lens_cases.CASES,
    *psf_cases.CASES,
    *motion_cases.CASES,
)
