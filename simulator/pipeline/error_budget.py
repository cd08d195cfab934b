"""The error budget of a plan: what all approximations of its light add up to, against the tolerance that was asked for."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.optics.blur_planning import ignored_terms
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.mixed_edges import SMALL_PX, crossed_share, read_whole_pixels
from simulator.optics.defocus.predicted_error import (
    RAYS,
    error_terms,
    ray_terms,
    small_circles,
    terms_by_distance,
)
from simulator.optics.defocus.scene_light import mixed_edges_error, scene_detail
from simulator.optics.error_term import WINGS, ErrorTerm, Limit, together
from simulator.optics.geometry.leaning_photosites import lean_error, upright_parts
from simulator.optics.geometry.motion_errors import MOTION, motion_errors
from simulator.optics.geometry.rows_between import PHASES
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.veiling_glare import glare_errors
from simulator.scene.content_keys import freeze

ROUNDING = 1.001  # of a prediction that was chosen to be the tolerance
REFERENCE_SIGMA = 0.05  # what 99.9 % of the photosites keep on the reference path: 3.3 standard errors of its rays
DISTORTION, ILLUMINATION = "distortion", "relative illumination"  # effects of their terms
TIGHTER, UNKNOWN = "give a smaller tolerance", "it is gone without lens.diffraction and lens.aberrations"
SMALLEST_SIGMA = 1e-4  # prediction below which a term is not worth a line


@dataclass(frozen=True)
class ErrorBudget:
    """Predicted errors of a plan's light.

    tolerance: allowed error of what the methods approximate [standard deviations of the noise]; 0: the reference path.
    terms: of all approximations, in the order of the light.
    """

    tolerance: float
    terms: tuple[ErrorTerm, ...]

    def sigma(self, limit: Limit) -> float:
        """Return what all terms that are limited so leave together [standard deviations of the noise]."""
        return _left_by([term for term in self.terms if term.limit == limit])

    @property
    def predicted_sigma(self) -> float:
        """Error that the methods leave, by their laws: the bound that holds [standard deviations of the noise]."""
        return self.sigma("method")

    @property
    def total_sigma(self) -> float:
        """Error of the light with what the scene does not hold, whose sign is independent of what the methods leave."""
        return math.hypot(self.predicted_sigma, self.sigma("input"))

    @property
    def is_clamped(self) -> bool:
        """Whether no method meets the tolerance, or REFERENCE_SIGMA without one: the larger bound `predicted_sigma` holds."""
        return self.predicted_sigma > ROUNDING * (self.tolerance or REFERENCE_SIGMA)

    @property
    def binding(self) -> ErrorTerm | None:
        """The largest term of a method; None: nothing is approximated."""
        own = [term for term in self.terms if term.limit == "method"]
        return max(own, key=lambda term: term.sigma, default=None)

    def sigma_of(self, *effects: str) -> float:
        """Return what the methods of these effects leave together [standard deviations of the noise]."""
        return _left_by([term for term in self.terms if term.limit == "method" and term.effect in effects])

    def warnings(self) -> list[str]:
        """Return a sentence for each promise that is not kept: key, value, cause and fix."""
        found, binding = [], self.binding
        if self.is_clamped and binding is not None:
            found.append(
                f"tolerance = {self.tolerance:g} is not met: the {binding.effect} may be wrong by {self.predicted_sigma:.3g} "
                f"sigma, {binding.sigma:.2g} of it by {binding.cause}; {binding.fix}"
            )
        hidden = [term for term in self.terms if term.limit == "input" and term.sigma > self.tolerance]
        found += [f"{term.effect}: up to {term.sigma:.2g} sigma by {term.cause}; {term.fix}" for term in hidden]
        return found

    def describe(self) -> dict[str, object]:
        """Return the budget as plain data, for the JSON file."""
        return {
            "tolerance_sigma": self.tolerance,
            "predicted_sigma": self.predicted_sigma,
            "input_sigma": self.sigma("input"),
            "clamped": self.is_clamped,
            "terms": [
                {"effect": one.effect, "cause": one.cause, "sigma": one.sigma, "limited_by": one.limit, "fix": one.fix}
                for one in self.terms
            ],
        }


def _left_by(terms: list[ErrorTerm]) -> float:
    """Return what terms leave `together`. Wings of diffraction err far from where the others do: squares add."""
    wings, others = (together(term.sigma for term in terms if (term.effect == WINGS) is is_wing) for is_wing in (True, False))
    return math.hypot(others, wings)


def error_budget(optics: OpticsPlan) -> ErrorBudget:
    """Return the predicted errors of all approximations of a plan's light, in the order of the light."""
    accuracy, contrast, sigma = optics.accuracy, optics.contrast, optics.accuracy.sigma
    terms: list[ErrorTerm] = []
    blur = optics.moving_blur
    if blur is None:
        terms += ignored_terms(optics)
    elif accuracy.tolerance == 0.0 and (optics.moves_pixels or optics.projection.is_bilinear or not _rays_meet_pixels(optics)):
        terms += ray_terms(blur, contrast, is_smooth=not optics.projection.is_fine)
    elif optics.psf is None or not optics.psf.by_distance:
        terms += error_terms(blur, contrast, reads_pixels=optics.reads_pixels, is_aside=_reads_aside(optics))
    else:
        terms += terms_by_distance(blur, contrast, has_coverage=optics.has_coverage and not optics.layer_rays)
    terms += _rows_between(optics)
    smallest_px = None if optics.defocus is None else min(least for least, _ in optics.defocus.of_scene().ranges_px)
    if optics.psf is not None or (optics.psf_skipped is not None and optics.psf_skipped.sigma):
        from simulator.optics.psf.psf_errors import psf_errors  # not needed without kernels

        terms += psf_errors(
            optics.psf,
            optics.psf_skipped,
            accuracy,
            smallest_px,
            contrast.curvature,
            optics.sampling_error,
            optics.lamp_error,
            left_out=optics.focus_error,
            spots_error=optics.spots_error,
            spread_error=optics.spread_error,
            far_error=optics.far_error,
            is_fine=optics.projection.is_fine,
        )
    if optics.wings_error:
        cause, fix = "light from beyond the kernels, which is left out", TIGHTER
        if optics.wings is not None:
            cause, fix = (
                "light from beyond the kernels, as even rings",
                "it is gone without lens.diffraction and lens.aberrations",
            )
        terms.append(ErrorTerm(WINGS, cause, optics.wings_error, fix, falls=optics.wings is None))
    moving = [motion_errors(motion, None, sigma) for motion in (optics.motion, optics.flash_motion)]
    moving.append(motion_errors(None, optics.motion_skipped, sigma))
    terms += max(moving, key=lambda found: together(term.sigma for term in found))
    terms += _mixed_edges(optics)
    terms += _leaning(optics, smallest_px or 0.0)
    paths_px = [motion.length.longest_px for motion in (optics.motion, optics.flash_motion) if motion is not None]
    blur_px = optics.ignored_px if optics.defocus is None else optics.defocus.largest_px
    terms += glare_errors(
        optics.veiling_glare, accuracy, optics.sensor_px, sum([blur_px, *paths_px]), optics.projection.stretch
    )
    if optics.illumination_error:
        share = accuracy.in_sigma(optics.illumination_error)
        terms.append(ErrorTerm(ILLUMINATION, "a table of the pupil that rims clip", share, "give a round aperture"))
    return ErrorBudget(optics.tolerance, tuple(term for term in terms if term.sigma > SMALLEST_SIGMA))


def _rows_between(optics: OpticsPlan) -> list[ErrorTerm]:
    """Term of points of aperture and time that read the nearest row."""
    if not optics.reads_rows:
        return []
    from simulator.optics.defocus.joint_errors import TIGHTER, sampled_detail  # not needed at rest

    share = sampled_detail(optics.contrast, has_edges=True) * optics.rows_error
    left = optics.accuracy.in_sigma(share)
    return [ErrorTerm(MOTION, f"reads at the nearest of {PHASES} places between rows", left, TIGHTER)]


def _rays_meet_pixels(optics: OpticsPlan) -> bool:
    """Whether samples that rays meet divide the pixels of the scene, so that each of them lies in one."""
    return bool(optics.projection.whole_pixels(range(1, optics.accuracy.ray_samples + 1)))


def _leaning(optics: OpticsPlan, radius_px: float) -> list[ErrorTerm]:
    """Term of photosites that lean behind a distortion, of which even squares are averaged exactly where nothing blurs them.

    radius_px: of the smallest blur circle [photosites].
    """
    scene, projection, accuracy = optics.scene, optics.projection, optics.accuracy
    if projection.warp is None or (projection.has_squares and optics.defocus is None and optics.psf is None):
        return []
    parts = upright_parts(projection)
    if accuracy.tolerance == 0.0 and optics.defocus is not None:  # rays meet samples
        parts = max(parts, accuracy.ray_samples)
    settings = optics.weights, accuracy.electrons_per_radiance, accuracy
    key = "detail that leans", freeze(optics.weights), accuracy
    detail = accuracy.detail or scene.remember(key, lambda: scene_detail(scene, *settings))
    share = lean_error(projection, *optics.sensor_px, parts, radius_px, detail)
    cause = f"photosites that lean, in {parts} x {parts} upright parts"
    return [ErrorTerm(DISTORTION, cause, accuracy.in_sigma(share), "it is gone without lens.distortion")]


def _mixed_edges(optics: OpticsPlan) -> list[ErrorTerm]:
    """Term of layers that are composited photosite by photosite, or sample by sample, at each instant of a motion."""
    motion, scene, accuracy = optics.motion, optics.scene, optics.accuracy
    if motion is None or motion.method == "instants" or not scene.behind or not optics.has_coverage:
        return []
    if optics.varies_in_one_layer:
        return []
    cause = "edges of layers across what is behind them within a photosite"
    over = optics.light_samples
    if optics.samples_shifted_layers:
        if optics.mixes_points or not optics.layer_edges.are_seen:
            return [ErrorTerm(MOTION, cause, optics.layer_edges.sigma, RAYS)]
        return [ErrorTerm(MOTION, cause, optics.lacked_sigma(), RAYS)]
    if motion.method != "joint" and optics.composites_cells(over):
        if optics.mixes_edges(over) or not optics.layer_edges.are_seen:
            return [ErrorTerm(MOTION, cause, optics.layer_edges.sigma, RAYS)]
        return [ErrorTerm(MOTION, cause, optics.lacked_sigma(over), RAYS)]
    if motion.method == "joint" and optics.defocus is not None:
        ends = [abs(end) for pair in optics.defocus.of_scene().ranges_px for end in pair]
        if min(ends) > SMALL_PX:
            return [ErrorTerm(MOTION, cause, accuracy.in_sigma(_blurred_edges(optics)), RAYS)]
        over = max(int(optics.defocus.samples_per_axis(np.array([min(ends)]), np.array([max(ends)]))[0]), 1)
        if optics.tolerance == 0.0:  # rays meet one layer after the other
            if _rays_meet_pixels(optics):
                return []
            over = accuracy.ray_samples
    blur = optics.moving_blur
    if motion.method == "joint" and blur is not None and optics.tolerance and read_whole_pixels(optics.projection, over):
        return [ErrorTerm(MOTION, cause, _lacked_by_points(optics, blur, over), RAYS)]
    scale = optics.projection.scale / over
    key = "mixed edges", freeze(optics.weights), accuracy, scale
    settings = optics.weights, accuracy.electrons_per_radiance, accuracy, scale
    share = scene.remember(key, lambda: mixed_edges_error(scene, *settings))
    share *= crossed_share(motion.length.longest_px, over)
    return [ErrorTerm(MOTION, cause, accuracy.in_sigma(share), RAYS, is_rare=True)]


def _lacked_by_points(optics: OpticsPlan, blur: Defocus, over: int) -> float:
    """What points of aperture and time lack at edges of layers [standard deviations of the noise]."""
    from simulator.optics.defocus.point_edges import PointEdges  # few shots have such points

    if not optics.layer_edges.are_seen:
        return optics.layer_edges.sigma
    layers, weights = optics.scene.layers[: optics.covering_layers], optics.weights.T[np.array(optics.cfa.planes)]
    edges, accuracy = PointEdges(layers, weights, blur, optics.projection, optics.sensor_px, over), optics.accuracy
    places = optics.projection.scale, optics.projection.offset_x, optics.projection.offset_y, optics.sensor_px
    key = (
        "lacked by points",
        freeze(weights),
        accuracy.electrons_per_radiance,
        accuracy.read_noise_e,
        *places,
        over,
        edges.key(),
    )
    return optics.scene.remember(key, lambda: edges.lacked_sigma(accuracy))


def _reads_aside(optics: OpticsPlan) -> bool:
    """Whether photosites read the light between pixels at places that no path evens out."""
    paths = [motion.length.longest_px for motion in (optics.motion, optics.flash_motion) if motion is not None]
    is_short = min(paths) < 1.0 if paths else optics.projection.lies_between_pixels
    return optics.projection.warp is not None or is_short


def _blurred_edges(optics: OpticsPlan) -> float:
    """Error of points of aperture and time, which multiply means of layers out of focus, as a share of the brightest light.

    They read samples as points of the aperture alone do. The reference has rays that meet one layer after the other.
    """
    if optics.defocus is None or optics.tolerance == 0.0:
        return 0.0
    return (optics.contrast.within + optics.contrast.lamps_within) * small_circles(optics.defocus.of_scene())
