"""Flash: a second light with its own time, spectrum and distribution over the scene."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, Literal

import numpy as np

from simulator.color.spectra import check_illuminant, illuminant, luminance_cd_m2
from simulator.errors import PhotositeError, require
from simulator.exposure.line_times import LineTimes
from simulator.scene.deep_pixels import DeepPixels
from simulator.scene.scene import Layer, Scene
from simulator.units import Degrees, Joules, Metres, Seconds

KEY = "exposure.flash"
INCIDENT_LX_S = 250.0  # C of the incident-light equation E t = C N^2 / ISO, of a flat receptor
NARROW = 1e-6  # of a pulse: over an interval as narrow, the running integral in its middle is its mean


@dataclass(frozen=True)
class Flash:
    """Flash at the lens, which lights the whole field alike.

    guide_number_m: f-number times distance at ISO 100; the light on a surface at 1 m is then C GN^2 / 100 lx s, C = 250.
    energy_j: instead, energy of the light that it sends [J], within the wavelengths of the scene's spectra, even over a cone.
    beam_deg: full angle of that cone.
    length_s: of the pulse at even brightness. decay_s: time constant of the exponential end of the pulse, to 1/e.
    sync: fired when the last line is fully open (first_curtain), or so that its end, a tenth of its brightness, comes when
        the first line begins to close (second_curtain).
    delay_s: by which it is fired later, or earlier below 0.
    """

    length_s: Seconds = 0.0
    decay_s: Seconds = 0.0
    guide_number_m: Metres | None = None
    energy_j: Joules | None = None
    beam_deg: Degrees | None = None
    sync: Literal["first_curtain", "second_curtain"] = "first_curtain"
    delay_s: Seconds = 0.0
    illuminant: Annotated[str, 'CIE name such as D55, or "5600 K"'] = "D55"

    def __post_init__(self) -> None:
        for key, time_s in (("length", self.length_s), ("decay", self.decay_s)):
            require(0 <= time_s < math.inf, f"{KEY}.{key}", f"{time_s:g} s", "give a time of 0 s or more, such as 1/1000 s")
        rule = "a pulse takes time: give its length, its decay, or both, such as 1/1000 s"
        require(self.length_s + self.decay_s > 0, f"{KEY}.length", f"{self.length_s:g} s", rule)
        require(math.isfinite(self.delay_s), f"{KEY}.delay", f"{self.delay_s:g} s", "give a finite time, such as 0 s")
        number, energy, beam = self.guide_number_m, self.energy_j, self.beam_deg
        rule = "give a guide_number, such as 36 m, or an energy and the angle of its beam"
        require(
            (number is None) != (energy is None), f"{KEY}.guide_number", "none" if number is None else f"{number:g} m", rule
        )
        good = number is None or 0 < number < math.inf
        require(good, f"{KEY}.guide_number", f"{number or 0:g} m", "give f-number times distance at ISO 100, such as 36 m")
        require(energy is None or 0 < energy < math.inf, f"{KEY}.energy", f"{energy or 0:g} J", "give an energy above 0 J")
        rule = "goes with an energy: the full angle of the cone that it lights, above 0 and up to 360 deg"
        good = (beam is None) == (energy is None) and (beam is None or 0 < beam <= 360)
        require(good, f"{KEY}.beam", "none" if beam is None else f"{beam:g} deg", rule)
        require(
            self.sync in ("first_curtain", "second_curtain"), f"{KEY}.sync", self.sync, "give first_curtain or second_curtain"
        )
        check_illuminant(self.illuminant, f"{KEY}.illuminant")

    def pulse(self, lines: LineTimes, release_s: float) -> "FlashPulse":
        """Return its light over the clock, for lines that are open at these times after the shutter's release [s]."""
        if self.sync == "first_curtain":
            fires_s = float(lines.open_s.max())
        else:
            fires_s = float(lines.closes_s.min()) - self.length_s - math.log(10.0) * self.decay_s
        return FlashPulse(release_s + fires_s + self.delay_s, self.length_s, self.decay_s)

    def white_j_m2_sr_nm(self, wavelengths_nm: np.ndarray) -> np.ndarray:
        """Return the radiance of a perfectly white surface 1 m away, integrated over the pulse [J m^-2 sr^-1 nm^-1].

        Of a surface that faces the flash. Elsewhere it falls with the square of the distance.
        """
        light = illuminant(self.illuminant, wavelengths_nm)
        if self.guide_number_m is not None:
            exposure_lx_s = INCIDENT_LX_S / 100.0 * self.guide_number_m**2
            return light * (exposure_lx_s / float(luminance_cd_m2(light, wavelengths_nm)) / math.pi)
        assert self.energy_j is not None and self.beam_deg is not None  # __post_init__
        solid_angle_sr = 2.0 * math.pi * (1.0 - math.cos(math.radians(0.5 * self.beam_deg)))
        return light * (self.energy_j / solid_angle_sr / float(np.trapezoid(light, wavelengths_nm)) / math.pi)

    def describe(self) -> str:
        """Return its numbers."""
        power = f"guide number {self.guide_number_m:g} m" if self.energy_j is None else f"{self.energy_j:g} J"
        pulse = [f"{self.length_s:.3g} s"] * (self.length_s > 0) + [f"decay {self.decay_s:.3g} s"] * (self.decay_s > 0)
        return f"{power}, {' and '.join(pulse)}, {self.sync.replace('_', ' ')}"


@dataclass(frozen=True)
class FlashPulse:
    """Light of a flash over the clock [1/s]: even for its length, then falling exponentially; its integral is 1.

    fires_s: on the clock [s].
    """

    fires_s: float
    length_s: float
    decay_s: float

    @property
    def steady(self) -> float:
        """None of its light is steady."""
        return 0.0

    @property
    def span_s(self) -> tuple[float, float]:
        """From the firing until a millionth of its brightness is left."""
        return self.fires_s, self.fires_s + self.length_s + math.log(1e6) * self.decay_s

    def mean_integral(self, begin_s: np.ndarray, end_s: np.ndarray) -> np.ndarray:
        """Return the mean over the interval of the share of the light that has come."""
        begin, end = np.asarray(begin_s) - self.fires_s, np.asarray(end_s) - self.fires_s
        width, first, last = end - begin, np.maximum(begin, 0.0), np.maximum(end, 0.0)
        is_narrow = width < NARROW * (self.length_s + self.decay_s)
        to_come = self._missing_s(last) - self._missing_s(first)
        mean = ((last - first) - to_come) / np.where(is_narrow, 1.0, width)
        return np.where(is_narrow, self._come(0.5 * (begin + end)), mean)

    def brightness(self, times_s: np.ndarray) -> np.ndarray:
        """Return the light at some instants of the clock [s], per second."""
        after_s = np.asarray(times_s) - self.fires_s
        tail_s = np.maximum(after_s - self.length_s, 0.0)
        falling = np.exp(-tail_s / self.decay_s) if self.decay_s > 0 else tail_s == 0.0
        return np.where(after_s < 0.0, 0.0, falling) / (self.length_s + self.decay_s)

    def _come(self, after_s: np.ndarray) -> np.ndarray:
        """Return the share of the light that has come this long after firing."""
        whole_s = self.length_s + self.decay_s
        even = np.clip(after_s, 0.0, self.length_s) / whole_s
        if self.decay_s == 0:
            return even
        return even + self.decay_s / whole_s * -np.expm1(-np.maximum(after_s - self.length_s, 0.0) / self.decay_s)

    def _missing_s(self, after_s: np.ndarray) -> np.ndarray:
        """Return the integral, from the firing on, of the share of the light that is still to come [s]; after_s: 0 or more."""
        whole_s, even_s = self.length_s + self.decay_s, np.minimum(after_s, self.length_s)
        missing = even_s - even_s**2 / (2.0 * whole_s)
        if self.decay_s == 0:
            return missing
        return missing + self.decay_s**2 / whole_s * -np.expm1(-np.maximum(after_s - self.length_s, 0.0) / self.decay_s)


def add_flash(scene: Scene, flash: Flash, tangent_per_px: float) -> Scene:
    """Return the scene with as many bands more, which are its light from the flash.

    tangent_per_px: tangent of the angle from the axis, per pixel of the scene, which lengthens the way to what stands aside.
    The spectra of the new bands are those of 1 m, integrated over the pulse [J m^-2 sr^-1 nm^-1]; their planes have the inverse
    square of the distance [m^-2]. Surfaces are taken to face the flash; the second half of its way, to the lens, costs nothing.
    Raises PhotositeError for a scene without depth, and for one that states radiance without reflectance.
    """
    white = scene.white
    if white is None:
        rule = "lights reflectances, but this scene states radiance alone; give a picture, a chart, or quantity: reflectance"
        raise PhotositeError(rule, key=KEY, joint=" ")
    if not any(np.isfinite(layer.depth_m).any() for layer in scene.layers):
        rule = "falls with the distance, but everything in this scene is infinitely far; give scene.depth, such as 3 m"
        raise PhotositeError(rule, key=KEY, joint=" ")
    known = scene.illuminant > 0
    grid_nm = scene.wavelengths_nm
    reflectances = [np.interp(grid_nm, grid_nm[known], (own / white)[known]) for own in _over(scene)]
    spectra = np.stack(reflectances) * flash.white_j_m2_sr_nm(grid_nm)
    lit = scene.remember(("flash", tangent_per_px), lambda: _with_falling_bands(scene, tangent_per_px))
    return replace(lit, spectra_w_m2_sr_nm=np.vstack([scene.spectra_w_m2_sr_nm, spectra]))


def _with_falling_bands(scene: Scene, tangent_per_px: float) -> Scene:
    """Return the scene with its planes twice, the second time per square metre of distance; whatever the flash."""
    is_kept = not any(array.flags.writeable for array in scene.arrays())
    height, width = scene.planes.shape[:2]
    y, x = (tangent_per_px * (np.arange(size) + 0.5 - 0.5 * size) for size in (height, width))
    lengthening = 1.0 + x[None, :] ** 2 + y[:, None] ** 2
    front, *behind = (_lit_layer(layer, lengthening) for layer in scene.layers)
    deep = None if scene.deep is None else _lit_deep(scene.deep, lengthening)
    lit = replace(scene, planes=front.planes, behind=tuple(behind), deep=deep)
    for array in lit.arrays() if is_kept else ():
        array.setflags(write=False)
    return lit


def _over(scene: Scene) -> np.ndarray:
    """Return the spectra over the illuminant, (bands, wavelengths), 0 where it has none."""
    light = scene.illuminant
    return scene.spectra_w_m2_sr_nm * np.where(light > 0, 1.0 / np.where(light > 0, light, 1.0), 0.0)


def _lit_layer(layer: Layer, lengthening: np.ndarray) -> Layer:
    """Return the layer with bands of its light per square metre of distance behind its own; lengthening: (r / Z)^2."""
    falling = (1.0 / (np.asarray(layer.depth_m, np.float64) ** 2 * lengthening)).astype(np.float32)
    return replace(layer, planes=np.concatenate([layer.planes, layer.planes * falling[..., None]], axis=-1))


def _lit_deep(deep: DeepPixels, lengthening: np.ndarray) -> DeepPixels:
    """Return samples of a deep picture as `_lit_layer` does a layer; a volume is lit as in its middle."""
    depth_m = 0.5 * (deep.near_m + deep.far_m)
    falling = (1.0 / (depth_m**2 * lengthening.ravel()[deep.pixel])).astype(np.float32)
    return replace(deep, planes=np.concatenate([deep.planes, deep.planes * falling[:, None]], axis=-1))
