"""Noise of a camera by ISO, from its raw files: K, read noise, full scale, dynamic range and PDR."""

import math
from dataclasses import dataclass

from simulator.measurement.calibration.camera_measurement import Calibration, full_scale_e, range_stops
from simulator.measurement.calibration.iso_measurement import IsoMeasurement
from simulator.measurement.statistics.interval import Interval
from simulator.measurement.statistics.signal_to_noise import CIRCLES_PER_DIAGONAL, photographic_snr


@dataclass(frozen=True)
class NoiseOfIso:
    """Noise at one ISO, with 95 % intervals where they are known.

    gain_dn_per_e: K. read_noise_dn, read_noise_e: of single photosites, rounding and row noise taken off. row_noise_dn.
    prnu: relative, None without a pair of flats that does not clip. full_scale_e: from dark to white.
    range_ev: log2 of full scale over the signal with an SNR of 1. pdr_ev: the same for an SNR of 20 in the circle of confusion;
        None without a pixel pitch, nan where no signal has it.
    pairs: of flats, from which K was measured.
    """

    iso: int
    gain_dn_per_e: Interval
    read_noise_dn: Interval
    read_noise_e: Interval
    row_noise_dn: Interval
    prnu: Interval | None
    full_scale_e: float
    range_ev: float
    pdr_ev: float | None
    pairs: int


def noise_table(found: Calibration, pitch_um: float | None, circle_um: float | None) -> list[NoiseOfIso]:
    """Return the noise of every ISO that was measured.

    pitch_um, circle_um: distance of the photosites and circle of confusion on the sensor, both for the PDR; without a circle it
    is the diagonal of the frame / 1291 (Photons to Photos: 22 um on a Nikon D300). Raises PhotositeError for a circle of 0.
    """
    snr = None
    if pitch_um is not None:
        diagonal_um = pitch_um * math.hypot(*found.first_frame.size)
        snr = photographic_snr(pitch_um, diagonal_um / CIRCLES_PER_DIAGONAL if circle_um is None else circle_um)
    return [_row(one, found.white_levels_dn[one.iso], snr) for one in found.isos]


def _row(one: IsoMeasurement, white_level_dn: float, snr: float | None) -> NoiseOfIso:
    return NoiseOfIso(
        iso=one.iso,
        gain_dn_per_e=one.gain_dn_per_e,
        read_noise_dn=one.dark.read_noise_dn,
        read_noise_e=one.read_noise_e,
        row_noise_dn=one.dark.row_noise_dn,
        prnu=one.prnu,
        full_scale_e=full_scale_e(one, white_level_dn),
        range_ev=range_stops(one, white_level_dn),
        pdr_ev=None if snr is None else range_stops(one, white_level_dn, snr),
        pairs=one.pairs_used,
    )
