"""Published priors of noise: what well-known denoisers were trained on, by name.

| prior | source of the numbers |
|---|---|
| unprocessing | Brooks et al., CVPR 2019, "Unprocessing Images": timothybrooks/unprocessing, unprocess.py |
| cycleisp | Zamir et al., CVPR 2020: swz30/CycleISP@dc64f64, utils/noise_sampling.py, the setting for DND |
| eld | Wei et al., CVPR 2020, "A Physics-based Noise Model": Vandermode/ELD@53d5408, noise.py, camera_params/release |
| pmn | Feng et al., ACM MM 2022: megvii-research/PMN@d207d3e, data_process/process.py, the two lines of the Sony A7S II |
| led | Jin et al., ICCV 2023: Srameo/LED@ee3d372, options/base/noise_g/noise_g_virtual.yaml, noise_generator.py |

The first two give var = shot x + read of a signal x from 0 to 1. Here K = shot * (white - black), and the shot noise is counted
(Poisson), which has the same mean and variance as the published normal number and never counts below 0. They know no levels
and no ISO: 16 bits with a pedestal of 1/4 of the range keep rounding and clipping out. The others state K and scales in DN.
"""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from data_gen.recipe.noise_setting import NoiseSetting
from data_gen.recipe.prior_cameras import ELD, LED, PMN, LineCamera
from simulator.config.distributions import Distribution, Normal, Uniform, draw, weighted_index
from simulator.config.random_streams import RandomStream
from simulator.errors import require
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.cfa import BAYER
from simulator.sensor.camera.published_noise_model import noise_model_stages
from simulator.sensor.kernel.kernel_program import in_order
from simulator.sensor.stages.stage import Stage
from simulator.sensor.stages.tukey_lambda_polynomial import tukey_lambda_deviation

PriorName = Literal["unprocessing", "cycleisp", "eld", "pmn", "led"]


@dataclass(frozen=True)
class ShotReadPrior:
    """var = shot x + read; log shot is uniform, log read is normal about a line on it.

    base: of both logarithms. log_shot: range. slope, intercept, deviation: of log read on log shot.
    """

    base: float
    log_shot: tuple[float, float]
    slope: float
    intercept: float
    deviation: float
    bit_depth: int = 16
    black_level_dn: float = 16384.0
    exposure_ratio: Distribution = 1.0

    def stages(self, stream: RandomStream) -> tuple[str, tuple[Stage, ...]]:
        """Draw K and read noise; return the camera's name ("": the prior names none) and the sensor stages."""
        log_shot = draw(Uniform(self.log_shot), stream.uniform("gain"))
        log_read = draw(Normal((self.slope * log_shot + self.intercept, self.deviation)), stream.uniform("read noise"))
        span_dn = 2**self.bit_depth - 1 - self.black_level_dn
        gain_dn_per_e, read_dn = _round(span_dn * self.base**log_shot), _round(span_dn * self.base ** (0.5 * log_read))
        return "", noise_model_stages(gain_dn_per_e, read_dn, bit_depth=self.bit_depth, black_level_dn=self.black_level_dn)


@dataclass(frozen=True)
class LinePrior:
    """ln K is uniform; ln of each scale is normal about a line on ln K (Wei et al. 2020, eq. 10 and 11).

    cameras: one is drawn, all equally likely unless there are weights.
    """

    cameras: tuple[LineCamera, ...]
    black_level_dn: float
    exposure_ratio: Distribution
    bit_depth: int = 14
    weights: tuple[float, ...] | None = None

    def stages(self, stream: RandomStream) -> tuple[str, tuple[Stage, ...]]:
        """Draw a camera, K, read noise, row noise and colour bias; return the camera's name and the sensor stages."""
        camera = self.cameras[self._draw_camera(stream)]
        ln_gain = draw(Uniform(camera.ln_gain), stream.uniform("gain"))
        shape = camera.lambdas[stream.integer("lambda", len(camera.lambdas))] if camera.lambdas else None
        scale_dn = _draw_on_line(camera.read_scale, ln_gain, stream.uniform("read noise"))
        row_dn = 0.0 if camera.row is None else _draw_on_line(camera.row, ln_gain, stream.uniform("row noise"))
        return camera.name, noise_model_stages(
            _round(math.exp(ln_gain)),
            _round(scale_dn if camera.read_is_sigma or shape is None else scale_dn * tukey_lambda_deviation(shape)),
            bit_depth=self.bit_depth,
            black_level_dn=self.black_level_dn,
            tukey_lambda=shape,
            row_sigma_dn=_round(row_dn),
            color_bias_dn=_color_bias(camera, stream),
        )

    def _draw_camera(self, stream: RandomStream) -> int:
        if self.weights is None:
            return stream.integer("prior camera", len(self.cameras))
        return weighted_index(self.weights, stream.uniform("prior camera"))


# ratio of light: Vandermode/ELD and PMN draw it from U(100, 300), LED's options/base/pretrain/CVPR20_ELD.yaml the same.
DARK = Uniform((100.0, 300.0))
PRIORS: dict[str, ShotReadPrior | LinePrior] = {
    "unprocessing": ShotReadPrior(math.e, (math.log(1e-4), math.log(0.012)), 2.18, 1.20, 0.26),
    # The same constants, but as decimal logarithms: 10^1.2 / e^1.2 = 4.77 times the read variance, 2.3 times the spread.
    "cycleisp": ShotReadPrior(10.0, (-4.0, math.log10(0.012)), 2.18, 1.20, 0.26),
    "eld": LinePrior(ELD, 800.0, DARK),
    "pmn": LinePrior(PMN, 512.0, DARK),
    "led": LinePrior(LED, 512.0, DARK),
}


@dataclass(frozen=True)
class PriorNoise:
    """Noise of a published prior; docs/dataset.md says what each draws.

    prior: unprocessing, cycleisp, eld, pmn or led.
    camera: whose colour filter and response the clean pictures have, as in a shot file.
    """

    prior: PriorName
    camera: Camera

    def __post_init__(self) -> None:
        require(self.prior in PRIORS, "noise.prior", self.prior, f"give one of {', '.join(get_args(PriorName))}")
        check_prior_camera(self.camera)

    @property
    def exposure_ratio(self) -> Distribution:
        """Ratio of light that the prior is published with; 1 where it has none."""
        return PRIORS[self.prior].exposure_ratio

    def draw_setting(self, group: RandomStream, sample: RandomStream, exposure_time_s: float | None = None) -> NoiseSetting:
        """Draw the setting of one sample from the random stream `sample`; the others are not used."""
        name, stages = PRIORS[self.prior].stages(sample)
        return NoiseSetting(f"{self.prior}: {name}" if name else self.prior, 0, self.camera, in_order(stages))

    def list_cameras(self) -> tuple[Camera, ...]:
        """Return the cameras that clean pictures are made for."""
        return (self.camera,)

    def table(self) -> list[tuple[str, str]]:
        """Return the prior's name and what it has in place of ISOs, as text for a table on the screen."""
        return [(self.prior, "no ISO: K and noise are drawn")]

    def warnings(self) -> tuple[str, ...]:
        """Return nothing: a published prior has a pedestal above its noise."""
        return ()


def check_prior_camera(camera: Camera) -> None:
    """Raise PhotositeError for a camera of clean pictures whose colour filter is not a Bayer pattern."""
    rule = "data sets need a 2x2 colour filter; name another camera"
    require(camera.cfa in BAYER, "noise.camera.cfa", camera.cfa, rule)


def _draw_on_line(line: tuple[float, float, float], ln_gain: float, probability: float) -> float:
    """Draw a scale [DN] whose logarithm is normal about slope * ln K + intercept. line: slope, intercept, deviation."""
    slope, intercept, deviation = line
    middle = slope * ln_gain + intercept
    return math.exp(middle if deviation == 0.0 else draw(Normal((middle, deviation)), probability))


def _color_bias(camera: LineCamera, stream: RandomStream) -> tuple[float, float, float, float]:
    """Draw the offsets of the four photosites of a 2x2 block [DN]; 0 for a camera without colour bias.

    They share one uniform level; each adds a normal number whose standard deviation is drawn once for the sample.
    """
    if camera.color_bias is None:
        return 0.0, 0.0, 0.0, 0.0
    level, deviation, first, second, third, fourth = stream.uniforms("color bias", 6)
    deviation_dn = draw(Uniform(camera.color_bias_deviation), deviation)
    level_dn = draw(Uniform(camera.color_bias), level)

    def offset_dn(probability: float) -> float:
        return _round(level_dn + deviation_dn * draw(Normal((0.0, 1.0)), probability))

    return offset_dn(first), offset_dn(second), offset_dn(third), offset_dn(fourth)


def _round(value: float) -> float:
    """Round to nine significant digits; see distributions.draw."""
    return draw(value, 0.0)
