"""Cases of the functions of plain_math.h, of which kernels are made."""

import math
from collections.abc import Callable

import numpy as np
from helpers.kernel_bench import Bench

from simulator.device import Device

from .inputs import number
from .search import Outcome, StressCase
from .space import Inputs, Real


def function_case(
    name: str, include: str, expression: str, exact: Callable[[np.ndarray], np.ndarray], space: Real, most_ulps: float, why: str
) -> StressCase:
    """Return the case of a function of one number, of a header of kernels/; 256 numbers around the input are tried at once."""

    def run(device: Device, inputs: Inputs) -> Outcome:
        middle = np.float32(number(inputs, "x"))
        steps = np.arange(-128, 128, dtype=np.int64)
        values = (middle.view(np.int32).astype(np.int64) + steps).clip(0, 0x7F7FFFFF).astype(np.int32).view(np.float32)
        if middle < 0.0:
            values = middle + np.float32(np.spacing(middle)) * steps.astype(np.float32)
        values = values[(values >= space.low) & (values <= space.high)]
        found = Bench(device).header(include, expression, {"x": values})
        return Outcome(found, exact(values.astype(np.float64)))

    return StressCase(name, (), {"x": space}, run, why, most_ulps=most_ulps)


NORMAL = Real(1.2e-38, 8e37, log=True)
CASES = (
    function_case(
        "reciprocal", "plain_math.h", "reciprocal(x)", lambda x: 1.0 / x, NORMAL, 3.4, "2e-7 of three Newton steps: 3.4 ulps"
    ),
    function_case(
        "reciprocal_square_root",
        "plain_math.h",
        "reciprocal_square_root(x)",
        lambda x: x**-0.5,
        NORMAL,
        14.0,
        "8e-7 of one Newton step from 0.065 %: 14 ulps",
    ),
    function_case(
        "exponential",
        "plain_math.h",
        "exponential(x)",
        np.exp,
        Real(-80.0, 80.0, switches=(0.0, math.log(2.0) / 2.0)),
        672.0,
        "5e-7 times 80, where the product with log2 e has lost that much: 672 ulps; Poisson numbers need it up to 10: 84",
    ),
    function_case(
        "lost_share",
        "plain_math.h",
        "lost_share(x)",
        lambda x: -np.expm1(-x),
        Real(1.2e-38, 80.0, log=True, switches=(0.5,)),
        16.0,
        "seven rounded products and sums below 0.5, and 5e-7 times e^-0.5 above: 1e-6 is 16 ulps at most",
    ),
)
