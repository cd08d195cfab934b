"""Measurement of one ISO setting: K, read noise, row noise, DSNU, PRNU and white level."""

from dataclasses import dataclass, replace

import numpy as np

from simulator.measurement.calibration.dark_measurement import (
    DarkMeasurement,
    dark_measurement_without_pedestal,
    measure_darks,
    measure_pairs,
    select_plane,
)
from simulator.measurement.calibration.frame_sorting import Frame, IsoFrames, middle
from simulator.measurement.statistics.interval import Interval, difference, quotient, root, shifted, weighted_mean
from simulator.measurement.statistics.photon_transfer import (
    TransferPoint,
    dark_noise,
    gain,
    gain_without_dark,
    line_without_dark,
    transfer_point,
)
from simulator.measurement.statistics.prnu import measure_prnu
from simulator.measurement.statistics.read_noise import ROUNDING_VARIANCE_DN2
from simulator.measurement.statistics.row_noise import row_noise
from simulator.measurement.statistics.temporal_noise import PairNoise, pair_noise
from simulator.raw.raw_reader import plane_places, read_raw_file


@dataclass(frozen=True)
class IsoMeasurement:
    """Results of one ISO; None where its frames do not allow the measurement.

    gain_dn_per_e: K of all planes together; gain_by_plane, and gain_p, the p-value that the planes share one K.
    dark: levels, noise and fixed pattern of dark frames. prnu: relative. clipped_dn: code at which flats clip.
    points: photon transfer by plane, each from pairs_used pairs of flats.
    """

    iso: int
    frames: IsoFrames
    gain_dn_per_e: Interval
    gain_by_plane: dict[str, Interval]
    gain_p: float
    dark: DarkMeasurement
    prnu: Interval | None
    clipped_dn: int | None
    points: dict[str, list[TransferPoint]]
    pairs_used: int

    @property
    def read_noise_e(self) -> Interval:
        """Read noise in electrons [e-]."""
        return quotient(self.dark.read_noise_dn, self.gain_dn_per_e)


def read_codes(frame: Frame) -> np.ndarray:
    """Read the central crop of a frame, which is measured: (height, width) uint16."""
    return middle(read_raw_file(frame.path).mosaic)


def measure_iso(frames: IsoFrames) -> IsoMeasurement:
    """Measure one ISO from two or more dark frames and one or more usable pairs of flats, two or more without pedestal.

    Reads the raw files. Raises PhotositeError for frames that cannot be measured.
    """
    darks = [read_codes(frame) for frame in frames.short_darks]
    places = plane_places(frames.short_darks[0].cfa)
    if frames.is_clipped_at_zero:
        levels = dict.fromkeys(places, frames.short_darks[0].black_level_dn)
        pairs = _measure_flat_pairs(frames, places, levels)
        points = _transfer_points(pairs)
        slopes = {name: gain_without_dark(of_plane) for name, of_plane in points.items()}
        dark = _estimate_dark_from_flats(pairs, places, levels)
    else:
        dark = measure_darks(darks, places)
        pairs = _measure_flat_pairs(frames, places, dark.levels_dn)
        points = _transfer_points(pairs)
        of_planes = {name: measure_pairs([select_plane(codes, name, places) for codes in darks]) for name in places}
        slopes = {name: gain(points[name], dark_noise(of_planes[name], row_noise=False)) for name in places}
    slope, p_value = weighted_mean(list(slopes.values()))
    flats = [frame for pair in frames.flat_pairs for frame in pair] + frames.lone_flats
    return IsoMeasurement(
        iso=frames.iso,
        frames=frames,
        gain_dn_per_e=slope,
        gain_by_plane=slopes,
        gain_p=p_value,
        dark=dark,
        prnu=_prnu(frames, places, darks),
        clipped_dn=max((frame.clipped_dn for frame in flats if frame.clipped_dn is not None), default=None),
        points=points,
        pairs_used=len(next(iter(points.values()))),
    )


def without_dark_current(one: IsoMeasurement, rate_e_per_s: Interval) -> IsoMeasurement:
    """Return an ISO whose black level and read noise are those of no exposure time: n dark electrons add K n and K^2 n.

    rate_e_per_s: dark current [e-/s]. Of a camera without pedestal both are free of it: the black level is that of the files,
    and the read noise comes from the line of the flats.
    """
    if one.frames.is_clipped_at_zero:
        return one
    gain, sigma = one.gain_dn_per_e.value, one.dark.read_noise_dn
    electrons = rate_e_per_s.scaled(one.frames.short_darks[0].time_s)
    variance = Interval(sigma.value**2, sigma.low**2, sigma.high**2)
    dark = replace(
        one.dark,
        black_level_dn=one.dark.black_level_dn - gain * electrons.value,
        read_noise_dn=root(difference(variance, electrons.scaled(gain**2))),
    )
    return replace(one, dark=dark)


def _measure_flat_pairs(
    frames: IsoFrames, places: dict[str, tuple[int, int]], levels_dn: dict[str, float]
) -> dict[str, list[PairNoise]]:
    """Temporal noise of the usable pairs of flats by plane, dark level subtracted, in ascending order of light.

    Both frames of a pair are first scaled to their common mean: with flickering light, the shading of the field would
    otherwise remain in their difference.
    """
    noise: dict[str, list[PairNoise]] = {name: [] for name in places}
    for pair in sorted(frames.usable_pairs, key=lambda pair: pair[0].mean_dn):
        codes = [read_codes(frame) for frame in pair]
        for name in places:
            planes = [select_plane(frame, name, places) - levels_dn[name] for frame in codes]
            means = [float(plane.mean()) for plane in planes]
            common = 0.5 * sum(means)
            alike = [plane * (common / mean) for plane, mean in zip(planes, means, strict=True)]
            noise[name].append(pair_noise(*alike))
    return noise


def _transfer_points(pairs: dict[str, list[PairNoise]]) -> dict[str, list[TransferPoint]]:
    return {name: [transfer_point(pair, 0.0, row_noise=False) for pair in of_plane] for name, of_plane in pairs.items()}


def _estimate_dark_from_flats(
    pairs: dict[str, list[PairNoise]], places: dict[str, tuple[int, int]], levels_dn: dict[str, float]
) -> DarkMeasurement:
    """Dark noise of a camera without pedestal: the read noise is the intercept of the photon transfer line.

    Row noise is that of the darkest pair, in the red and the blue plane, which have no row in common.
    """
    _, offset = line_without_dark([point for of_plane in _transfer_points(pairs).values() for point in of_plane])
    rows = row_noise([of_plane[0] for name, of_plane in pairs.items() if name in ("R", "B", "MONO")])
    sigma = root(shifted(offset, -ROUNDING_VARIANCE_DN2))
    return dark_measurement_without_pedestal(next(iter(levels_dn.values())), places, sigma, rows)


def _prnu(frames: IsoFrames, places: dict[str, tuple[int, int]], darks: list[np.ndarray]) -> Interval | None:
    """PRNU from the brightest pair that does not clip; one half of the dark frames is subtracted from each of its frames."""
    good = [pair for pair in frames.flat_pairs if not any(frame.clips for frame in pair)]
    if not good:
        return None
    sides = []
    brightest = max(good, key=lambda pair: pair[0].mean_dn)
    for half, frame in enumerate(brightest):
        signal = read_codes(frame) - np.mean(darks[half::2], axis=0)
        sides.append([select_plane(signal, name, places) for name in places])
    return measure_prnu(*sides)
