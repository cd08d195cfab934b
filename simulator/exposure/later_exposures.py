"""The exposures of a frame that is read several times: one after the other on the clock, the longest from the release on."""

from dataclasses import replace

from simulator.errors import require
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.sensor.camera.camera import Camera


def later_exposures(exposure: Exposure, camera: Camera) -> list[Exposure]:
    """Return the exposures after the first of a camera with an HDR read-out, each with its time and its begin.

    With a rolling shutter each line begins its next exposure when the one before ends. Raises PhotositeError for a flash, which
    would fire in one of them only, and for a shutter whose parts move or leak, which does not open several times.
    """
    spec = camera.hdr_readout
    if spec is None or len(spec.exposure_shares) == 1:
        return []
    rule = "an hdr_readout of several exposures opens one by one; leave it out, or give gains instead"
    is_rolling = exposure.shutter is None or isinstance(exposure.shutter, RollingShutter)
    require(is_rolling, "exposure.shutter", "given", f"only a rolling shutter opens several times, but {rule}")
    require(exposure.flash is None, "exposure.flash", "given", f"fires in one exposure only, but {rule}")
    begin_s, found = exposure.start_s, []
    for before, share in zip(spec.exposure_shares, spec.exposure_shares[1:], strict=False):
        begin_s += before * exposure.time_s
        found.append(replace(exposure, time_s=share * exposure.time_s, start_s=begin_s))
    return found
