"""A prior of noise of one's own: straight lines of ln sigma on ln K with scatter, as `photosite dataset` reads them from YAML.

The form of Wei et al. (CVPR 2020, eq. 10 and 11), which the published priors eld, pmn and led have, too.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from data_gen.recipe.noise_setting import NoiseSetting, told_of_clipped_dark
from data_gen.recipe.prior_cameras import LineCamera
from data_gen.recipe.published_priors import LinePrior, check_prior_camera
from simulator.config.distributions import Distribution, check_weights
from simulator.config.random_streams import RandomStream
from simulator.errors import require
from simulator.measurement.noise_check.expected import is_clear_of_zero
from simulator.sensor.camera.camera import Camera
from simulator.sensor.kernel.kernel_program import in_order
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.stage import Moments
from simulator.sensor.stages.tukey_lambda_polynomial import tukey_lambda_deviation
from simulator.units import DigitalNumbers, DigitalNumbersPerElectron

_SCATTERS = 5.0  # standard deviations about a line that must be a noise which the codes can hold


@dataclass(frozen=True)
class NoiseLine:
    """ln sigma = slope * ln K + intercept + N(0, scatter), sigma in DN and K in DN/e-.

    slope: 0: the same in DN at every gain; 1: the same in electrons.
    intercept: ln of sigma [DN] at K = 1 DN/e-.
    scatter: standard deviation of ln sigma about the line, 0 or above.
    """

    slope: float
    intercept: float
    scatter: float = 0.0

    def __post_init__(self) -> None:
        for key, value in (("slope", self.slope), ("intercept", self.intercept)):
            require(math.isfinite(value), key, value, "give a finite number")
        require(0 <= self.scatter < math.inf, "scatter", self.scatter, "a standard deviation is not negative")

    def sigma_dn(self, gain_dn_per_e: float) -> float:
        """Return sigma on the line [DN]."""
        return math.exp(self.slope * math.log(gain_dn_per_e) + self.intercept)

    def largest_sigma_dn(self, ln_gain: float) -> float:
        """Return sigma at a gain, five standard deviations above the line [DN]; inf where that is too large a number."""
        exponent = self.slope * ln_gain + self.intercept + _SCATTERS * self.scatter
        return math.exp(exponent) if exponent < 700.0 else math.inf


@dataclass(frozen=True)
class LineNoise:
    """Noise of a camera or of a family of cameras: ln K is uniform, the noises follow it.

    lowest_gain_dn_per_e, highest_gain_dn_per_e: range of K [DN/e-].
    read_noise: of each photosite.
    row_noise: offset of a whole row; left out: none.
    tukey_lambda: shapes of the read noise, one of which is drawn, -0.3 to 0.25; left out: it is normal.
    weight: how often this line is taken against the others.
    """

    lowest_gain_dn_per_e: DigitalNumbersPerElectron
    highest_gain_dn_per_e: DigitalNumbersPerElectron
    read_noise: NoiseLine
    row_noise: NoiseLine | None = None
    tukey_lambda: tuple[float, ...] = ()
    weight: float = 1.0

    def __post_init__(self) -> None:
        low, high = self.lowest_gain_dn_per_e, self.highest_gain_dn_per_e
        require(0 < low < math.inf, "lowest_gain", f"{low:g} DN/e-", "give a gain above 0, such as 0.1 DN/e-")
        require(low < high < math.inf, "highest_gain", f"{high:g} DN/e-", f"give more than the lowest gain, {low:g} DN/e-")
        for shape in self.tukey_lambda:
            ReadNoiseAfterGain(1.0, shape)  # checks the shape

    def dark_sigma_dn(self, is_scale: bool) -> float:
        """Return the largest standard deviation of the dark on the lines, without their scatter [DN].

        is_scale: as in `line_camera`.
        """
        factor = max(map(tukey_lambda_deviation, self.tukey_lambda)) if is_scale else 1.0
        row = self.row_noise
        return max(
            math.hypot(factor * self.read_noise.sigma_dn(gain), row.sigma_dn(gain) if row is not None else 0.0)
            for gain in (self.lowest_gain_dn_per_e, self.highest_gain_dn_per_e)
        )

    def line_camera(self, name: str, is_scale: bool) -> LineCamera:
        """Return this as the published lines are held. is_scale: the read noise is the scale of a Tukey-lambda distribution."""
        lines = [
            None if line is None else (line.slope, line.intercept, line.scatter) for line in (self.read_noise, self.row_noise)
        ]
        read, row = lines
        assert read is not None
        gains = math.log(self.lowest_gain_dn_per_e), math.log(self.highest_gain_dn_per_e)
        return LineCamera(name, gains, read, row, self.tukey_lambda, read_is_sigma=not is_scale)


@dataclass(frozen=True)
class OwnPrior:
    """Noise of lines of one's own; docs/dataset.md has an example.

    lines: by name; for each sample one is drawn.
    camera: whose colour filter and response the clean pictures have, as in a shot file.
    black_level_dn: pedestal [DN].
    bit_depth: of the codes.
    read_noise_is: what the lines of the read noise give: its standard deviation (sigma), or the scale of a Tukey-lambda
        distribution (tukey_scale), as ELD, PMN and LED publish it.
    """

    lines: dict[str, LineNoise]
    camera: Camera
    black_level_dn: DigitalNumbers
    bit_depth: int = 14
    read_noise_is: Literal["sigma", "tukey_scale"] = "sigma"

    def __post_init__(self) -> None:
        check_prior_camera(self.camera)
        require(bool(self.lines), "noise.lines", "{}", "give at least one line, by any name")
        check_weights("noise.lines.weight", tuple(line.weight for line in self.lines.values()))
        adc = Adc(self.bit_depth, self.black_level_dn)  # checks both
        for name, line in self.lines.items():
            key = f"noise.lines.{name}"
            shaped = self.read_noise_is == "sigma" or bool(line.tukey_lambda)
            rule = "a Tukey-lambda scale needs its shapes; give a list, or read_noise_is: sigma"
            require(shaped, f"{key}.tukey_lambda", "[]", rule)
            for part, noise in (("read_noise", line.read_noise), ("row_noise", line.row_noise)):
                if noise is None:
                    continue
                gains = line.lowest_gain_dn_per_e, line.highest_gain_dn_per_e
                worst_dn = max(noise.largest_sigma_dn(math.log(gain)) for gain in gains)
                rule = f"reaches {worst_dn:.3g} DN within its scatter, more than the {adc.max_code} codes; lower the line"
                require(worst_dn <= adc.max_code, f"{key}.{part}", f"intercept {noise.intercept:g}", rule)

    @cached_property
    def _prior(self) -> LinePrior:
        is_scale = self.read_noise_is == "tukey_scale"
        cameras = tuple(line.line_camera(name, is_scale) for name, line in self.lines.items())
        weights = tuple(line.weight for line in self.lines.values())
        return LinePrior(cameras, self.black_level_dn, 1.0, self.bit_depth, weights)

    @property
    def exposure_ratio(self) -> Distribution:
        """Ratio of light: 1, since such a prior states none."""
        return 1.0

    def draw_setting(self, group: RandomStream, sample: RandomStream, exposure_time_s: float | None = None) -> NoiseSetting:
        """Draw the setting of one sample from the random stream `sample`; the others are not used."""
        name, stages = self._prior.stages(sample)
        return NoiseSetting(name, 0, self.camera, in_order(stages))

    def list_cameras(self) -> tuple[Camera, ...]:
        """Return the cameras that clean pictures are made for."""
        return (self.camera,)

    def table(self) -> list[tuple[str, str]]:
        """Return each line and its range of K, as text for a table on the screen."""
        return [
            (name, f"K {line.lowest_gain_dn_per_e:g} to {line.highest_gain_dn_per_e:g} DN/e-")
            for name, line in self.lines.items()
        ]

    def warnings(self) -> tuple[str, ...]:
        """Return a line for each line of noise whose dark codes are clipped at an end of its range."""
        is_scale = self.read_noise_is == "tukey_scale"
        darks = {name: Moments(self.black_level_dn, line.dark_sigma_dn(is_scale) ** 2) for name, line in self.lines.items()}
        return tuple(told_of_clipped_dark(name) for name, dark in darks.items() if not is_clear_of_zero(dark))
