"""Which measurements a shutter allows."""

from simulator.exposure.shutter import CurtainShutter, FirstCurtainShutter, GlobalShutter, LeafShutter
from simulator.measurement.shutter_check.case import ShutterCase
from simulator.measurement.shutter_check.curtain_slit import SLIT, CurtainSlitCase
from simulator.measurement.shutter_check.exposed_time import ExposedTimeCase, slowest_s
from simulator.measurement.shutter_check.flash_band import EXPOSURE, FlashBandCase
from simulator.measurement.shutter_check.frames import ShutterBench
from simulator.measurement.shutter_check.lamp import LampCase
from simulator.measurement.shutter_check.moving_edge import MovingEdgeCase
from simulator.measurement.shutter_check.parasitic import ParasiticLightCase
from simulator.measurement.shutter_check.shake import ShakeCase

USUAL_S = 0.01  # exposure time where the shutter suggests none


def cases_of(bench: ShutterBench) -> list[ShutterCase]:
    """Return the measurements of the bench's shutter. Raises PhotositeError as `ShutterBench.scan` does."""
    shutter, scan = bench.shutter, bench.scan
    if scan is None:
        time_s = 2.0 * slowest_s(shutter) if isinstance(shutter, LeafShutter | FirstCurtainShutter) else 0.0
        leaks = isinstance(shutter, GlobalShutter) and shutter.parasitic_light > 0 and shutter.scan_order != "none"
        ghost: list[ShutterCase] = [ParasiticLightCase(USUAL_S, bench.readout_s)] if leaks else []
        return [*ghost, ExposedTimeCase(time_s or USUAL_S), ShakeCase()]
    lamp = LampCase(scan)
    if not isinstance(shutter, CurtainShutter):
        return [lamp, FlashBandCase(scan), ExposedTimeCase(EXPOSURE * scan.time_s), MovingEdgeCase(lamp), ShakeCase()]
    slit = [CurtainSlitCase(lamp)] if shutter.distance_mm > 0 else []
    return [lamp, *slit, ExposedTimeCase(SLIT * scan.time_s), MovingEdgeCase(lamp), ShakeCase()]
