"""Noise of calibrated cameras: which camera, at which ISO."""

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import ClassVar

from data_gen.recipe.noise_setting import NoiseSetting, told_of_clipped_dark
from simulator.config.distributions import (
    Choice,
    Distribution,
    LogUniform,
    Normal,
    Table,
    Uniform,
    check_weights,
    draw,
    support_of,
    weighted_index,
)
from simulator.config.random_streams import RandomStream
from simulator.errors import require
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.cfa import BAYER
from simulator.sensor.kernel.kernel_program import in_order
from simulator.units import Seconds

MOST_SETTINGS = 4096  # that are kept, a few kB each


@dataclass(frozen=True)
class MeasuredIsos:
    """ISOs that the camera was measured at, each as likely as the range of ln ISO nearest to it is wide.

    measured: the lowest and the highest ISO; all when left out.
    """

    measured: tuple[int, int] | None = None

    def within_range(self, camera: Camera) -> tuple[int, ...]:
        """Return the measured ISOs within the range, ascending.

        Raises PhotositeError when there is none, and when the range goes beyond the camera's.
        """
        if self.measured is None:
            return camera.isos
        low, high = self.measured
        first, last = camera.isos[0], camera.isos[-1]
        beyond = f"the {camera.make} {camera.model} was measured from ISO {first} to {last}; give a range within these"
        require(not (low < first <= high or low <= last < high), "measured", list(self.measured), beyond)
        isos = tuple(iso for iso in camera.isos if low <= iso <= high)
        measured = ", ".join(map(str, camera.isos))
        rule = (
            f"the {camera.make} {camera.model} was not measured between them, but at {measured}; give a range with one of them"
        )
        require(bool(isos), "measured", list(self.measured), rule)
        return isos

    @staticmethod
    def draw_iso(isos: tuple[int, ...], probability: float) -> int:
        """Return that of some ISOs, ascending, which is nearest to a log-uniform draw between the lowest and the highest."""
        drawn = math.log(isos[0]) + probability * math.log(isos[-1] / isos[0])
        return min(isos, key=lambda iso: abs(math.log(iso) - drawn))


@dataclass(frozen=True)
class CameraChoice:
    """A camera of the data set.

    camera: as in a shot file; the name of this section when left out.
    iso: which ISO each sample has: measured ones, or any distribution within the measured range.
    weight: how often this camera is taken against the others.
    Raises PhotositeError for a camera that neither has a 2x2 colour filter nor reads each photosite out alone.
    """

    camera: Camera
    iso: MeasuredIsos | int | Uniform | LogUniform | Normal | Choice | Table = MeasuredIsos()
    weight: float = 1.0

    def __post_init__(self) -> None:
        check_weights("weight", (self.weight or 1.0,))
        camera, name = self.camera, f"{self.camera.make} {self.camera.model}"
        rule = f"data sets need a 2x2 colour filter, which the {name} has not"
        require(camera.cfa in BAYER, "camera.cfa", camera.cfa, rule)
        for key in ("binning", "blooming", "crosstalk", "hdr_readout"):
            rule = "data sets read each photosite out alone, and once; take it away with null"
            require(getattr(camera, key) is None, f"camera.{key}", "given", rule)
        for iso in (*self.range(), *self._between()):
            camera.iso_setting(iso)

    def range(self) -> tuple[int, ...]:
        """ISOs that are drawn, or the two ends of their range."""
        if isinstance(self.iso, MeasuredIsos):
            return self.iso.within_range(self.camera)
        listed = self.iso.choice if isinstance(self.iso, Choice) else support_of(self.iso)
        return tuple(sorted({round(iso) for iso in listed}))

    @cached_property
    def _measured(self) -> tuple[int, ...]:
        """ISOs of the section's range that the camera was measured at."""
        return self.iso.within_range(self.camera) if isinstance(self.iso, MeasuredIsos) else ()

    def _between(self) -> tuple[int, ...]:
        """ISOs between measured ones, one for each gap that a continuous distribution draws from."""
        if isinstance(self.iso, MeasuredIsos | int | Choice):
            return ()
        low, high = support_of(self.iso)
        middles = (round(math.sqrt(below * above)) for below, above in pairwise(self.camera.isos))
        return tuple(iso for iso in middles if low <= iso <= high)

    def draw_iso(self, probability: float) -> int:
        """Return the ISO at a probability from 0 to 1 of its distribution."""
        if isinstance(self.iso, MeasuredIsos):
            return self.iso.draw_iso(self._measured, probability)
        return round(draw(self.iso, probability))


@dataclass(frozen=True)
class CameraNoise:
    """Noise of calibrated cameras.

    cameras: a section for each camera, by name.
    exposure_time_s: exposure of the noisy frame, which the dark current of a camera that has one follows [s]; a camera that
        moves has its own, `motion.exposure_time_s`.
    """

    exposure_ratio: ClassVar[Distribution] = 1.0

    cameras: dict[str, CameraChoice]
    exposure_time_s: Seconds = 1.0 / 30.0

    def __post_init__(self) -> None:
        require(bool(self.cameras), "noise.cameras", "{}", "name at least one camera, such as `sony_a7s2: {}`")
        check_weights("noise.cameras", self._weights())
        require(0 < self.exposure_time_s < math.inf, "noise.exposure_time", self.exposure_time_s, "give a time such as 1/30 s")
        self.check_dark(self.exposure_time_s, "noise.exposure_time")

    def check_dark(self, longest_s: float, key: str) -> None:
        """Raise PhotositeError where dark current alone saturates a camera in the longest exposure [s].

        key: that states the exposure in the configuration.
        """
        for name, choice in self.cameras.items():
            for iso in choice.range():
                setting = self.setting(name, iso, longest_s)
                rule = f"dark current alone saturates the {name} at ISO {iso}; give less time, or a lower rate"
                require(setting.black_level_dn < setting.white_level_dn, key, f"{longest_s:g} s", rule)

    def draw_setting(self, group: RandomStream, sample: RandomStream, exposure_time_s: float | None = None) -> NoiseSetting:
        """Draw the setting of one sample: the camera from the random stream `group`, the ISO from the stream `sample`.

        exposure_time_s: of the sample [s]; None: the section's.
        """
        name = tuple(self.cameras)[weighted_index(self._weights(), group.uniform("camera"))]
        return self.setting(name, self.cameras[name].draw_iso(sample.uniform("iso")), exposure_time_s)

    def setting(self, name: str, iso: int, exposure_time_s: float | None = None) -> NoiseSetting:
        """Return a camera of the section at an ISO and an exposure [s], the section's when left out.

        Raises PhotositeError for an ISO outside its range.
        """
        time_s = self.exposure_time_s if exposure_time_s is None else exposure_time_s
        found = self._settings.get((name, iso, time_s))
        if found is None:
            camera = self.cameras[name].camera
            found = NoiseSetting(name, iso, camera, in_order(camera.sensor_stages(iso, time_s).values()))
            if len(self._settings) < MOST_SETTINGS:
                self._settings[name, iso, time_s] = found
        return found

    @cached_property
    def _settings(self) -> dict[tuple[str, int, float], NoiseSetting]:
        """Settings that were drawn before."""
        return {}

    def list_cameras(self) -> tuple[Camera, ...]:
        """Return the cameras that clean pictures are made for."""
        return tuple(choice.camera for choice in self.cameras.values())

    def table(self) -> list[tuple[str, str]]:
        """Return each camera with its ISOs, as text for a table on the screen."""
        return [(name, ", ".join(map(str, choice.range()))) for name, choice in self.cameras.items()]

    def warnings(self) -> tuple[str, ...]:
        """Return a line for each camera whose dark codes are clipped, with its ISOs of `range` at which they are."""
        clipped = {
            name: [iso for iso in choice.range() if self.setting(name, iso).clips_dark] for name, choice in self.cameras.items()
        }
        listed = {name: ", ".join(map(str, isos)) for name, isos in clipped.items() if isos}
        return tuple(told_of_clipped_dark(name, f" at ISO {isos}") for name, isos in listed.items())

    def _weights(self) -> tuple[float, ...]:
        """Return how often each camera is drawn against the others."""
        return tuple(choice.weight for choice in self.cameras.values())
