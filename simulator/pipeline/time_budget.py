"""Plans shots with a time budget: at the most accurate tolerance whose predicted time fits."""

from dataclasses import replace

from simulator.device import Device
from simulator.pipeline.device_rates import DeviceRates, rates_of
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import STRIP_PX, Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.time_fit import TimeFit
from simulator.progress import Progress, silent

# Tolerances that a time budget chooses from, the most accurate first [standard deviations of the noise].
TOLERANCES = (0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0)


def plan_in_time(
    shot: Shot, device: Device, strip_px: int = STRIP_PX, cache: LightCache | None = None, progress: Progress = silent
) -> Plan:
    """Plan a shot for a device, whose rates are measured once where the shot has a time budget (`rates_of`).

    strip_px, cache: as of `plan`. progress: of the measuring. Raises PhotositeError as `plan` does.
    """
    if shot.time_budget_s is None:
        return plan(shot, strip_px, cache)
    fit = choose_tolerance(shot, shot.time_budget_s, rates_of(device, progress), device)
    return replace(plan(fit.settle(shot), strip_px, cache), fitted=fit)


def choose_tolerance(shot: Shot, budget_s: float, rates: DeviceRates, device: Device) -> TimeFit:
    """Return the most accurate of TOLERANCES whose passes take at most `budget_s` at these rates; else the least accurate.

    The time is that of all passes after planning. It falls as the tolerance grows, so that a few plans are enough.
    """

    def fit_of(tolerance: float) -> TimeFit:
        planned = measure(plan(replace(shot, tolerance=tolerance, time_budget_s=None)), device)
        return TimeFit(budget_s, tolerance, 1e-3 * rates.cost_ms(planned.passes))

    found = fit_of(TOLERANCES[-1])
    first, last = 0, len(TOLERANCES) - 1  # the choice lies between them; the last is that of `found`
    while found.is_kept and first < last:
        middle = (first + last) // 2
        tried = fit_of(TOLERANCES[middle])
        if tried.is_kept:
            found, last = tried, middle
        else:
            first = middle + 1
    return found
