"""What is plotted: a camera, or a shot with its camera and lens; and the plots that it has."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from simulator.errors import require
from simulator.measurement.curves.lens_plots import blur_plot, depth_of_field_plot, mtf_plot
from simulator.measurement.curves.sensor_plots import (
    CameraSetting,
    dynamic_range_plot,
    noise_plot,
    photon_transfer_plot,
    snr_plot,
)
from simulator.measurement.report.plot import Plot
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Camera
from simulator.units import Seconds

ALONE_TIME_S = 0.01  # exposure time of a camera without a shot


@dataclass(frozen=True, eq=False)
class Subject:
    """A camera at an exposure time, with the lens of a shot; None: a camera alone."""

    name: str
    setting: CameraSetting
    lens: Lens | None = None


def camera_subject(camera: Camera, isos: Sequence[int] = (), time_s: Seconds = ALONE_TIME_S) -> Subject:
    """Return a camera alone. isos: those of the curves over the signal; none: some of the camera's."""
    return Subject(f"{camera.make} {camera.model}", CameraSetting.of(camera, time_s, isos))


def shot_subject(shot: Shot, isos: Sequence[int] = ()) -> Subject:
    """Return the camera and lens of a shot, at its exposure time and ISO, or at these.

    A metered exposure is that which the camera chooses, for which the scene is read. Raises PhotositeError as `plan` does.
    """
    settled = plan(shot).settle(shot) if shot.exposure.is_metered else shot
    setting = CameraSetting.of(settled.camera, settled.exposure.time_s, isos or (settled.exposure.iso,))
    return Subject(shot.name, setting, settled.lens)


def _snr(subject: Subject) -> Plot | None:
    return snr_plot(subject.setting)


def _noise(subject: Subject) -> Plot | None:
    return noise_plot(subject.setting)


def _photon_transfer(subject: Subject) -> Plot | None:
    return photon_transfer_plot(subject.setting)


def _dynamic_range(subject: Subject) -> Plot | None:
    return dynamic_range_plot(subject.setting)


def _mtf(subject: Subject) -> Plot | None:
    lens = subject.lens
    return mtf_plot(lens, subject.setting.camera) if lens is None or lens.has_plane_of_focus else None


def _blur(subject: Subject) -> Plot | None:
    lens = subject.lens
    return blur_plot(lens, subject.setting.camera) if lens is not None and lens.forms_image else None


def _depth_of_field(subject: Subject) -> Plot | None:
    lens = subject.lens
    return depth_of_field_plot(lens, subject.setting.camera) if isinstance(lens, ThinLens) else None


PLOTS: dict[str, Callable[[Subject], Plot | None]] = {
    "snr": _snr,
    "noise": _noise,
    "photon_transfer": _photon_transfer,
    "dynamic_range": _dynamic_range,
    "mtf": _mtf,
    "blur": _blur,
    "depth_of_field": _depth_of_field,
}


def plots_of(subject: Subject, names: Sequence[str] = ()) -> list[Plot]:
    """Return plots of a subject, by the words of PLOTS; none: all that it has.

    Raises PhotositeError for an unknown word, and for a plot that the subject has not.
    """
    for name in names:
        require(name in PLOTS, "--only", name, f"give one of {', '.join(PLOTS)}")
    found = []
    for name in names or PLOTS:
        plot = PLOTS[name](subject)
        if plot is not None:
            found.append(plot.about(subject.name))
            continue
        rule = "needs the lens of a shot that forms an image; name a shot, or leave this plot out"
        require(not names, "--only", name, rule)
    return found
