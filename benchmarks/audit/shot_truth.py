"""The true light of a shot: in float64 where that knows it, else by the reference path, within processor time that is given."""

import math
import re
import time
import warnings
from dataclasses import dataclass, replace

import numpy as np

from audit.drawn_shots import saturation_electrons
from audit.float64_truth import Truth, channels_of, exact_means, is_simple, sum_rays
from audit.timed_rays import with_timed_rays
from simulator.device import Device
from simulator.errors import PhotositeError
from simulator.optics.error_term import WINGS
from simulator.optics.psf.psf_errors import FAR_CIRCLES
from simulator.optics.ray_reference.convergence import FEWEST_RAYS
from simulator.pipeline.execution import execute
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.progress import silent
from simulator.sensor.camera.cfa import Cfa

JUDGED = 0.2  # largest standard error of a truth that judges a shot, in the error that is allowed
TRUTH_SHARE = 0.15  # largest standard error of the truth, in the tolerance
LEAST_TRUTH_ERROR, MOST_TRUTH_ERROR = 0.006, 0.03  # [standard deviations of the noise]
STATED_SHARE = 0.01  # the same, in the error that the plan states where it cannot keep the tolerance
LEAST_RAYS_SHARE = 0.3  # of the error that is wanted, below which rays would be too many
MOST_RAYS = 524288  # of a photosite and replication
FEWEST_OF_IMAGE, MORE_RAYS = 16, 4  # rays of an image of several at first, and factor to the next number of rays
LONGER = 4.0  # times as much processor time for rays that do not judge a shot yet
MOST_INDEPENDENT = 16  # images of a moving frame whose errors count as independent
MOST_IMAGES = 96  # instants at which rays are followed: each image costs launches and uploads, whatever its rays
RAY_SAMPLES, SAMPLES_SHARE = (16, 32, 48), 0.6  # per photosite and axis, in place of a user's 8; see `true_electrons`
OF_BOUND = 3.3  # error that 99.9 % of the photosites keep, in standard errors
SUMMED_POINTS = 512, 2048, 8192  # rays of each set of a float64 sum, as many as are needed
SUMMED_S = 30.0  # processor time beyond which no more are begun [s]


class NoTruthError(Exception):
    """A shot that neither float64 nor the reference path knows."""


@dataclass(frozen=True)
class ShotTruth:
    """Mean electrons (height, width), and their largest standard error [standard deviations of each photosite's noise].

    kind: "float64", or "rays" of the reference path. reference_p99_9: of the rays against float64; None: not compared.
    """

    electrons: np.ndarray
    sigma: float
    kind: str
    reference_p99_9: float | None = None


def find_truth(
    shot: Shot, planned: Plan, stated: float, device: Device, seconds: float = math.inf, *, is_checked: bool = False
) -> ShotTruth:
    """Return the truth of a shot. Raises NoTruthError where neither float64 nor the reference path knows it.

    planned: of the shot, which gives the noise. stated: error that its plan states. seconds: processor time for the rays; where
    it does not suffice, the standard error is the one that was reached. is_checked: whether the reference path is followed
    where float64 knows the shot.
    """
    if shot.lens.veiling_glare and _has_even_veil(planned):
        return _veiled_truth(shot, planned, stated, device, seconds)
    wanted, limit = max(wanted_error(shot.tolerance), STATED_SHARE * stated), JUDGED * max(shot.tolerance, stated)
    summed, summed_sigma = None, math.inf
    if is_simple(shot, planned):
        summed, summed_sigma = summed_truth(shot, planned, wanted)
        if summed_sigma <= max(wanted, TRUTH_SHARE * shot.tolerance) and not is_checked:
            return ShotTruth(summed.electrons, summed_sigma, "float64")
    try:
        truth, truth_sigma = true_electrons(shot, device, wanted, seconds, limit, planned.optics.cfa)
    except PhotositeError as error:
        raise NoTruthError(error) from error
    if summed is None or summed_sigma > max(truth_sigma, TRUTH_SHARE * shot.tolerance):
        return ShotTruth(truth, truth_sigma, "rays")
    reference = float(np.quantile(np.abs(z_scores(truth, summed.electrons, planned)), 0.999))
    return ShotTruth(summed.electrons, summed_sigma, "float64", reference)


def summed_truth(shot: Shot, planned: Plan, wanted: float) -> tuple[Truth, float]:
    """Truth of a shot that `is_simple`, and its largest standard error.

    Sums stop at the error that is wanted, where the next one would not be judged if its error fell as it fell last, and where
    it would take too long.
    """
    exact, last = exact_means(shot, planned), math.nan
    if exact is not None:
        return exact, 0.0
    for points in SUMMED_POINTS:
        started_s = time.process_time()
        summed = sum_rays(shot, planned, points=points)
        cost_s, sigma = time.process_time() - started_s, largest_error(summed, planned)
        expected = sigma**2 / last
        is_vain = expected > max(wanted, TRUTH_SHARE * shot.tolerance)
        if sigma <= wanted or is_vain or cost_s * SUMMED_POINTS[1] / SUMMED_POINTS[0] > SUMMED_S:
            break
        last = sigma
    return summed, sigma


def _has_even_veil(planned: Plan) -> bool:
    """Whether all photosites have the same veil: all are taken, and are open at the same times."""
    optics = planned.optics
    is_whole = (optics.window.width, optics.window.height) == optics.sensor_px
    return is_whole and all(one is None or one.is_common for one in (optics.motion, optics.flash_motion))


def _veiled_truth(shot: Shot, planned: Plan, stated: float, device: Device, seconds: float) -> ShotTruth:
    """Truth of a shot behind veiling glare, by its definition: of all photosites' light without it in each colour.

    The light of each colour is the truth of the shot without glare on photosites that all have this colour. Errors of their
    mean are those of the photosites, as if all had the same sign. Other parameters: as of `find_truth`.
    """
    optics, share = planned.optics, shot.lens.veiling_glare
    bare = replace(shot, lens=replace(shot.lens, veiling_glare=0.0))
    images, sigmas = [], []
    for channel in range(optics.channels):
        own = replace(planned, optics=replace(optics, cfa=Cfa.uniform(channel)))
        found = find_truth(bare, own, stated, device, seconds)
        images.append(found.electrons)
        sigmas.append(found.sigma)
    veil_e = share * np.array([image.mean() for image in images])
    veil_error_e = share * max(
        sigma * noise_electrons(image, planned).mean() for image, sigma in zip(images, sigmas, strict=True)
    )
    channels = channels_of(planned)
    electrons = (1.0 - share) * np.take_along_axis(np.stack(images), channels[None], axis=0)[0] + veil_e[channels]
    sigma = (1.0 - share) * max(sigmas) + veil_error_e / float(noise_electrons(electrons, planned).min())
    return ShotTruth(electrons, sigma, found.kind)


def wanted_error(tolerance: float) -> float:
    """Standard error of a truth at which it suffices [standard deviations of the noise]."""
    return min(max(TRUTH_SHARE * tolerance, LEAST_TRUTH_ERROR), MOST_TRUTH_ERROR)


def true_electrons(
    shot: Shot,
    device: Device,
    wanted: float,
    seconds: float = math.inf,
    limit: float = math.inf,
    cfa: Cfa | None = None,
) -> tuple[np.ndarray, float]:
    """Mean electrons by the reference path, and the largest standard error of its photosites [standard deviations].

    wanted: error at which rays suffice, or less where with what the reference states it would exceed `limit`. Where it states
    more than SAMPLES_SHARE of `limit`, rays meet finer samples of the scene than a user's, as far as these lower it. The shot
    is taken with more and more rays, each time anew, until it has that error or MOST_RAYS, or until the next number is expected
    to need more processor time than `seconds` in all, or LONGER of it while the error exceeds `limit`. Rays carry instants
    where they can; else the error that fewer instants leave counts as well, and so does what the plan of the reference path
    states. Neither depends on the rays, so that their squares add. cfa: colours of the photosites; None: those of the camera.
    """
    reference = replace(shot, tolerance=0.0)
    whole = plan(reference)
    if cfa is not None:
        whole = replace(whole, optics=replace(whole.optics, cfa=cfa))
    whole = with_finer_samples(with_timed_rays(whole, shot), limit)
    planned, of_instants = _with_fewer_instants(whole, 0.5 * OF_BOUND * wanted)
    stated = math.hypot(_stated(whole), of_instants) / OF_BOUND
    wanted = rays_error(wanted, stated, limit)
    count, images = _images(planned), _independent_images(planned)
    rays, most = (max(number // count, FEWEST_OF_IMAGE) for number in (FEWEST_RAYS, MOST_RAYS))
    spent_s = 0.0
    while True:
        started_s = time.process_time()
        found, left, worst = _follow_rays(planned, reference, device, wanted * math.sqrt(images), rays)
        cost_s = time.process_time() - started_s
        if planned.optics.defocus is None:
            return found, stated
        sigma, spent_s = math.hypot(stated, max(wanted, worst / math.sqrt(images))), spent_s + cost_s
        more = min(MORE_RAYS * rays, most)
        expected_s = cost_s * (1.0 + left * (more / rays - 1.0))
        allowed_s = seconds if sigma <= limit else LONGER * seconds
        if sigma <= math.hypot(stated, wanted) or more == rays or spent_s + expected_s > allowed_s:
            return found, sigma
        rays = more


def with_finer_samples(planned: Plan, limit: float) -> Plan:
    """Return a plan of the reference whose rays meet the fewest of RAY_SAMPLES that leave SAMPLES_SHARE of a standard error.

    Samples of a photosite mix pixels of the scene that they do not divide. The plan itself where finer ones leave as much.
    """
    found = planned
    for samples in RAY_SAMPLES:
        if _stated(found) <= OF_BOUND * SAMPLES_SHARE * limit:
            break
        finer = _with_accuracy(planned, ray_samples=samples)
        if _stated(finer) < _stated(found):
            found = finer
    return found


def _stated(planned: Plan) -> float:
    """Error that a reference states [standard deviations], but for wings and far circles, which shots have as it has."""
    budget = planned.error_budget
    own = tuple(term for term in budget.terms if term.effect != WINGS and term.cause != FAR_CIRCLES)
    return replace(budget, terms=own).predicted_sigma


def _with_accuracy(planned: Plan, **settings: float) -> Plan:
    """Return a plan with other settings of its accuracy."""
    optics = planned.optics
    accuracy, defocus = replace(optics.accuracy, **settings), optics.defocus
    if defocus is not None:
        defocus = replace(defocus, accuracy=replace(defocus.accuracy, **settings))
    return replace(planned, optics=replace(optics, accuracy=accuracy, defocus=defocus))


def rays_error(wanted: float, stated: float, limit: float) -> float:
    """Standard error that is asked of rays: with what the reference states a little below a limit, if that is possible."""
    left = (0.98 * limit) ** 2 - stated**2
    return min(wanted, math.sqrt(left)) if left > (LEAST_RAYS_SHARE * wanted) ** 2 else wanted


def _follow_rays(planned: Plan, reference: Shot, device: Device, allowed: float, rays: int) -> tuple[np.ndarray, float, float]:
    """Return mean electrons with so many rays, the share of photosites beyond an allowed error, and the largest error.

    Of an image; where no more than a thousandth of the photosites is beyond, the error is 0.
    """
    limited = _with_accuracy(planned, ray_error=allowed, rays=rays)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        found = run(measure(limited, device), reference, device)
    left = [_left_error(one.message) for one in caught]
    return found, max([0.0, *(share for share, _ in left)]), max([0.0, *(error for _, error in left)])


def run(planned: Plan, shot: Shot, device: Device, timed: Stopwatch | None = None) -> np.ndarray:
    """Mean electrons of a plan's frame (height, width) float64."""
    return execute(planned, shot, device, silent, timed or Stopwatch()).mean_electrons.astype(np.float64)


def _images(planned: Plan) -> int:
    """Instants at which rays are followed; 1 where rays carry instants or nothing moves."""
    motion = planned.optics.motion
    if motion is None or motion.method != "instants":
        return 1
    return max(motion.count if motion.is_common else len(motion.shared_nodes()), 1)


def _with_fewer_instants(planned: Plan, allowed: float) -> tuple[Plan, float]:
    """Return a plan with as few instants as an error [standard deviations] needs, at most MOST_IMAGES, and their error.

    The error of instants falls at most as the square of their number. 0 of as many as are planned, which the plan states.
    """
    motion, count = planned.optics.motion, _images(planned)
    if motion is None or count == 1:
        return planned, 0.0
    own = planned.optics.accuracy.in_sigma(motion.error)
    needed = count * min(math.sqrt(own / max(allowed, 1e-9)), 1.0)
    kept = min(max(needed, FEWEST_OF_IMAGE), MOST_IMAGES)
    if kept >= count:
        return planned, 0.0
    fewer = replace(motion, count=max(int(motion.count * kept / count), 1))
    return replace(planned, optics=replace(planned.optics, motion=fewer)), own * (motion.count / fewer.count) ** 2


def _independent_images(planned: Plan) -> int:
    """Images whose errors differ: the rays of all are the same, so that the image has to move by half a photosite."""
    motion, count = planned.optics.motion, _images(planned)
    if motion is None or count == 1:
        return 1
    return max(min(count, round(2.0 * motion.length.longest_px), MOST_INDEPENDENT), 1)


def _left_error(message: object) -> tuple[float, float]:
    """Share of photosites of which a warning of the reference path tells, and their largest standard error.

    Both 0 of another warning, and of one of no more than a thousandth of the photosites.
    """
    found = re.match(r"(\d+) of (\d+) photosites have an estimated error .* at most ([\d.e+-]+) sigma", str(message))
    if found is None or 1000 * int(found[1]) <= int(found[2]):
        return 0.0, 0.0
    return int(found[1]) / int(found[2]), float(found[3])


def z_scores(found: np.ndarray, truth: np.ndarray, planned: Plan) -> np.ndarray:
    """Deviations in standard deviations of each photosite's own temporal noise; light above the white level is white.

    The noise is that of photons and read-out at the shot's ISO; below 1 e- it counts as 1 e-.
    """
    white_e = saturation_electrons(planned.sensor)
    return (np.minimum(found, white_e) - np.minimum(truth, white_e)) / noise_electrons(truth, planned)


def noise_electrons(electrons: np.ndarray, planned: Plan) -> np.ndarray:
    """Standard deviation of photosites with these mean electrons [e-], at least 1."""
    sensor = planned.sensor
    dark_e2 = sensor.moments(0.0).variance / sensor.gain_dn_per_e() ** 2
    return np.sqrt(np.maximum(electrons + dark_e2, 1.0))


def largest_error(summed: Truth, planned: Plan) -> float:
    """Standard error that 99.9 % of the photosites keep [standard deviations of the noise]."""
    return float(np.quantile(summed.error / noise_electrons(summed.electrons, planned), 0.999))
