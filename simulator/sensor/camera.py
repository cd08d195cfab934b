"""A camera body: geometry, colour response, and what its ISO dial sets."""

import math
from dataclasses import dataclass, field, replace
from typing import Annotated, Literal

import numpy as np

from simulator.errors import PhotositeError
from simulator.sensor.adc import Adc
from simulator.sensor.analog_gain import AnalogGain
from simulator.sensor.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.stage import Stage
from simulator.units import DigitalNumbers, DigitalNumbersPerElectron, Micrometres

Cfa = Literal["RGGB", "BGGR", "GRBG", "GBRG", "MONO"]


@dataclass(frozen=True)
class IsoSetting:
    """One measured line of a camera's ISO table.

    gain_dn_per_e: K of EMVA 1288 [DN/e-].
    read_noise_dn: total temporal dark noise in the raw file [DN].
    """

    gain_dn_per_e: DigitalNumbersPerElectron
    read_noise_dn: DigitalNumbers


@dataclass(frozen=True)
class Window:
    """Part of the sensor that is read out: x, y of its upper left photosite, width and height [px]."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True)
class SpectralResponse:
    """Quantum efficiency (filter, microlens and silicon together) per colour.

    wavelengths_nm: (wavelengths,) ascending, evenly spaced [nm].
    quantum_efficiency: (wavelengths, channels) electrons per photon; channels R, G, B, or one for MONO.
    """

    wavelengths_nm: np.ndarray
    quantum_efficiency: np.ndarray


@dataclass(frozen=True)
class Camera:
    """A camera body. See configs/cameras/ for examples; every number there names its source.

    iso_table: ISO -> measured gain and total read noise.
    read_noise_after_gain_dn: the part of the read noise that arises behind the gain [DN];
        the part before it is what remains of the measured total.
    stages: the other sensor stages by stem, for example {"full_well": FullWell(...)}.
    """

    make: str
    model: str
    width_px: Annotated[int, "photosites per row"]
    height_px: Annotated[int, "rows"]
    pixel_pitch_um: Micrometres
    cfa: Cfa
    bit_depth: int
    black_level_dn: DigitalNumbers
    response: SpectralResponse
    iso_table: dict[int, IsoSetting]
    read_noise_after_gain_dn: DigitalNumbers = 0.0
    fill_factor: float = 1.0
    stages: dict[str, Stage] = field(default_factory=dict)
    window: Window | None = None

    @property
    def channels(self) -> int:
        """Colour planes: 1 without a filter, else 3 (R, G, B)."""
        return 1 if self.cfa == "MONO" else 3

    @property
    def frame(self) -> Window:
        """The part that is read out: the window, or the whole sensor."""
        return self.window or Window(0, 0, self.width_px, self.height_px)

    @property
    def sensor_mm(self) -> tuple[float, float]:
        """Width and height of the whole sensor [mm]."""
        return 1e-3 * self.pixel_pitch_um * self.width_px, 1e-3 * self.pixel_pitch_um * self.height_px

    def filter_block(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Colour planes (0 R, 1 G, 2 B) of the 2x2 block at the upper left corner of the frame, [row][column]."""
        if self.cfa == "MONO":
            return (0, 0), (0, 0)
        block = np.array(["RGB".index(letter) for letter in self.cfa]).reshape(2, 2)
        rows = np.roll(block, (-self.frame.y % 2, -self.frame.x % 2), axis=(0, 1))
        return tuple(tuple(int(plane) for plane in row) for row in rows)

    def frame_cfa(self) -> Cfa:
        """The filter pattern as it begins at the frame's upper left corner."""
        return "MONO" if self.cfa == "MONO" else "".join("RGB"[plane] for row in self.filter_block() for plane in row)

    def iso_setting(self, iso: int) -> IsoSetting:
        """The measured line at this ISO. Raises PhotositeError when the camera was not measured there."""
        if iso not in self.iso_table:
            nearest = sorted(sorted(self.iso_table, key=lambda known: abs(math.log(known / iso)))[:3])
            known = ", ".join(str(value) for value in nearest)
            raise PhotositeError(f"exposure.iso = {iso}: the {self.make} {self.model} was not measured there; nearest: {known}")
        return self.iso_table[iso]

    def sensor_stages(self, iso: int, exposure_time_s: float) -> dict[str, Stage]:
        """Stages of one exposure by stem; those of no effect are absent.

        The measured total read noise is split: sigma_e^2 = (sigma_DN / K)^2 - (sigma_post / K)^2 lies before the gain.
        Raises PhotositeError when the part after the gain exceeds the measured total.
        """
        setting = self.iso_setting(iso)
        gain, after_dn = setting.gain_dn_per_e, self.read_noise_after_gain_dn
        if after_dn > setting.read_noise_dn:
            raise PhotositeError(
                f"camera.read_noise_after_gain = {after_dn} DN: more than the measured total at ISO {iso} "
                f"({setting.read_noise_dn} DN); give at most that"
            )
        before_e = math.sqrt(setting.read_noise_dn**2 - after_dn**2) / gain
        stages = dict(self.stages)
        if "dark_current" in stages:
            stages["dark_current"] = replace(stages["dark_current"], time_s=exposure_time_s)
        if before_e > 0:
            stages["read_noise_before_gain"] = ReadNoiseBeforeGain(before_e)
        if after_dn > 0:
            stages["read_noise_after_gain"] = ReadNoiseAfterGain(after_dn)
        stages["analog_gain"] = AnalogGain(gain)
        stages["adc"] = Adc(self.bit_depth, self.black_level_dn)
        return stages
