"""Lines of noise on gain that were published for cameras: data_gen/recipe/published_priors.py says where each stands."""

from dataclasses import dataclass

LN_0_1, LN_30 = -2.302585092994046, 3.4011973816621555


@dataclass(frozen=True)
class LineCamera:
    """Noise of a camera as straight lines of ln scale [DN] on ln K [DN/e-].

    ln_gain: range of ln K. read_scale, row: slope, intercept, deviation of ln scale about the line; no row noise where row is
    None. read_scale is that of a Tukey-lambda distribution, which is not its standard deviation, unless read_is_sigma.
    lambdas: shapes, one for each ISO it was measured at; normal read noise where there is none.
    color_bias: range of the offset that all colours share [DN]; color_bias_deviation: range of the deviation of each about it.
    """

    name: str
    ln_gain: tuple[float, float]
    read_scale: tuple[float, float, float]
    row: tuple[float, float, float] | None
    lambdas: tuple[float, ...]
    color_bias: tuple[float, float] | None = None
    color_bias_deviation: tuple[float, float] = (0.0, 0.0)
    read_is_sigma: bool = False


def _seventieths(*numerators: int) -> tuple[float, ...]:
    """ELD's shapes lie on a grid of 1/70."""
    return tuple(numerator / 70.0 for numerator in numerators)


# Vandermode/ELD@53d5408, camera_params/release/*_params.npy, Profile-1: G_scale, R_scale, G_shape. K is drawn from 0.1 to 30
# for all cameras: the line with each one's own range is commented out there. Its colour biases do not say the order of their
# four values and are left out.
ELD = (
    LineCamera(
        "Canon EOS 5D Mark IV",
        (LN_0_1, LN_30),
        (0.6558756156508007, 1.09268679594838, 0.28604721742277756),
        (0.4712797750747537, -0.8078958947116487, 0.2436176299944695),
        _seventieths(11, 10, 6, 6, 14, 14, 7, 6, 4, 5, 2, 2, 1, 2, 6, 5, 8, 8),
    ),
    LineCamera(
        "Canon EOS 70D",
        (LN_0_1, LN_30),
        (0.4868061424083776, 1.4642678570994598, 0.3820056048326114),
        (0.7292220505388829, -0.9370565150367796, 0.2502155842967251),
        _seventieths(10, 10, 8, 8, 2, 2, -7, -6, -12, -12, -11, -11, -6, -6, -2, -2),
    ),
    LineCamera(
        "Canon EOS 700D",
        (LN_0_1, LN_30),
        (0.5982361749821256, 1.5370438794284738, 0.3888189465002228),
        (0.6220587550621577, -0.7756471105987757, 0.24848083434051538),
        _seventieths(9, 9, 7, 7, 1, 1, -6, -7, -10, -11, -9, -9, -2, -2, 1, 1),
    ),
    LineCamera(
        "Nikon D850",
        (LN_0_1, LN_30),
        (0.4773896839219417, -0.09044499670414502, 0.23920060971003035),
        (0.44829219631519307, -1.7977103277112132, 0.2321799439489326),
        _seventieths(-8, -8, -14, -14, -15, -15, -16, -16, -17, -17, -12, -12, -10, -10, -7, -7),
    ),
    LineCamera(
        "Sony A7S II",
        (LN_0_1, LN_30),
        (0.46210495986526035, 0.5657147358616816, 0.2633712220097871),
        (0.5275360468633209, -0.5917002648887661, 0.29428813016491145),
        _seventieths(8, 9, 4, 3, 0, 0, -3, -4, -6, -6, -6, -6, -8, -8, -10, -9, -10, -10),
    ),
)

# megvii-research/PMN@d207d3e, data_process/process.py, SonyA7S2_lowISO and SonyA7S2_highISO: low and high conversion gain.
PMN = (
    LineCamera(
        "Sony A7S II, low gain",
        (-1.67214, 0.42228),
        (0.74043, 0.86182, 0.00712),
        (0.78782, -0.34227, 0.02832),
        (-0.026,),
    ),
    LineCamera(
        "Sony A7S II, high gain",
        (0.64567, 2.51606),
        (0.74901, -0.12348, 0.00638),
        (0.62945, -1.51040, 0.02609),
        (-0.025,),
    ),
)

# Srameo/LED@ee3d372, options/base/noise_g/noise_g_virtual.yaml: ranges over five virtual cameras, which stand at the ends and
# quarters of every range at once ("coverage", not shuffled). noise_generator.py: the deviation of a camera's colour biases
# comes from one of 16 parts of the range 0.0068666 to 3.0379589, each overlapping the next by a tenth, laid from 0 on.
_LED = {
    "slope": (0.46210495986526035, 0.6558756156508007),
    "intercept": (-0.09044499670414502, 1.5370438794284738),
    "deviation": (0.23920060971003035, 0.3888189465002228),
    "lambda": (-0.24285714285714288, 0.2),
    "row slope": (0.44829219631519307, 0.7292220505388829),
    "row intercept": (-1.7977103277112132, -0.5917002648887661),
    "row deviation": (0.2321799439489326, 0.29428813016491145),
}
_LED_COLOR_BIAS = (-1.9080039, 4.080531)
_LED_PART = (3.0379589 - 0.006866596) / (16 * 0.9 + 0.1)


def _virtual(number: int) -> LineCamera:
    at = {name: low + (high - low) * number / 4.0 for name, (low, high) in _LED.items()}
    return LineCamera(
        f"virtual camera {number}",
        (LN_0_1, LN_30),
        (at["slope"], at["intercept"], at["deviation"]),
        (at["row slope"], at["row intercept"], at["row deviation"]),
        (at["lambda"],),
        _LED_COLOR_BIAS,
        (0.9 * _LED_PART * number, 0.9 * _LED_PART * number + _LED_PART),
    )


LED = tuple(_virtual(number) for number in range(5))
