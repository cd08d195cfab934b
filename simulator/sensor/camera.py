"""A camera body: geometry, colour response, and what its ISO dial sets."""

import math
from dataclasses import dataclass, field
from typing import Annotated, Literal, get_args

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.sensor.adc import Adc
from simulator.sensor.analog_gain import AnalogGain
from simulator.sensor.binning import Binning
from simulator.sensor.camera_sections import IsoSetting, SpectralResponse, Window
from simulator.sensor.crosstalk import Crosstalk
from simulator.sensor.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.read_noise_before_gain import ReadNoiseBeforeGain
from simulator.stage import Stage
from simulator.units import DigitalNumbers, Micrometres

Cfa = Literal["RGGB", "BGGR", "GRBG", "GBRG", "MONO"]
LARGEST_SIDE_PX = 65535


@dataclass(frozen=True)
class Camera:
    """A camera body. See configs/cameras/ for examples; every number there names its source.

    iso_table: ISO -> measured gain and total read noise.
    read_noise_after_gain_dn: the part of the read noise that arises behind the gain [DN];
        the part before it is what remains of the measured total.
    stages: the other sensor stages by stem, for example {"full_well": FullWell(...)}.
    Raises PhotositeError for values that no camera can have, or that do not go together.
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
    crosstalk: Crosstalk | None = None
    binning: Binning | None = None

    def __post_init__(self):
        for key, side in (("width", self.width_px), ("height", self.height_px)):
            require(1 <= side <= LARGEST_SIDE_PX, f"camera.{key}", side, f"give 1 to {LARGEST_SIDE_PX} pixels")
        pitch_um = self.pixel_pitch_um
        require(0 < pitch_um < math.inf, "camera.pixel_pitch", f"{pitch_um:g} um", "give a pitch above 0 um")
        require(0 < self.fill_factor <= 1, "camera.fill_factor", self.fill_factor, "give a share above 0 and up to 1")
        require(self.cfa in get_args(Cfa), "camera.cfa", self.cfa, f"give one of {', '.join(get_args(Cfa))}")
        rule = f"needs {self.channels} values per line of response.relative, which has {self.response.channels}"
        require(self.response.channels == self.channels, "camera.cfa", self.cfa, rule)
        Adc(self.bit_depth, self.black_level_dn)  # checks both
        self._check_iso_table()
        self._check_window()

    def _check_iso_table(self) -> None:
        line = "100: {gain: 0.1 DN/e-, read_noise: 1 DN}"
        require(bool(self.iso_table), "camera.iso_table", "{}", f"give at least one line such as `{line}`")
        after_dn = self.read_noise_after_gain_dn
        require(after_dn >= 0, "camera.read_noise_after_gain", f"{after_dn:g} DN", "a standard deviation is not negative")
        rule = f"is below read_noise_after_gain = {after_dn:g} DN, which is a part of it"
        for iso, setting in self.iso_table.items():
            require(iso > 0, "camera.iso_table", iso, "an ISO is above 0")
            total_dn = setting.read_noise_dn
            require(total_dn >= after_dn, f"camera.iso_table.{iso}.read_noise", f"{total_dn:g} DN", rule)

    def _check_window(self) -> None:
        frame = self.frame
        inside = 0 <= frame.x <= self.width_px - frame.width and 0 <= frame.y <= self.height_px - frame.height
        rule = f"must lie within the sensor's {self.width_px} x {self.height_px} photosites"
        require(inside and min(frame.width, frame.height) >= 1, "camera.window", frame, rule)

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
        """Return the filter pattern as it begins at the frame's upper left corner."""
        return "MONO" if self.cfa == "MONO" else "".join("RGB"[plane] for row in self.filter_block() for plane in row)

    def iso_setting(self, iso: int) -> IsoSetting:
        """Return the measured line at this ISO. Raises PhotositeError when the camera was not measured there."""
        if iso not in self.iso_table:
            nearest = sorted(sorted(self.iso_table, key=lambda known: abs(math.log(known / iso)))[:3])
            known = ", ".join(str(value) for value in nearest)
            raise PhotositeError(f"exposure.iso = {iso}: the {self.make} {self.model} was not measured there; nearest: {known}")
        return self.iso_table[iso]

    def sensor_stages(self, iso: int, exposure_time_s: float) -> dict[str, Stage]:
        """Stages of one exposure by stem; those of no effect are absent.

        The measured total read noise is split: sigma_e^2 = (sigma_DN / K)^2 - (sigma_post / K)^2 lies before the gain.
        """
        setting = self.iso_setting(iso)
        gain, after_dn = setting.gain_dn_per_e, self.read_noise_after_gain_dn
        adc = Adc(self.bit_depth, self.black_level_dn)
        follows = {
            "exposure_time_s": exposure_time_s,
            "black_level_dn": adc.black_level_dn,
            "full_scale_dn": adc.max_code - adc.black_level_dn,
        }
        stages = {stem: stage.of_shot(**follows) for stem, stage in self.stages.items()}
        before_e = math.sqrt(setting.read_noise_dn**2 - after_dn**2) / gain
        if before_e > 0:
            stages["read_noise_before_gain"] = ReadNoiseBeforeGain(before_e)
        if after_dn > 0:
            stages["read_noise_after_gain"] = ReadNoiseAfterGain(after_dn)
        stages["analog_gain"] = AnalogGain(gain)
        stages["adc"] = adc
        return stages
