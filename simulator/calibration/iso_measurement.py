"""Everything the frames of one ISO tell."""

from dataclasses import dataclass

import numpy as np

from simulator.calibration.frames import Frame, IsoFrames, middle
from simulator.measurement.dark_pattern import DarkPattern, dark_pattern, levelled
from simulator.measurement.interval import Interval, normal_interval, quotient, weighted_mean
from simulator.measurement.light_pattern import light_pattern
from simulator.measurement.pairs import PairNoise, pair_noise
from simulator.measurement.photon_transfer import DarkNoise, TransferPoint, dark_noise, gain, transfer_point
from simulator.measurement.read_noise import read_noise, row_residuals
from simulator.measurement.row_noise import row_noise
from simulator.measurement.stacks import stack_of
from simulator.measurement.tukey_lambda import TukeyLambda, fit_tukey_lambda, rounding_doubt_dn2
from simulator.raw_file import plane_places, read_raw_file

LARGEST_SIGNAL_SHARE = 0.7  # of saturation, as in EMVA 1288; brighter pairs tell nothing of K
HIGH_SHARE = 1e-4  # of codes near white: defects; more is clipping
NORMAL_SHAPE = 0.14  # Tukey's lambda of a distribution close to normal
LARGEST_DOUBT = 0.01  # of the variance: noise smaller against a code has no shape that could be told
_KEPT_RESIDUALS = 200_000  # for the plot


@dataclass(frozen=True)
class IsoMeasurement:
    """Results of one ISO; None where the frames do not tell.

    gain_dn_per_e: K of all planes together; gain_by_plane, and gain_p, the p-value that the planes share one K.
    black_level_dn: mean of the planes in the dark; color_bias_dn: what each plane lies above it.
    read_noise_dn: a photosite's own, rounding and row noise off. shape: Tukey-lambda fit of it.
    pattern: fixed pattern of the dark. prnu: relative. clipped_dn: code at which flats clip.
    points, dark_points, residuals_dn: what was fitted, for plots. pairs_used: flat pairs behind K.
    """

    iso: int
    frames: IsoFrames
    gain_dn_per_e: Interval
    gain_by_plane: dict[str, Interval]
    gain_p: float
    black_level_dn: float
    color_bias_dn: dict[str, Interval]
    read_noise_dn: Interval
    shape: TukeyLambda | None
    row_noise_dn: Interval
    pattern: DarkPattern
    prnu: Interval | None
    clipped_dn: int | None
    points: dict[str, list[TransferPoint]]
    dark_points: dict[str, DarkNoise]
    residuals_dn: np.ndarray
    pairs_used: int

    @property
    def read_noise_e(self) -> Interval:
        """Read noise in electrons [e-]."""
        return quotient(self.read_noise_dn, self.gain_dn_per_e)


def codes_of(frame: Frame) -> np.ndarray:
    """Read the part of a frame that is measured: (height, width) uint16."""
    return middle(read_raw_file(frame.path).mosaic)


def is_usable(pair: tuple[Frame, Frame]) -> bool:
    """Whether a pair of flats may tell of K: bright enough to differ from the dark, and nowhere near clipping."""
    frame = max(pair, key=lambda frame: frame.mean_dn)
    range_dn = frame.white_level_dn - frame.black_level_dn
    return frame.high_share <= HIGH_SHARE and frame.mean_dn - frame.black_level_dn <= LARGEST_SIGNAL_SHARE * range_dn


def measure_iso(frames: IsoFrames) -> IsoMeasurement:
    """Measure one ISO from two or more dark frames and one or more usable pairs of flats.

    Reads the files. Raises PhotositeError for frames that cannot be measured.
    """
    darks = [codes_of(frame) for frame in frames.short_darks]
    places = plane_places(frames.short_darks[0].cfa)
    planes_dn = {name: [_plane(dark, place, places) for dark in darks] for name, place in places.items()}
    pairs = _pairs_of(darks)
    residuals = np.concatenate([row_residuals(a, b) for a, b in zip(darks[0::2], darks[1::2], strict=False)])
    shape = fit_tukey_lambda(residuals)
    doubt_dn2 = rounding_doubt_dn2(shape.shape.value, shape.sigma_dn.value)
    sigma = read_noise(pairs, doubt_dn2)
    rows = row_noise(pairs)
    levels = {name: float(np.mean([plane.mean(dtype=np.float64) for plane in planes])) for name, planes in planes_dn.items()}
    black_dn = float(np.mean(list(levels.values())))
    pattern = _pattern(darks, places, pairs)
    points, used = _transfer_points(frames, places, levels)
    dark_points = {name: dark_noise(_pairs_of(planes), row_noise=False) for name, planes in planes_dn.items()}
    slopes = {name: gain(points[name], dark_points[name]) for name in places}
    slope, p_value = weighted_mean(list(slopes.values()))
    doubtful = doubt_dn2 > LARGEST_DOUBT * sigma.value**2
    return IsoMeasurement(
        iso=frames.iso,
        frames=frames,
        gain_dn_per_e=slope,
        gain_by_plane=slopes,
        gain_p=p_value,
        black_level_dn=black_dn,
        color_bias_dn=_color_bias(levels, black_dn, pattern, sigma, rows, planes_dn),
        read_noise_dn=sigma,
        shape=None if doubtful else shape,
        row_noise_dn=rows,
        pattern=pattern,
        prnu=_prnu(frames, places, planes_dn),
        clipped_dn=_clipped(frames),
        points=points,
        dark_points=dark_points,
        residuals_dn=residuals[:: max(1, residuals.size // _KEPT_RESIDUALS)],
        pairs_used=used,
    )


def _plane(codes: np.ndarray, place: tuple[int, int], places: dict) -> np.ndarray:
    step = 1 if len(places) == 1 else 2
    return codes[place[0] :: step, place[1] :: step]


def _pairs_of(planes: list[np.ndarray]) -> list[PairNoise]:
    return [pair_noise(first, second) for first, second in zip(planes[0::2], planes[1::2], strict=False)]


def _pattern(darks: list[np.ndarray], places: dict, pairs: list[PairNoise]) -> DarkPattern:
    """Fixed pattern of the dark frames, whose temporal noise the pairs tell."""
    stack = stack_of(levelled(dark, list(places.values())) for dark in darks)
    pixel_dn2 = float(np.mean([pair.pixel_variance_dn2 for pair in pairs]))
    return dark_pattern(stack, pixel_dn2, float(np.mean([pair.row_variance_dn2 for pair in pairs])))


def _transfer_points(frames: IsoFrames, places: dict, levels: dict[str, float]) -> tuple[dict[str, list[TransferPoint]], int]:
    """Points of the photon transfer curve by plane, and the number of pairs that gave them.

    Both frames are brought to their common mean first: light that flickers would otherwise leave the shading of the field
    in their difference.
    """
    usable = [pair for pair in frames.flat_pairs if is_usable(pair)]
    points: dict[str, list[TransferPoint]] = {name: [] for name in places}
    for first, second in usable:
        codes = codes_of(first), codes_of(second)
        for name, place in places.items():
            planes = [_plane(frame, place, places) - levels[name] for frame in codes]
            means = [plane.mean() for plane in planes]
            common = 0.5 * sum(means)
            alike = pair_noise(*(plane * (common / mean) for plane, mean in zip(planes, means, strict=True)))
            points[name].append(transfer_point(alike, 0.0, row_noise=False))
    return points, len(usable)


def _color_bias(levels, black_dn, pattern, sigma, rows, planes_dn) -> dict[str, Interval]:
    """What each plane lies above the mean of all; the error is that of its own mean."""
    result = {}
    for name, planes in planes_dn.items():
        height, width = planes[0].shape
        photosites = (sigma.value**2 / len(planes) + pattern.photosite_dn.value**2) / (height * width)
        of_rows = (rows.value**2 / len(planes) + pattern.row_dn.value**2) / height
        of_columns = pattern.column_dn.value**2 / width
        result[name] = normal_interval(levels[name] - black_dn, float(np.sqrt(photosites + of_rows + of_columns)))
    return result


def _prnu(frames: IsoFrames, places: dict, planes_dn: dict[str, list[np.ndarray]]) -> Interval | None:
    """PRNU from the brightest pair that does not clip, each frame less the mean of its own half of the darks."""
    good = [pair for pair in frames.flat_pairs if max(frame.high_share for frame in pair) <= HIGH_SHARE]
    if not good:
        return None
    pair = max(good, key=lambda pair: pair[0].mean_dn)
    sides = []
    for half, frame in enumerate(pair):
        codes = codes_of(frame)
        dark = {name: np.mean([plane for plane in planes[half::2]], axis=0) for name, planes in planes_dn.items()}
        sides.append([_plane(codes, place, places) - dark[name] for name, place in places.items()])
    return light_pattern(*sides)


def _clipped(frames: IsoFrames) -> int | None:
    """Code at which the flats of this ISO clip, if any does."""
    flats = [frame for pair in frames.flat_pairs for frame in pair] + frames.lone_flats
    return max((frame.clipped_dn for frame in flats if frame.clipped_dn is not None), default=None)
