"""How fast the machine at hand is beside the one that predicted times refer to, for frames as small as an audit's."""

from statistics import median

from audit.measured_shot import least_time, run
from simulator.device import Device
from simulator.pipeline.device_rates import calibration_shots
from simulator.pipeline.planner import measure, plan

SIDE_PX = 64  # of the sharp frame; blurred ones have half of it, as frames of an audit


def machine_factor(device: Device) -> float:
    """Return the median of processor time over predicted time of the shots by which devices are measured (`least_time`)."""
    factors = []
    for shot in calibration_shots(SIDE_PX):
        planned = measure(plan(shot), device)
        run(planned, shot, device)  # compiles the kernels
        factors.append(least_time(planned, shot, device)[1] / planned.cost_ms())
    return median(factors)
