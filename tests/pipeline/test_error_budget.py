"""The error budget: terms of all approximations, what a method leaves apart from what the scene does not hold."""

import dataclasses
import json

import numpy as np
import pytest
from audit.drawn_shots import draw_shot
from helpers.camera_builders import small_camera
from helpers.lens_frame import LENS, depth_of
from helpers.scene_builders import band_scene

from simulator.config import load_shot
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.error_term import ErrorTerm
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.error_budget import ErrorBudget
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot

TERMS = (
    ErrorTerm("lens blur", "points", 0.04, "more points"),
    ErrorTerm("motion blur", "instants", 0.05, "more instants"),
    ErrorTerm("lens blur", "background", 3.0, "layers", "input"),
    ErrorTerm("lens blur", "slopes", 0.03, "smaller steps"),
)
LEFT = 0.05 + np.hypot(0.04, 0.03)


def test_the_largest_term_counts_whole_and_squares_of_the_others_add():
    budget = ErrorBudget(0.11, TERMS)
    assert budget.predicted_sigma == pytest.approx(LEFT) and budget.sigma("input") == 3.0
    assert budget.total_sigma == pytest.approx(np.hypot(LEFT, 3.0))  # signs of what is hidden are independent of the methods'
    assert budget.sigma_of("lens blur") == pytest.approx(0.07) and ErrorBudget(0.1, ()).predicted_sigma == 0.0
    assert not budget.is_clamped and budget.binding == TERMS[1]
    (hidden,) = budget.warnings()
    assert hidden == "lens blur: up to 3 sigma by background; layers"


def test_a_tolerance_that_is_not_met_is_told_with_cause_and_fix():
    budget = ErrorBudget(0.08, TERMS[:2])
    assert budget.is_clamped
    (warning,) = budget.warnings()
    assert (
        warning
        == "tolerance = 0.08 is not met: the motion blur may be wrong by 0.09 sigma, 0.05 of it by instants; more instants"
    )
    (near,) = ErrorBudget(0.1, (TERMS[0], ErrorTerm("motion blur", "instants", 0.064, "more instants"))).warnings()
    assert "may be wrong by 0.104 sigma" in near  # not by 0.1
    assert not ErrorBudget(0.0, TERMS[:1]).is_clamped and ErrorBudget(0.0, TERMS[:2]).is_clamped  # the reference path


def test_it_is_plain_data():
    told = json.loads(json.dumps(ErrorBudget(0.08, TERMS).describe()))
    assert told["clamped"] and told["predicted_sigma"] == pytest.approx(LEFT) and told["input_sigma"] == 3.0
    assert [one["limited_by"] for one in told["terms"]] == ["method", "method", "input", "method"]


def test_each_effect_has_its_terms():
    """A blurred picture that moves, and one whose motion is left out with its error."""
    planes = np.random.default_rng(1).random((48, 60))  # coarser than the photosites, of which pixels are weighed exactly
    shot = Shot(band_scene(planes, 3.0), LENS, Exposure(0.001), small_camera(80, 64))
    still = plan(shot).error_budget
    assert {term.effect for term in still.terms} == {"lens blur"} and still.predicted_sigma > 0.0
    moving = dataclasses.replace(shot, motion=Motion(camera=SteadyMotion(pan_deg_per_s=100.0)))
    assert {term.effect for term in plan(moving).error_budget.terms} == {"lens blur", "motion blur"}
    slow = dataclasses.replace(shot, motion=Motion(camera=SteadyMotion(pan_deg_per_s=1e-3)))
    (left_out,) = (term for term in plan(slow).error_budget.terms if term.effect == "motion blur")
    assert "nothing moves far" in left_out.cause and 0.0 < left_out.sigma < 0.1


def test_a_straight_way_leaves_nothing_of_instants():
    """Weights of its pixels are exact; those of a camera that rolls are of instants."""
    planes = np.random.default_rng(1).random((48, 60))
    shot = Shot(band_scene(planes), LENS, Exposure(0.001), small_camera(60, 48))
    straight = Motion(layers={0: LayerMotion((Speed(2300.0, "px/s"), Speed(700.0, "px/s")))})
    turned = Motion(camera=SteadyMotion(roll_deg_per_s=2000.0))
    left = [
        plan(dataclasses.replace(shot, motion=motion)).error_budget.sigma_of("motion blur") for motion in (straight, turned)
    ]
    assert left[0] < 1e-3 < 0.01 < left[1]


def terms_of(
    planes: np.ndarray, radius_px: float, side: int = 48, tolerance: float = 0.1, **lens: object
) -> dict[str, ErrorTerm]:
    """Terms of a picture at a distance of this blur radius, by effect."""
    scene = band_scene(planes, depth_of(radius_px))
    shot = Shot(scene, dataclasses.replace(LENS, **lens), Exposure(0.001), small_camera(side, side), tolerance=tolerance)
    return {term.effect: term for term in plan(shot).error_budget.terms}


def test_blur_that_is_left_out_counts_by_the_light_and_by_its_own_noise():
    """A gradient has less of it than noise, and a faint texture beside bright light more than as a share of that."""
    noise = np.random.default_rng(1).random((36, 36))
    gradient = np.linspace(0.5, 1.0, 36)[None].repeat(36, 0)
    faint = np.where(np.arange(36) < 18, 0.02 * noise, 1.0)
    smooth, rough, dark = (terms_of(planes, 0.1).get("lens blur") for planes in (gradient, noise, faint))
    assert smooth is None or smooth.sigma < 0.01 * rough.sigma
    assert dark.sigma > 0.02 * rough.sigma
    assert "lens blur" not in terms_of(np.random.default_rng(1).random((48, 48)), 0.1)  # inside one pixel


def test_a_circle_that_lamps_show_is_left_out_only_where_the_scene_does_not_tell_their_place():
    """In a scene as fine as the photosites it is a limit of the input."""
    lamp = np.full((96, 96), 0.5)
    assert "lens blur" not in terms_of(lamp, 0.02)
    lamp[40, 40] = 1e5
    assert "lens blur" not in terms_of(lamp, 0.02)  # its spot is exact
    unknown = terms_of(lamp, 0.02, 96)["lens blur"]
    assert unknown.sigma > 1.0 and unknown.limit == "input" and "pixels" in unknown.fix


def test_samples_that_mix_pixels_behind_a_filter_and_diffraction_have_a_term():
    """2.75 pixels per photosite in 3 samples; where they divide the pixels there is none, nor behind a filter alone."""
    camera = dataclasses.replace(small_camera(48, 48), low_pass_um=4.0)
    diffracting = dataclasses.replace(LENS, diffraction=True)

    def found(pixels: int, lens: ThinLens) -> float:
        scene = band_scene(np.random.default_rng(1).random((pixels, pixels)), 2.0)
        terms = plan(Shot(scene, lens, Exposure(0.001), camera)).error_budget.terms
        return sum(term.sigma for term in terms if "mix pixels" in term.cause)

    assert found(132, diffracting) > 0.05
    assert found(96, diffracting) == found(144, diffracting) == found(132, LENS) == 0.0


def test_an_even_scene_leaves_nothing_however_it_is_held(tmp_path):
    """Eight pixels per photosite and a hand-held clip: 0.014 sigma were told, of the least detail that others divide by."""
    assert plan(load_shot(draw_shot(10201, 34).write(tmp_path))).error_budget.terms == ()
