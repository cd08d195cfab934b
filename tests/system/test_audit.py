"""The audit draws shots that repeat, judges them by the figures that it states, and finds the promise kept on a few of them."""

import secrets

import numpy as np
import pytest
import yaml
from audit import measured_shot
from audit.chart import draw_chart
from audit.command import take
from audit.costs import Cost, measure_cost, read_costs, show_costs
from audit.drawn_plans import draw_plan
from audit.drawn_scenes import LIGHTS, SURFACES, draw_light, draw_surfaces
from audit.drawn_shots import distances, draw_shot
from audit.measured_shot import Record, measure_shot
from audit.records import append, read_numbers, read_records
from audit.shot_truth import (
    NoTruthError,
    run,
)
from audit.summary import is_looser, median_factor, ranked_share, summarise, verdicts
from helpers.audit_shots import simple_shot
from rich.console import Console

from simulator import load_shot
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import measure, plan

FRESH_SHOTS = 25


def record(number=0, **figures):
    """Made-up record: error 0.05 at a tolerance of 0.1, predicted 0.08."""
    plain = {
        "seed": 1,
        "number": number,
        "kinds": ("one", "flat"),
        "method": "mean",
        "truth": "rays",
        "reference_p99_9": None,
        "tolerance": 0.1,
        "p99_9": 0.05,
        "worst": 0.06,
        "tighter_p99_9": 0.02,
        "truth_sigma": 0.0,
        "predicted": 0.08,
        "clamped": False,
        "warnings": (),
        "cost_ms": 1.0,
        "cpu_ms": 2.0,
        "wall_ms": 1.0,
        "electrons": 100.0,
        "photosites": 1000,
    }
    return Record(**(plain | figures))


def test_a_seed_and_a_number_draw_the_same_shot():
    first, again, other = draw_shot(5, 3), draw_shot(5, 3), draw_shot(5, 4)
    assert first.document == again.document and first.kinds == again.kinds
    assert first.files.keys() == again.files.keys()
    assert all(np.array_equal(array, again.files[name]) for name, array in first.files.items())
    assert other.document != first.document


@pytest.mark.parametrize("number", range(6))
def test_drawn_shots_are_shot_files(tmp_path, number):
    """The file says what was drawn, and is read as any other."""
    drawn = draw_shot(11, number)
    path = drawn.write(tmp_path)
    shot = load_shot(path)
    assert yaml.safe_load(path.read_text("utf-8")) == drawn.document
    assert shot.name == drawn.name and 32 <= shot.camera.width_px <= 48 and 32 <= shot.camera.height_px <= 48
    assert shot.tolerance in (0.03, 0.1, 0.3, 1.0)


def test_every_kind_of_scene_is_light_of_its_size():
    rng = np.random.default_rng(1)
    for kind in LIGHTS:
        light = draw_light(rng, kind, (30, 40), 2.0)
        assert light.shape == (30, 40, 3) and light.dtype == np.float32 and np.isfinite(light).all() and light.min() >= 0
    for kind in SURFACES:
        surfaces = draw_surfaces(rng, kind, "edges", (30, 40), 1.0)
        assert surfaces[-1].coverage is None and all(one.coverage is not None for one in surfaces[:-1])


def test_distances_blur_by_the_radii_that_were_drawn():
    lens = {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m"}
    ideal = ThinLens(50.0, 2.0, focus_distance_m=2.0)
    wanted = np.array([-8.0, -0.3, 0.0, 0.3, 8.0])
    assert ideal.blur_radius_um(distances(lens, 5.0, wanted)) / 5.0 == pytest.approx(wanted, abs=1e-9)


def test_a_promise_is_broken_above_tolerance_or_stated_bound():
    kept = record(p99_9=0.1)
    above = record(p99_9=0.11)
    stated = record(p99_9=2.0, predicted=3.0, clamped=True)
    vague = record(p99_9=0.11, predicted=3.0)  # a prediction that no warning tells of
    beyond = record(p99_9=4.0, predicted=3.0, clamped=True)
    unsure = record(p99_9=0.11, truth_sigma=0.01)  # within 3.3 standard errors of the truth
    assert [one.excess > 1.0 for one in (kept, above, stated, vague, beyond, unsure)] == [False, True, False, True, True, False]


def test_a_shot_is_judged_by_the_error_of_its_truth_alone():
    """Of 0.2 of what is allowed: a large error neither makes a shot judged nor keeps it from it."""
    for error in (0.01, 10.0):
        assert record(p99_9=error, truth_sigma=0.02).is_judged and not record(p99_9=error, truth_sigma=0.021).is_judged
        assert record(p99_9=error, truth_sigma=0.5, predicted=3.0, clamped=True).is_judged
    found = summarise([record(0), record(1, truth_sigma=0.5), record(2, p99_9=9.0, truth_sigma=0.5)], refused=1)
    assert (found.shots, found.coverage, [one.number for one in found.unjudged]) == (1, 1.0, [1, 2])
    told = {one["what"]: (one["figure"], one["reached"]) for one in verdicts(found)}
    assert told["shots that are not judged"] == ("75.0 %", False)


def test_a_random_plan_is_held_to_the_tolerance_or_what_it_states():
    kept, broken = record(random_p99_9=0.1, random_predicted=0.05), record(random_p99_9=0.11, random_predicted=0.1)
    stated = record(random_p99_9=0.11, random_predicted=0.2)
    found = summarise([kept, broken, stated, record()])
    assert found.random == 3 and found.random_broken == (broken,)


def test_random_plans_decide_for_smaller_tolerances(tmp_path, device):
    planned = measure(plan(simple_shot(tmp_path)), device)
    defocus = planned.optics.defocus
    assert defocus is not None
    stricter = []
    for seed in range(4):
        free = draw_plan(planned, np.random.default_rng(seed), device)
        assert free is not None and free.optics.defocus is not None
        own, given = free.optics.defocus.accuracy, defocus.accuracy
        assert own.tolerance == given.tolerance and own.allowed == given.allowed
        pairs = [
            (own.sharp_px, given.sharp_px),
            (own.same_px, given.same_px),
            (own.slope_step, given.slope_step),
            (given.points_factor, own.points_factor),
        ]
        assert all(mine <= theirs for mine, theirs in pairs)
        stricter.append(sum(mine < theirs for mine, theirs in pairs))
    assert 0 < sum(stricter) < 16


def test_a_random_plan_states_what_its_own_decisions_leave(tmp_path, device):
    """A layer that the planner leaves sharp and the random plan blurs by a circle inside a sample: 2.44 sigma, 1.41 stated."""
    planned = measure(plan(load_shot(draw_shot(6101, 168).write(tmp_path))), device)
    free = draw_plan(planned, np.random.default_rng([6101, 168, 1]), device)
    assert free is not None and free.optics.defocus is not None and planned.optics.defocus is not None
    assert free.optics.defocus.accuracy.sharp_px < 0.367 < planned.optics.defocus.accuracy.sharp_px
    assert 2.44 < free.error_budget.predicted_sigma < 25.0


def test_a_random_plan_of_a_swept_picture_keeps_its_samples(tmp_path, device):
    """They are those of the motion: a blur of others, which no planner makes, left 1.8 sigma where 0.23 were stated."""
    planned = measure(plan(load_shot(draw_shot(6901, 163).write(tmp_path))), device)
    assert planned.optics.motion is not None and planned.optics.motion.method == "swept_first"

    def means(one) -> list[str]:
        return [term.cause for term in one.error_budget.terms if "points per photosite" in term.cause]

    for seed in range(6):
        free = draw_plan(planned, np.random.default_rng(seed), device)
        assert free is not None and means(free) == means(planned)


def test_a_shot_is_timed_several_times(tmp_path, device, monkeypatch):
    """The least time counts: others on the same cores lengthen processor time, too."""
    shot, taken = simple_shot(tmp_path), iter((9.0, 3.0, 5.0, 4.0, 7.0))
    planned = measure(plan(shot), device)

    def run_in(planned, shot, device, timed):
        timed.times_ms["all"] = next(taken)
        return run(planned, shot, device)

    monkeypatch.setattr(measured_shot, "run", run_in)
    found, cpu_ms, wall_s = measured_shot.least_time(planned, shot, device, timed_s=600.0)
    assert cpu_ms == 3.0 and wall_s > 0.0 and np.array_equal(found, run(planned, shot, device))


def test_figures_of_made_up_records():
    found = summarise([record(number, p99_9=error) for number, error in enumerate((0.02, 0.04, 0.08, 0.4))])
    assert (found.shots, found.coverage) == (4, 0.75) and [one.number for one in found.broken] == [3]
    assert found.tightness == pytest.approx(0.75)  # the middle of 0.25, 0.5, 1 and 5
    assert found.factor == pytest.approx(2.0) and found.ranked == 0.5  # all predicted alike
    assert [one["reached"] for one in verdicts(found)] == [False, True, True, True, False, False, True]
    assert is_looser(record(tighter_p99_9=0.051)) and not is_looser(record(tighter_p99_9=0.05))
    assert not is_looser(record(tighter_p99_9=0.06, truth_sigma=0.01))
    assert not is_looser(record(tighter_p99_9=0.05 + 5e-5, electrons=1e4))
    assert is_looser(record(tighter_p99_9=0.06, input_sigma=0.05)) and not is_looser(
        record(tighter_p99_9=0.06, input_sigma=0.06)
    )


def test_pairs_are_ranked_and_factors_are_medians():
    assert ranked_share([1.0, 2.0, 3.0], [10.0, 20.0, 15.0]) == pytest.approx(2 / 3)
    assert median_factor([1.0, 1.0, 1.0], [0.5, 1.0, 4.0]) == pytest.approx(2.0)


def test_a_run_goes_on_from_its_file(tmp_path):
    path = tmp_path / "audit.jsonl"
    assert read_records(path) == ([], {}, {})
    append(path, record(3).as_json())
    append(path, {"seed": 1, "number": 4, "error": "PhotositeError: none"})
    append(path, {"seed": 1, "number": 5, "refused": "steep"})
    assert read_records(path) == ([record(3)], {4: "PhotositeError: none"}, {5: "steep"})


def test_the_chart_is_a_picture(tmp_path):
    pytest.importorskip("matplotlib")
    methods = ("points", "mean", "copy", "psf", "swept", "joint", "instants", "sharp")
    many = [record(number, method=method, p99_9=0.3 * number) for number, method in enumerate(methods)]
    path = draw_chart(many, tmp_path / "charts" / "audit.png")
    assert path.read_bytes().startswith(b"\x89PNG") and path.stat().st_size > 10_000


def test_costs_are_read_as_they_were_written(tmp_path, device):
    """And told with the figures of all of them."""
    path, console = tmp_path / "cost.jsonl", Console(record=True, width=120)
    append(path, {"seed": 1, "number": 0, "refused": "predicted to take 9 s"})
    append(path, measure_cost(draw_shot(1, 0), tmp_path, device).as_json())
    append(path, Cost(1, 2, ("one",), "sharp", 1e-3, 4e-3).as_json())
    costs = read_costs(path)
    assert [one.number for one in costs] == [0, 2] and costs[0].cpu_ms > 0.0 and read_numbers(path) == {0, 2}
    show_costs(costs, console)
    told = console.export_text()
    assert "4.00" in told and "all" in told and "1:2 sharp: predicted 0.001 ms, 0.004 ms; one" in told


def test_predicted_times_are_those_of_the_machine_at_hand():
    """Twice those of a machine that takes half the time for the calibration shots."""
    usual, slow = (take(1, 0, None, machine)["cost_ms"] for machine in (1.0, 2.0))
    assert slow == 2.0 * usual > 0.0


@pytest.mark.parametrize(
    "number", [0, *(pytest.param(one, marks=pytest.mark.slow) for one in (41, 43))], ids=["sharp", "points", "means"]
)
def test_shots_of_the_audit_keep_the_promise(tmp_path, device, number):
    found = measure_shot(draw_shot(1, number), tmp_path, device)
    assert found.excess <= 1.0 and not is_looser(found), found


@pytest.mark.slow
def test_fresh_shots_keep_the_promise(tmp_path, device):
    """New shots each time; of 25 at most one may break it, as the audit's 99 % allow."""
    seed = secrets.randbelow(2**31)
    print(f"python benchmarks/audit --seed {seed} --shots {FRESH_SHOTS}")
    records, refused = [], 0
    for number in range(FRESH_SHOTS):
        try:
            records.append(measure_shot(draw_shot(seed, number), tmp_path, device))
        except NoTruthError:
            refused += 1
    found = summarise(records)
    assert len(found.broken) <= 1 and refused <= FRESH_SHOTS // 5, (seed, refused, found.broken)
