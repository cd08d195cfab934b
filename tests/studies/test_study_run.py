"""A study takes what is missing or stale, loses nothing when killed, and gives the same files for any number of workers."""

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from helpers.linked_files import put_cube, put_kernel, put_shot
from helpers.small_study import SHOT, STUDY, content, small_study, write_study

from simulator.config import load_shot
from simulator.errors import PhotositeError
from simulator.measurement.quantities import MeasuredFrame
from simulator.pipeline.simulate import simulate
from simulator.raw.raw_reader import read_raw_file
from simulator.studies.cluster import cluster
from simulator.studies.study_point import StudyTask, take_points
from simulator.studies.study_result import load
from simulator.studies.study_run import run_study

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A study that was run: itself and its folder."""
    folder = tmp_path_factory.mktemp("whole")
    study = small_study(folder)
    run_study(study, folder / "out")
    return study, folder / "out"


def states(folder) -> list[str]:
    return [row["state"] for row in load(folder).rows]


def test_every_point_is_simulated_and_measured(whole):
    study, folder = whole
    result = load(folder)
    assert [row["name"] for row in result.rows] == [point.name for point in study] and set(states(folder)) == {"done"}
    for point, row in zip(study, result.rows, strict=True):
        shot = point.shot()
        measured = study.measure["grey"].measure(MeasuredFrame.from_raw(simulate(shot), shot))
        assert {name: row[f"grey.{name}"] for name in measured.figures} == {
            name: figure.value for name, figure in measured.figures.items()
        }
        assert (row["exposure.iso"], row["lens.f_number"], row["exposure.time"]) == (
            shot.exposure.iso,
            shot.lens.f_number,
            shot.exposure.time_s,
        )
        assert load_shot(folder / "points" / f"{point.name}.yaml").resolved == shot.resolved


def test_light_that_is_the_same_is_computed_once(tmp_path):
    """One point uses the plan that was made for its record again; each other ISO that plan twice, and the light."""
    study = small_study(tmp_path)
    used = []
    for indices in ((0,), (0, 2, 4)):
        task = StudyTask(study, tmp_path / f"out{len(indices)}")
        take_points(task, indices)
        used.append(task.cache.reused)
    assert used == [1, 7]


def test_the_command_of_a_row_takes_the_same_frame(whole):
    _, folder = whole
    row = load(folder).rows[3]
    _, _, shot, *options = shlex.split(row["command"])
    frame = simulate(load_shot(shot, options[1::2]))
    assert load(folder).rows[3]["clip.white"] == (frame.dn >= frame.white_level_dn).mean()
    assert frame.name == row["name"]


def test_what_is_done_is_kept_and_what_is_missing_or_stale_is_taken(tmp_path):
    study, out = small_study(tmp_path), tmp_path / "out"
    first = run_study(study, out)
    before = content(out)
    assert (first.taken, first.kept) == (6, 0)
    again = run_study(study, out)
    assert (again.taken, again.kept) == (0, 6) and content(out) == before
    (out / "points" / f"{study[2].name}.json").unlink()  # missing
    (out / "points" / f"{study[4].name}.yaml").unlink()  # without its shot it is not complete
    assert run_study(study, out).taken == 2 and content(out) == before
    more = small_study(tmp_path, STUDY.replace("1600]", "1600, 200]"))
    assert (run_study(more, out).taken, len(load(out).rows)) == (2, 8)
    changed = small_study(tmp_path, STUDY.replace("[0, 0, 32, 64]", "[0, 0, 48, 64]"))
    assert run_study(changed, out).taken == 6
    assert run_study(small_study(tmp_path), out, redo=True).taken == 6
    after = content(out)
    assert {name: after[name] for name in before} == before  # files of points that have left the study stay


def test_a_point_is_stale_when_the_content_of_its_picture_changes_and_not_when_it_is_moved(tmp_path, monkeypatch):
    import numpy as np

    from simulator.raw.development import write_image

    shot = SHOT.replace("chart: flat_field", "image: a.exr")
    text = STUDY.replace("[100, 400, 1600]", "[100]").replace("[f/4, f/8]", "[f/4]").replace("[1/60 s, 1/15 s]", "[1/60 s]")
    picture = tmp_path / "a.exr"
    write_image(picture, np.full((48, 64, 3), 0.5, np.float32))
    assert run_study(small_study(tmp_path, text, shot), tmp_path / "out").taken == 1
    os.utime(picture, (1, 1))
    assert run_study(small_study(tmp_path, text, shot), tmp_path / "out").taken == 0
    picture.rename(tmp_path / "b.exr")
    assert run_study(small_study(tmp_path, text, shot.replace("a.exr", "b.exr")), tmp_path / "out").taken == 0
    write_image(tmp_path / "b.exr", np.full((48, 64, 3), 0.25, np.float32))
    assert run_study(small_study(tmp_path, text, shot.replace("a.exr", "b.exr")), tmp_path / "out").taken == 1


def test_a_point_is_stale_when_a_file_changes_that_an_input_file_leads_to(tmp_path):
    put_shot(tmp_path)
    (tmp_path / "study.yaml").write_text("""\
study: linked
shot: ./linked.yaml
vary: [{exposure.iso: [100]}]
measure: {grey: {patch: {area: [0, 0, 24, 32]}}}
""")

    def taken() -> tuple[int, float]:
        ran = run_study(tmp_path / "study.yaml", tmp_path / "out")
        return ran.taken, load(tmp_path / "out").rows[0]["grey.mean_dn"]

    (first, dark), again = taken(), taken()
    put_cube(tmp_path, 0.03)
    second, bright = taken()
    put_kernel(tmp_path, "rest", 5)
    assert (first, again, second, taken()[0], taken()[0]) == (1, (0, dark), 1, 1, 0)
    assert bright > 2 * dark


def test_a_point_is_stale_when_a_function_of_ones_own_changes(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    text = STUDY.replace("[100, 400, 1600]", "[100]").replace("clip: clipped_share", "mine: {python: own.rows}")
    run_study(small_study(tmp_path, text), tmp_path / "out")
    assert run_study(small_study(tmp_path, text), tmp_path / "out").taken == 0
    (tmp_path / "own.py").write_text((tmp_path / "own.py").read_text() + "\n# changed\n")
    assert run_study(tmp_path / "study.yaml", tmp_path / "out").taken == 2
    sys.modules.pop("own")


def test_a_failed_point_is_told_and_the_others_go_on(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    text = STUDY.replace("clip: clipped_share", "mine: {python: own.fails_at_400}")
    told = []
    done = run_study(small_study(tmp_path, text), tmp_path / "out", report=told.append)
    assert [outcome.record.error is None for outcome in sorted(told, key=lambda one: one.index)] == [True] * 2 + [False] * 2 + [
        True
    ] * 2
    assert len(done.failed) == 2 and "KeyError" in done.failed[0].record.error and "measure.mine" in done.failed[0].record.error
    assert states(tmp_path / "out") == ["done"] * 2 + ["failed"] * 2 + ["done"] * 2
    failed = load(tmp_path / "out").rows[2]
    assert "KeyError" in failed["error"] and "--set exposure.iso=400" in failed["command"] and failed["grey.snr"] is None
    assert failed["exposure.iso"] == 400 and failed["exposure.time"] == 1 / 60
    again = run_study(small_study(tmp_path, text), tmp_path / "out")
    assert (again.kept, len(again.failed)) == (4, 2)  # what failed is tried again
    sys.modules.pop("own")


def test_values_that_give_no_shot_together_are_a_failed_point(tmp_path):
    """The Canon has no ISO 25600; the Sony has."""
    vary = "  - exposure.iso: [100, 25600]\n  - camera: [sony_a7s2, canon_550d]\n"
    text = "study: small\nshot: ./flat.yaml\nset: {camera.window: {x: 0, y: 0, width: 64, height: 48}}\nvary:\n" + vary
    done = run_study(small_study(tmp_path, text), tmp_path / "out")
    assert states(tmp_path / "out") == ["done", "done", "done", "failed"]
    assert "exposure.iso = 25600" in done.failed[0].record.error and "--set camera=canon_550d" in done.failed[0].command
    assert [row["camera"] for row in load(tmp_path / "out").rows] == ["sony_a7s2", "canon_550d"] * 2


def test_files_that_stay_are_those_of_the_shot_alone(tmp_path):
    text = STUDY.replace("[100, 400, 1600]", "[400]") + "keep: [dng, truth]\n"
    study = small_study(tmp_path, text)
    run_study(study, tmp_path / "out")
    for point in study:
        frame = simulate(point.shot())
        assert (read_raw_file(tmp_path / "out" / "points" / f"{point.name}.dng").mosaic == frame.dn).all()
        assert (tmp_path / "out" / "points" / f"{point.name}.truth.exr").is_file()
    (tmp_path / "out" / "points" / f"{study[0].name}.dng").unlink()
    assert run_study(study, tmp_path / "out").taken == 1
    assert run_study(small_study(tmp_path, text.replace("keep: [dng, truth]\n", "")), tmp_path / "out").taken == 2
    assert not list((tmp_path / "out").rglob("*.dng")) and not list((tmp_path / "out").rglob("*.exr"))


def test_a_folder_of_another_study_is_refused(whole, tmp_path):
    _, folder = whole
    with pytest.raises(PhotositeError, match="holds the study small; choose another folder for other"):
        run_study(small_study(tmp_path, STUDY.replace("study: small", "study: other")), folder)


@pytest.mark.parametrize("workers", ["1", pytest.param("2", marks=pytest.mark.slow)])
def test_a_run_that_is_killed_loses_nothing(workers, tmp_path, monkeypatch):
    """The quantity `mine` takes 0.15 s a point, so that the run is killed between two records."""
    text = STUDY + "  mine: {python: own.slowly}\n"
    path, out = write_study(tmp_path, text), tmp_path / "out"
    command = [sys.executable, "-m", "simulator", "study", str(path), "--out", str(out), "--workers", workers]
    environment = os.environ | {"PYTHONPATH": f"{ROOT}{os.pathsep}{tmp_path}"}
    running = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while len(list(out.glob("points/*.json"))) < 2 and running.poll() is None:
        time.sleep(0.01)
    assert running.poll() is None
    running.send_signal(signal.SIGKILL)
    running.wait()
    last = -1
    while (found := len(list(out.rglob("*")))) != last:  # workers end when they miss their parent
        last = found
        time.sleep(0.5)
    done = {path.name: path.stat().st_mtime_ns for path in out.glob("points/*.json")}
    assert 2 <= len(done) < 6
    monkeypatch.syspath_prepend(str(tmp_path))
    again = run_study(path, out)
    assert (again.kept, again.taken) == (len(done), 6 - len(done))
    assert {name: (out / "points" / name).stat().st_mtime_ns for name in done} == done
    run_study(path, tmp_path / "other")
    assert content(out) == content(tmp_path / "other") and not list(out.rglob(".photosite-*"))
    sys.modules.pop("own")


def test_workers_of_a_cluster_give_the_files_of_one_process(whole, tmp_path):
    """The workers are threads of this process, so that the test is quick; the next one has processes."""
    distributed = pytest.importorskip("distributed")
    study, folder = whole
    shares = []
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=False, dashboard_address=None) as local:
        done = run_study(
            study, tmp_path / "out", scheduler=local.scheduler_address, progress=lambda what, share: shares.append(share)
        )
    assert done.taken == 6 and content(tmp_path / "out") == content(folder)
    assert shares == sorted(shares) and shares[-1] == 1.0


@pytest.mark.slow
def test_two_workers_give_the_files_of_one(whole, tmp_path):
    study, folder = whole
    run_study(study, tmp_path / "out", workers=2)
    assert content(tmp_path / "out") == content(folder)


@pytest.mark.slow
def test_a_killed_worker_of_a_cluster_loses_nothing(whole, tmp_path):
    study, folder = whole
    with cluster(2, None) as client:
        workers = list(client.run(os.getpid).values())
        assert os.getpid() not in workers

        def kill(what, share):
            if workers:
                os.kill(workers.pop(), signal.SIGKILL)
                workers.clear()

        run_study(study, tmp_path / "out", scheduler=client.scheduler.address, progress=kill)
    assert not workers and content(tmp_path / "out") == content(folder)


def test_provenance_says_how_it_was_made(whole):
    _, folder = whole
    told = load(folder).provenance
    assert told["points"] == {"done": 6} and told["devices"] and told["devices"][0]["platform"]
    assert {"photosite", "python", "system", "libraries", "command", "started", "ended", "wall_seconds"} <= told.keys()
