"""The exposures of a frame that is read several times: one after the other on the clock, the longest from the release on."""

from dataclasses import replace

from simulator.errors import PhotositeError, require
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.sensor.camera.camera import Camera

ROUNDING = 1e-9  # share of an interval by which exposures may exceed it, since written times are rounded


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


def outlasting(taken_s: float, interval_s: float, is_several: bool) -> str | None:
    """Return what is wrong where a frame's exposures outlast the interval to the next release; None where they do not.

    taken_s: all exposures of the frame [s]. is_several: whether they are several.
    """
    if taken_s <= interval_s * (1.0 + ROUNDING):
        return None
    what = f"exposures of {taken_s:g} s{' together' if is_several else ''}"
    return f"{what} outlast the interval of {interval_s:g} s; give a longer one"


def check_interval(exposure: Exposure, camera: Camera, interval_s: float) -> None:
    """Raise PhotositeError where the exposures of a frame, whose time the camera chose, outlast the interval [s]."""
    shares = (1.0,) if camera.hdr_readout is None else camera.hdr_readout.exposure_shares
    fault = outlasting(exposure.time_s * sum(shares), interval_s, len(shares) > 1)
    if fault is not None:
        raise PhotositeError(f"{fault}, or limit the time by exposure.dials.longest", key="sweep.series")
