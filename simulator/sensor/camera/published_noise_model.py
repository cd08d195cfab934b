"""Published noise models of raw frames: a gain and a few parameters in DN, without a camera body."""

from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.color_bias import ColorBias
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.read_noise_after_gain import ReadNoiseAfterGain
from simulator.sensor.stages.row_noise import RowNoise
from simulator.sensor.stages.stage import Stage
from simulator.units import DigitalNumbers, DigitalNumbersPerElectron


def noise_model_stages(
    gain_dn_per_e: DigitalNumbersPerElectron,
    read_sigma_dn: DigitalNumbers,
    *,
    bit_depth: int,
    black_level_dn: DigitalNumbers,
    white_level_dn: DigitalNumbers | None = None,
    tukey_lambda: float | None = None,
    row_sigma_dn: DigitalNumbers = 0.0,
    color_bias_dn: tuple[DigitalNumbers, ...] = (0.0, 0.0, 0.0, 0.0),
) -> tuple[Stage, ...]:
    """Return the stages of K Poisson(mean electrons) + read noise + row noise + colour bias, rounded and clipped.

    The model of Wei et al. (2020, ELD, eq. 4 to 9); with a normal read noise, no row noise and no bias the Poisson-Gaussian
    one of Foi et al. (2008).
    gain_dn_per_e: K [DN/e-], > 0. read_sigma_dn: standard deviation of the read noise, whatever its shape [DN], >= 0.
    tukey_lambda: its Tukey-lambda shape, -0.3 to 0.25; none: normal. A published scale of that distribution times
        scipy.stats.tukeylambda.std(tukey_lambda) is the standard deviation.
    row_sigma_dn: standard deviation of the offset of a row [DN], >= 0.
    color_bias_dn: per-channel black offsets of the 2x2 block, row by row [DN].
    black_level_dn, white_level_dn: pedestal, and code that clips [DN]; none: 2^bit_depth - 1.
    Raises PhotositeError for parameters out of range.
    """
    stages: list[Stage] = [PhotonShotNoise(), AnalogGain(gain_dn_per_e), RowNoise(row_sigma_dn)]
    stages.append(ReadNoiseAfterGain(read_sigma_dn, tukey_lambda))
    if any(color_bias_dn):
        stages.append(ColorBias(tuple(color_bias_dn)))
    stages.append(Adc(bit_depth, black_level_dn, white_level_dn))
    return tuple(stage for stage in stages if stage.has_effect)
