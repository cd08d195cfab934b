"""A camera body: geometry, colour response, and the parameters set by its ISO."""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Annotated, Literal

from simulator.displayed import Displayed
from simulator.errors import require
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera_sections import ColorMatrix, ConversionGainSwitch, IsoSetting, SpectralResponse, Window
from simulator.sensor.camera.cfa import BAYER, Cfa, CfaName
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.camera.hdr_readout import HdrReadout
from simulator.sensor.camera.iso_stages import iso_stages
from simulator.sensor.camera.iso_table import IsoTable
from simulator.sensor.camera.optical_black import OpticalBlack
from simulator.sensor.camera.read_noise_model import ReadNoiseModel
from simulator.sensor.camera.remosaic import Remosaic
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.stage import Stage
from simulator.units import DigitalNumbers, Micrometres, Seconds

LARGEST_SIDE_PX = 65535


@dataclass(frozen=True)
class Camera(Displayed):
    """A camera body. See configs/cameras/ for examples; every number there names its source.

    iso_table: ISO -> measured gain, noise and levels. A camera has this, or read_noise_model.
    read_noise_after_gain_dn: part of a table's read noise that arises after the gain [DN]; the part before the gain is the
        rest of the measured total. Not allowed together with a tukey_lambda.
    read_noise_spread: variation of the read noise before the gain between photosites: standard deviation of ln sigma, 0 to 1.
        Not allowed together with a tukey_lambda, whose tails include it.
    read_noise_model: read noise with two sources, for a camera without a table.
    cfa: colours of the filter from the sensor's upper left corner on, row by row: RGGB, BGGR, GRBG, GBRG, MONO without one,
        RCCB or RGWB with clear (C) or white (W) photosites, or the rows of a larger pattern with / between them, such as
        GBGGRG/RGRBGB/GBGGRG/GRGGBG/BGBRGR/GRGGBG.
    conversion_gain: first ISO of high conversion gain, for photosites with dual conversion gain.
    iso_range: measured refuses an ISO outside the measured range, extrapolate continues the slope of the table there.
    white_level_dn: code at which the camera saturates [DN]; 2^bit_depth - 1 when left out.
    color_matrix: a published colour matrix.
    fill_factor: light-sensitive share of a photosite, a square in its middle.
    low_pass_um: distance between the four spots of an optical low-pass filter, on either axis; 0: no filter.
    readout_time_s: in which all lines are read one after the other, from the start of the first to that of one past the last,
        with a rolling shutter that states none.
    binning: of photosites of one colour: of a Bayer pattern, or of the groups of a pattern such as RRGG/RRGG/GGBB/GGBB.
    remosaic: the codes of a pattern of groups become those of a Bayer pattern of the same size; left out: they stay.
    blooming: where charge above the full well goes; left out: it is drained. Needs stages.full_well.
    hdr_readout: several readings of one frame that are combined; left out: one reading.
    stages: the other sensor stages by stem, for example {"full_well": FullWell(...)}.
    sources: where the numbers of the file it was read from come from: keys and text; (): no file, or none is stated.
    Raises PhotositeError for values out of range, or that contradict each other.
    """

    make: str
    model: str
    width_px: Annotated[int, "photosites per row"]
    height_px: Annotated[int, "rows"]
    pixel_pitch_um: Micrometres
    cfa: CfaName
    bit_depth: int
    black_level_dn: DigitalNumbers
    response: SpectralResponse
    iso_table: dict[int, IsoSetting] = field(default_factory=dict)
    read_noise_after_gain_dn: DigitalNumbers = 0.0
    read_noise_spread: float = 0.0
    read_noise_model: ReadNoiseModel | None = None
    conversion_gain: ConversionGainSwitch | None = None
    iso_range: Literal["measured", "extrapolate"] = "measured"
    white_level_dn: DigitalNumbers | None = None
    color_matrix: ColorMatrix | None = None
    fill_factor: float = 1.0
    stages: dict[str, Stage] = field(default_factory=dict)
    window: Window | None = None
    crosstalk: Crosstalk | None = None
    binning: Binning | None = None
    optical_black: OpticalBlack | None = None
    low_pass_um: Micrometres = 0.0
    readout_time_s: Seconds | None = None
    hdr_readout: HdrReadout | None = None
    remosaic: Remosaic | None = None
    blooming: Blooming | None = None
    sources: tuple[tuple[str, str], ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        for key, side in (("width", self.width_px), ("height", self.height_px)):
            require(1 <= side <= LARGEST_SIDE_PX, f"camera.{key}", side, f"give 1 to {LARGEST_SIDE_PX} pixels")
        pitch_um = self.pixel_pitch_um
        require(0 < pitch_um < math.inf, "camera.pixel_pitch", f"{pitch_um:g} um", "give a pitch above 0 um")
        require(0 < self.fill_factor <= 1, "camera.fill_factor", self.fill_factor, "give a share above 0 and up to 1")
        require(0 <= self.low_pass_um < 100, "camera.low_pass", f"{self.low_pass_um:g} um", "give a distance from 0 to 100 um")
        if self.readout_time_s is not None:
            good = 0 <= self.readout_time_s < math.inf
            require(good, "camera.readout_time", f"{self.readout_time_s:g} s", "give a time of 0 s or more, such as 20 ms")
        _ = self.filter  # checks the pattern
        rule = f"needs {self.channels} values per line of response.relative, which has {self.response.channels}"
        require(self.response.channels == self.channels, "camera.cfa", self.cfa, rule)
        rule = "MONO has no colours" if self.channels == 1 else "a published matrix is of red, green and blue; leave it out"
        has_rgb = self.channels == 3 and self.filter.letters == "RGB"
        require(self.color_matrix is None or has_rgb, "camera.color_matrix", "given", rule)
        Adc(self.bit_depth, self.black_level_dn)  # checks both
        self._check_read_noise()
        self._check_levels()
        self._check_window()

    def _check_read_noise(self) -> None:
        """Raise PhotositeError for read noise that is given twice, or in forms that contradict each other."""
        after_dn = self.read_noise_after_gain_dn
        require(after_dn >= 0, "camera.read_noise_after_gain", f"{after_dn:g} DN", "a standard deviation is not negative")
        spread = self.read_noise_spread
        require(0 <= spread <= 1, "camera.read_noise_spread", spread, "give 0 to 1, such as 0.2")
        if self.read_noise_model is not None:
            rule = "a camera has a read_noise_model or a table; take one away (null removes what a base has)"
            require(not self.iso_table, "camera.iso_table", f"{len(self.iso_table)} lines", rule)
            rule = "a read_noise_model has its own after_gain; leave this out"
            require(after_dn == 0, "camera.read_noise_after_gain", f"{after_dn:g} DN", rule)
            return self.read_noise_model.check_switch(self.conversion_gain)
        _ = self._table  # checks the lines
        rowed = next((iso for iso, setting in self.iso_table.items() if setting.row_noise_dn > 0), None)
        rule = "stages.row_noise is given, too; leave one of them out"
        require(rowed is None or "row_noise" not in self.stages, f"camera.iso_table.{rowed}.row_noise", "given", rule)
        rule = f"is below read_noise_after_gain = {after_dn:g} DN, which is a part of it"
        for iso, setting in self.iso_table.items():
            total_dn = setting.read_noise_dn
            require(total_dn >= after_dn, f"camera.iso_table.{iso}.read_noise", f"{total_dn:g} DN", rule)
            shaped = setting.tukey_lambda is not None and after_dn > 0
            split = "the total has the shape tukey_lambda and is not split; leave read_noise_after_gain out"
            require(not shaped, "camera.read_noise_after_gain", f"{after_dn:g} DN", split)
            tails = "the tails of tukey_lambda hold what differs between photosites; leave one of them out"
            require(setting.tukey_lambda is None or spread == 0, "camera.read_noise_spread", spread, tails)
            grey = setting.color_bias_dn is not None and self.channels == 1
            require(not grey, f"camera.iso_table.{iso}.color_bias", setting.color_bias_dn, "MONO has no colours")
            large = setting.color_bias_dn is not None and self.cfa not in BAYER
            greens = "is stated for the greens of a Bayer pattern; leave it out"
            require(not large, f"camera.iso_table.{iso}.color_bias", setting.color_bias_dn, greens)

    def _check_levels(self) -> None:
        """Raise PhotositeError for black and white levels out of the ADC's range or in the wrong order."""
        gains = [] if self.hdr_readout is None else list(self.hdr_readout.gains)
        rule = "there is no ISO at which the camera was measured for all of them; give less different ones"
        require(bool(self.isos) or not gains, "camera.hdr_readout.gains", gains, rule)
        largest = 2**self.bit_depth - 1
        for iso in self.isos:
            setting = self.iso_setting(iso)
            key = f"camera.iso_table.{iso}" if self.iso_table.get(iso, setting).white_level_dn is not None else "camera"
            black_dn, white_dn = setting.levels_dn
            rule = f"must lie above the black level, {black_dn:g} DN, and up to {largest} DN, the ADC's range"
            require(0 <= black_dn < white_dn <= largest, f"{key}.white_level", f"{white_dn:g} DN", rule)

    def _check_window(self) -> None:
        """Raise PhotositeError for a window or an optical black that does not fit the sensor."""
        frame = self.frame
        inside = 0 <= frame.x <= self.width_px - frame.width and 0 <= frame.y <= self.height_px - frame.height
        rule = f"must lie within the sensor's {self.width_px} x {self.height_px} photosites"
        require(inside and min(frame.width, frame.height) >= 1, "camera.window", frame, rule)
        active, covered = self.active, self.optical_black
        require(
            min(active.width, active.height) > 0,
            "camera.optical_black",
            covered,
            "covers the whole sensor; leave a part to the light",
        )
        rule = "does not go together with binning, whose blocks would mix dark and lit photosites; leave one of them out"
        require(covered is None or self.binning is None, "camera.optical_black", covered, rule)
        averages = self.hdr_readout is not None and self.binning is not None and self.binning.mode == "average"
        rule = "combined codes of an hdr_readout cannot be averaged; take mode charge, or leave one of them out"
        require(not averages, "camera.binning.mode", "average", rule)
        self._check_groups()
        rule = "needs the charge that a photosite holds; give stages.full_well.capacity"
        require(self.blooming is None or "full_well" in self.stages, "camera.blooming", "given", rule)
        both = self.blooming is not None and self.hdr_readout is not None
        require(not both, "camera.blooming", "with hdr_readout", "the readings do not share it; leave one of them out")
        self._check_photodiodes()
        if covered is not None:
            rows, columns = self.filter.period
            rule = "give whole periods of the colour filter pattern"
            for key, side, period in (("left", covered.left_px, columns), ("top", covered.top_px, rows)):
                require(side % period == 0, f"camera.optical_black.{key}", side, f"{rule}, multiples of {period} photosites")

    def _check_photodiodes(self) -> None:
        """Raise PhotositeError for photodiodes whose numbers are relative to a stage that the camera has not."""
        readout = self.hdr_readout
        for key, stems in (("full_wells", ("full_well",)), ("dark_currents", ("dark_current", "hot_pixels"))):
            ratios = [1.0] if readout is None else list(getattr(readout, key))
            rule = f"are relative to the first photodiode's; give stages.{stems[0]}"
            has_stage = any(stem in self.stages for stem in stems)
            require(has_stage or set(ratios) == {1.0}, f"camera.hdr_readout.{key}", ratios, rule)

    def _check_groups(self) -> None:
        """Raise PhotositeError for binning or remosaic of a pattern that is not made for it."""
        binning, group = self.binning, self.filter.group
        if binning is not None and not self.filter.is_small:
            rule = "combines photosites of a Bayer pattern, of groups that begin at the sensor's corner, or without a filter"
            require(group > 1, "camera.binning", f"with cfa {self.cfa}", rule)
            require(binning.factor == group, "camera.binning.factor", binning.factor, f"give {group}, the side of the groups")
        if self.remosaic is None:
            return
        rule = "needs a pattern of groups that begin at the sensor's corner, such as RRGG/RRGG/GGBB/GGBB; leave it out"
        require(group > 1, "camera.remosaic", f"with cfa {self.cfa}", rule)
        for key in ("binning", "hdr_readout", "optical_black"):
            rule = f"does not go together with {key}; leave one of them out"
            require(getattr(self, key) is None, "camera.remosaic", f"with {key}", rule)
        rule = f"remosaic needs {2 * group} photosites a side"
        require(min(self.width_px, self.height_px) >= 2 * group, "camera.width", self.width_px, rule)

    @property
    def channels(self) -> int:
        """Colour planes: 1 without a filter, 3 (R, G, B, or R, C, B), or 4 (R, G, B, W)."""
        return 1 if self.cfa == "MONO" else len(self.filter.letters)

    @property
    def frame(self) -> Window:
        """Area of the sensor that is read out: the window, or the whole sensor."""
        return self.window or Window(0, 0, self.width_px, self.height_px)

    @property
    def active(self) -> Window:
        """Active area, the part of the sensor that light reaches: all but the optical black."""
        dark = self.optical_black or OpticalBlack()
        width, height = self.width_px - dark.left_px - dark.right_px, self.height_px - dark.top_px - dark.bottom_px
        return Window(dark.left_px, dark.top_px, width, height)

    @property
    def sensor_mm(self) -> tuple[float, float]:
        """Width and height of the whole sensor [mm]."""
        return 1e-3 * self.pixel_pitch_um * self.width_px, 1e-3 * self.pixel_pitch_um * self.height_px

    @property
    def filter(self) -> Cfa:
        """Colour filter array, starting at the sensor's upper left corner."""
        return Cfa.named(self.cfa)

    def frame_cfa(self) -> CfaName:
        """Return the name of the filter pattern of the frame that is given out, from its upper left corner on."""
        pattern, frame = self.filter, self.frame
        if pattern.group == 1 or (self.binning is None and self.remosaic is None):
            return pattern.name_at(frame.x, frame.y)
        step = 1 if self.binning is None else pattern.group
        return pattern.of_groups().name_at(frame.x // step, frame.y // step)

    @property
    def isos(self) -> tuple[int, ...]:
        """ISOs at which the camera was measured, ascending; for a read_noise_model the full stops.

        Those at which all readings of an hdr_readout have been measured.
        """
        isos = self._table.isos() if self.read_noise_model is None else self.read_noise_model.isos()
        if self.hdr_readout is None or self.iso_range == "extrapolate":
            return isos
        lowest = min(self.hdr_readout.gains)  # at which the last reading is read
        return tuple(iso for iso in isos if iso * lowest >= isos[0])

    def iso_setting(self, iso: float) -> IsoSetting:
        """Return gain, noise and levels at an ISO, with black and white level filled in.

        Raises PhotositeError outside the measured ISOs, unless iso_range is extrapolate.
        """
        extrapolate, name = self.iso_range == "extrapolate", f"{self.make} {self.model}"
        if self.read_noise_model is None:
            setting = self._table.setting(iso, extrapolate, name)
        else:
            setting = self.read_noise_model.setting(iso, extrapolate, self._conversion_ratio(iso), name)
        black, white = setting.black_level_dn, setting.white_level_dn
        default = 2**self.bit_depth - 1 if self.white_level_dn is None else self.white_level_dn
        black = self.black_level_dn if black is None else black
        return replace(setting, black_level_dn=black, white_level_dn=default if white is None else white)

    @cached_property
    def _table(self) -> IsoTable:
        """The ISO table. Raises PhotositeError for lines that contradict each other."""
        return IsoTable(self.iso_table, self.conversion_gain)

    def _conversion_ratio(self, iso: float) -> float:
        """Return the conversion gain relative to that of the lowest ISO; 1 for a table, whose lines include its effect."""
        switch = self.conversion_gain
        if self.read_noise_model is None or switch is None or iso < switch.iso:
            return 1.0
        assert switch.ratio is not None  # ReadNoiseModel.check_switch
        return switch.ratio

    def sensor_stages(self, iso: float, exposure_time_s: float) -> dict[str, Stage]:
        """Return the stages of one exposure by stem, those of the ISO without the ones that have no effect."""
        setting, ratio, model = self.iso_setting(iso), self._conversion_ratio(iso), self.read_noise_model
        black_dn, white_dn = setting.levels_dn
        follows = {
            "exposure_time_s": exposure_time_s,
            "black_level_dn": black_dn,
            "full_scale_dn": white_dn - black_dn,
        }
        stages = {stem: stage.of_shot(**follows) for stem, stage in self.stages.items()}
        after_dn = self.read_noise_after_gain_dn if model is None else model.after_gain_dn
        return stages | iso_stages(setting, after_dn, self.read_noise_spread, ratio, self.cfa, self.bit_depth)
