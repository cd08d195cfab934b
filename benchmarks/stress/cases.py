"""Every case of the search, the sensor's first."""

from . import (
    code_cases,
    function_cases,
    layer_cases,
    lens_cases,
    light_cases,
    motion_cases,
    neighbor_cases,
    place_cases,
    psf_cases,
    psf_light_cases,
    ray_cases,
    sensor_cases,
)

CASES = (
    *light_cases.CASES,
    *neighbor_cases.CASES,
    *sensor_cases.CASES,
    *code_cases.CASES,
    *function_cases.CASES,
    *place_cases.CASES,
    *lens_cases.CASES,
    *ray_cases.CASES,
    *psf_cases.CASES,
    *psf_light_cases.CASES,
    *motion_cases.CASES,
    *layer_cases.CASES,
)
