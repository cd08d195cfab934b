"""A write that is stopped leaves the old file or the new one: on a real full disk, a real read-only one, and by kill -9.

The disks are small file systems in memory, mounted in a namespace of the test's own, so that nobody else sees them and
nothing needs to be unmounted.
"""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest

from simulator.atomic_files import LEFTOVER, atomic_folder, atomic_write, remove_abandoned
from simulator.config import load_sweep
from simulator.studies.sweep_runner import run_sweep

ROOT = Path(__file__).parents[2]
SHOT = """\
scene: {chart: flat_field, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 64, height: 48}}
"""
NAMESPACE = ["unshare", "--map-root-user", "--mount"]
START = """
import sys
from dataclasses import replace
from pathlib import Path
import numpy as np
from helpers.raw_frame import random_frame
from simulator.raw.development import write_image
from simulator.errors import PhotositeError
from simulator.raw.dng.writer import write_dng
from simulator.raw.save import save
from simulator.raw.truth_exr import write_twin
from simulator.raw.raw_format import RawFormat
folder = Path(sys.argv[1])
def stored_as(frame, payload):
    return replace(frame, format=RawFormat(payload))
def with_truth(frame):
    plane = frame.mean_electrons
    return replace(frame, truth={name: plane for name in ("variance", "depth", "blur")} | {"rgb": np.dstack([plane] * 3)})
"""
WRITERS = {
    "a.dng": "write_dng(frame, folder / 'a.dng')",
    "packed.dng": "write_dng(stored_as(frame, 'packed'), folder / 'packed.dng')",
    "jpeg.dng": "write_dng(stored_as(frame, 'lossless_jpeg'), folder / 'jpeg.dng')",
    "a.exr": "write_twin(frame, folder / 'a.exr')",
    "truth.exr": "write_twin(with_truth(frame), folder / 'truth.exr')",
    "a.png": "write_image(folder / 'a.png', frame.dn)",
    "a.tif": "write_image(folder / 'a.tif', frame.dn)",
    "a.jpg": "write_image(folder / 'a.jpg', frame.dn)",
    "frame.dng": "save(frame, folder)",
}


def may_mount() -> bool:
    """Whether this system lets a namespace of its own mount a file system."""
    if shutil.which("unshare") is None:
        return False
    command = [*NAMESPACE, "mount", "-t", "tmpfs", "-o", "size=64k", "none", "/mnt"]
    return subprocess.run(command, capture_output=True).returncode == 0


mounts = pytest.mark.skipif(not may_mount(), reason="unshare may not mount here; run as root, or allow user namespaces")


def python(program: str, folder: Path, *before: str) -> str:
    """Standard output of a program that succeeds without a word on standard error."""
    environment = os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    command = [*before, sys.executable, "-c", START + program, str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=30)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    return done.stdout


def on_disk(options: str) -> list[str]:
    """Command that runs the rest of the line with a small disk mounted on its last argument."""
    script = f'mount -t tmpfs -o {options} none "${{@: -1}}" && exec "$@"'
    return [*NAMESPACE, "bash", "-c", script, "bash"]


STOPPED = """
import subprocess
def listing():
    return {path.name: path.read_bytes() for path in folder.iterdir()}
frame = random_frame(24, 32)
WRITE
before = listing()
assert before
frame = random_frame(HEIGHT, 400, seed=2)
PREPARE
try:
    WRITE
except PhotositeError as error:
    print(error)
assert listing() == before, list(listing())
"""


def stopped(write: str, prepare: str = "", height: int = 400) -> str:
    return STOPPED.replace("WRITE", write).replace("PREPARE", prepare).replace("HEIGHT", str(height))


@mounts
@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_is_one_message_and_keeps_the_old_file(tmp_path, name):
    """A disk that holds the small files before, but not the larger ones after."""
    message = python(stopped(WRITERS[name]), tmp_path, *on_disk("size=160k"))
    assert f"{tmp_path}" in message and message.count("\n") == 1
    assert ": cannot be written: No space left on device; free some space" in message


@mounts
def test_a_disk_too_small_for_the_whole_set_takes_no_part_of_it(tmp_path):
    """The raw file and the settings would fit, the twin not any more."""
    height = 100  # twin 2 x 4 bytes and raw file 2 bytes for each of 40,000 photosites, and a thumbnail
    message = python(stopped(WRITERS["frame.dng"], height=height), tmp_path, *on_disk("size=452k"))
    assert message.startswith(f"{tmp_path}/frame.truth.exr: cannot be written: No space left")


@mounts
@pytest.mark.parametrize("name", WRITERS)
def test_a_read_only_disk_is_one_message_and_keeps_the_old_file(tmp_path, name):
    prepare = "subprocess.run(['mount', '-o', 'remount,ro', str(folder)], check=True)"
    message = python(stopped(WRITERS[name], prepare, height=24), tmp_path, *on_disk("size=1m"))
    assert ": cannot be written: Read-only file system; the disk is read-only: choose another folder" in message
    assert message.count("\n") == 1


@mounts
def test_the_command_on_a_full_disk_is_one_message_and_no_file(tmp_path):
    program = """
from simulator.command_line.main import main
sys.stderr = sys.stdout
try:
    main(["simulate", "configs/shots/flat_field.yaml", "--out", str(folder)])
except SystemExit as end:
    print("status", end.code, [path.name for path in folder.iterdir()])
"""
    told = python(program, tmp_path, *on_disk("size=160k"))
    assert told.count("error:") == 1 and "No space left on device" in told and "Traceback" not in told
    assert told.endswith("status 1 []\n")


# Children write one version over the other and are killed; each file must then be whole, of one version or the other.
VERSIONS = """
import os, random, signal, time
versions = [random_frame(300, 400, seed=seed, resolved={"seed": seed}) for seed in (1, 2)]
def listing():
    return {path.name: path.read_bytes() for path in folder.iterdir() if not path.name.startswith(".photosite-")}
def write_whole(frame):
    # In a child: a fork has none of the threads that a picture library starts, and would wait for them for ever.
    child = os.fork()
    if child == 0:
        WRITE
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0
whole = []
for frame in versions:
    write_whole(frame)
    whole.append(listing())
def check(turn):
    found = listing()
    for name, content in found.items():
        assert content in [version[name] for version in whole], f"turn {turn}: {name} is broken"
    missing = set(whole[0]) - set(found)
    assert missing <= {"frame.json"}, f"turn {turn}: {missing} are gone"
    assert missing or found in whole, f"turn {turn}: a mixed set looks complete"
"""
RANDOM_MOMENTS = """
choice, at_work = random.Random(7), 0
ready, tell = os.pipe()
for turn in range(1500):
    if turn >= 60 and at_work >= 10:
        break
    child = os.fork()
    if child == 0:
        frame = versions[0]
        WRITE
        os.write(tell, b".")
        while True:
            for frame in versions:
                WRITE
    os.read(ready, 1)
    time.sleep(choice.uniform(0.0, 0.03))
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    leftovers = list(folder.glob(".photosite-*"))
    at_work += len(leftovers) > 0
    check(turn)
write_whole(versions[0])
assert not list(folder.glob(".photosite-*"))
print(at_work)
"""
EVERY_STEP = """
def killed_at(step):
    calls = [0]
    def counted(real):
        def call(*arguments, **options):
            calls[0] += 1
            if calls[0] == step:
                os.kill(os.getpid(), signal.SIGKILL)
            return real(*arguments, **options)
        return call
    os.replace, os.fsync, os.unlink = counted(os.replace), counted(os.fsync), counted(os.unlink)
step, status = 0, None
while status != 0:
    step += 1
    write_whole(versions[0])
    child = os.fork()
    if child == 0:
        killed_at(step)
        frame = versions[1]
        WRITE
        os._exit(0)
    status = os.waitpid(child, 0)[1]
    check(step)
assert listing() == whole[1]
assert not list(folder.glob(".photosite-*"))
print(step - 1)
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a.dng", "packed.dng", "jpeg.dng", "a.exr", "truth.exr", "a.png", "frame.dng"])
def test_a_write_killed_at_a_random_moment_leaves_the_old_file_or_the_new_one(tmp_path, name):
    """Kill -9 at 60 moments or more, until ten hit a write at work: packing takes longer than writing what is packed.

    A set whose files are of two versions has no settings file, which is what tells that it is complete.
    """
    at_work = int(python((VERSIONS + RANDOM_MOMENTS).replace("WRITE", WRITERS[name]), tmp_path))
    assert at_work >= 10


@pytest.mark.parametrize(("name", "steps"), [("a.dng", 3), ("jpeg.dng", 3), ("truth.exr", 3), ("frame.dng", 10)])
def test_a_write_killed_before_any_of_its_steps_leaves_the_old_file_or_the_new_one(tmp_path, name, steps):
    """Kill -9 before each call that brings a file to disk, renames it or takes it away."""
    assert int(python((VERSIONS + EVERY_STEP).replace("WRITE", WRITERS[name]), tmp_path)) == steps


HOLD = """
import time
from simulator.atomic_files import atomic_folder, atomic_write
BEFORE
with WRITER(folder / "TARGET") as temporary:
    if "WRITER" == "atomic_folder":
        temporary.mkdir()
        temporary = temporary / "file"
    temporary.write_bytes(b"child")
    print("writing", flush=True)
    sys.stdin.readline()
print("done", flush=True)
"""


@contextmanager
def writing(folder: Path, target: str = "a.bin", writer: str = "atomic_write", before: str = "") -> Iterator[subprocess.Popen]:
    """A process that writes a target and stands still in the middle of it until it gets a line; killed at the end."""
    program = START + HOLD.replace("WRITER", writer).replace("TARGET", target).replace("BEFORE", before)
    environment = os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    command = [sys.executable, "-c", program, str(folder)]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, env=environment, **pipes) as process:
        try:
            assert process.stdout.readline() == "writing\n"
            yield process
        finally:
            process.kill()


def leftovers(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.glob(f"{LEFTOVER}*"))


def write(path: Path) -> None:
    with atomic_write(path) as temporary:
        temporary.write_bytes(b"parent")


@pytest.mark.parametrize("writer", ["atomic_write", "atomic_folder"])
def test_the_next_write_of_a_target_removes_what_a_killed_process_left_of_it(tmp_path, writer):
    with writing(tmp_path, writer=writer):
        pass
    with writing(tmp_path, "other.bin", writer):
        pass
    assert leftovers(tmp_path) == [".photosite-a.bin.0", ".photosite-other.bin.0"]
    write(tmp_path / "a.bin")
    assert leftovers(tmp_path) == [".photosite-other.bin.0"] and (tmp_path / "a.bin").read_bytes() == b"parent"
    remove_abandoned(tmp_path)
    assert os.listdir(tmp_path) == ["a.bin"]


@pytest.mark.parametrize("writer", ["atomic_write", "atomic_folder"])
def test_what_a_living_process_is_writing_stays(tmp_path, writer):
    """Beside it another writes the same target; the last one to end wins."""
    with writing(tmp_path, writer=writer) as process:
        if writer == "atomic_write":
            write(tmp_path / "a.bin")
        remove_abandoned(tmp_path)
        owner = (tmp_path / ".photosite-a.bin.0" / "owner").read_text()
        assert owner.startswith(f"process {process.pid} on ")
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "done\n"
    assert os.listdir(tmp_path) == ["a.bin"]
    written = tmp_path / "a.bin" / "file" if writer == "atomic_folder" else tmp_path / "a.bin"
    assert written.read_bytes() == b"child"


def test_a_killed_process_beside_a_living_one_leaves_nothing_for_long(tmp_path):
    """The living one has the first place, the killed ones the others."""
    with writing(tmp_path) as living:
        for _ in range(3):
            with writing(tmp_path):
                pass
        write(tmp_path / "a.bin")
        assert leftovers(tmp_path) == [".photosite-a.bin.0"] and living.poll() is None


def test_more_writers_of_one_target_than_places_do_not_harm_each_other(tmp_path):
    with ThreadPoolExecutor(12) as pool:
        list(pool.map(write, [tmp_path / "a.bin"] * 400))
    assert os.listdir(tmp_path) == ["a.bin"] and (tmp_path / "a.bin").read_bytes() == b"parent"


@pytest.mark.parametrize(
    "step", ["os.mkdir", "os.open", "fcntl.flock", "os.write", "os.fsync", "os.replace", "os.unlink", "os.rmdir"]
)
def test_a_process_killed_before_any_step_of_a_write_is_cleared_away(tmp_path, step):
    program = f"""
import fcntl, os, signal
from simulator.atomic_files import atomic_write
with atomic_write(folder / "b.bin") as temporary:
    temporary.write_bytes(b"child")
def kill(*_, **__):
    os.kill(os.getpid(), signal.SIGKILL)
{step} = kill
with atomic_write(folder / "a.bin") as temporary:
    temporary.write_bytes(b"child")
"""
    environment = os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    done = subprocess.run([sys.executable, "-c", START + program, str(tmp_path)], env=environment, timeout=30)
    assert done.returncode == -signal.SIGKILL
    write(tmp_path / "a.bin")
    assert sorted(os.listdir(tmp_path)) == ["a.bin", "b.bin"] and (tmp_path / "a.bin").read_bytes() == b"parent"


NO_LOCKS = {
    "Windows": "sys.modules['fcntl'] = None",
    "a file system without locks": """
import errno, fcntl
def refuse(*_):
    raise OSError(errno.ENOTSUP, "Operation not supported")
fcntl.flock = refuse
""",
}


@pytest.mark.parametrize("system", NO_LOCKS)
def test_where_there_are_no_locks_files_are_written_and_nobody_s_folder_is_removed(tmp_path, system):
    with writing(tmp_path, before=NO_LOCKS[system]) as process:
        write(tmp_path / "a.bin")
        remove_abandoned(tmp_path)
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "done\n"
    assert os.listdir(tmp_path) == ["a.bin"] and (tmp_path / "a.bin").read_bytes() == b"child"
    with writing(tmp_path), writing(tmp_path, before=NO_LOCKS[system]) as process:
        process.stdin.write("\n")
        process.stdin.flush()
        assert process.stdout.readline() == "done\n"
        assert leftovers(tmp_path) == [".photosite-a.bin.0"]


def test_a_target_may_have_the_longest_name(tmp_path):
    name = "é" * 125 + ".bin"  # 254 bytes of 255
    with writing(tmp_path, name):
        pass
    assert len(leftovers(tmp_path)) == 1
    write(tmp_path / name)
    assert os.listdir(tmp_path) == [name]


SWEEP = """
import os, signal
from simulator.config import load_sweep
from simulator.raw import save as saving
from simulator.studies.sweep_runner import run_sweep, take
sweep = load_sweep(folder / "s.yaml")
def kill_in_the_middle(pieces, path):
    path.write_bytes(pieces[0])
    os.kill(os.getpid(), signal.SIGKILL)
def take_or_die(shot, directory):
    if shot.name == "s_0001":
        saving.write_pieces = kill_in_the_middle
    take(shot, directory)
run_sweep(sweep, folder / "out", take=take_or_die)
"""


def test_a_sweep_killed_while_it_writes_leaves_nothing_that_the_next_run_does_not_remove(tmp_path):
    (tmp_path / "s.yaml").write_text(SHOT + "sweep: {vary: {exposure.iso: [100, 200, 400]}}\n")
    environment = os.environ | {"PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    done = subprocess.run([sys.executable, "-c", START + SWEEP, str(tmp_path)], env=environment, timeout=120)
    out = tmp_path / "out"
    assert done.returncode == -signal.SIGKILL
    assert leftovers(out) == [f".photosite-s_0001.{end}.0" for end in ("dng", "json", "truth.exr")]
    sweep = load_sweep(tmp_path / "s.yaml")
    assert {row.error for row in run_sweep(sweep, out)} == {None}
    ends = ("dng", "json", "truth.exr", "yaml")
    assert sorted(os.listdir(out)) == ["manifest.csv"] + [f"s_000{point}.{end}" for point in range(3) for end in ends]


CROWD = """
import os, random, signal, time
from simulator.atomic_files import LEFTOVER, atomic_folder, atomic_write
failed = folder / "failed"
def start(number):
    child = os.fork()
    if child:
        return child
    try:
        while True:
            with atomic_write(folder / "a.bin") as temporary:
                temporary.write_bytes(bytes([number % 256]) * 5000)
            with atomic_folder(folder / "b") as temporary:
                temporary.mkdir()
                (temporary / "c").write_bytes(bytes([number % 256]) * 3000)
    except BaseException as error:
        with open(failed, "a") as file:
            file.write(f"{error!r}\\\\n")
        os._exit(1)
choice, children = random.Random(5), [start(number) for number in range(5)]
for number in range(5, 305):
    time.sleep(choice.uniform(0.001, 0.02))
    place = choice.randrange(len(children))
    os.kill(children[place], signal.SIGKILL)
    os.waitpid(children[place], 0)
    children[place] = start(number)
    if (folder / "a.bin").exists():
        content = (folder / "a.bin").read_bytes()
        assert len(content) == 5000 and len(set(content)) == 1
for child in children:
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
print(failed.read_text() if failed.exists() else "none failed")
"""


@pytest.mark.slow
def test_those_that_live_are_never_disturbed_by_those_that_are_killed(tmp_path):
    """Five processes write one file and one folder; 300 times one of them is killed and another takes its place."""
    assert python(CROWD, tmp_path) == "none failed\n"
    write(tmp_path / "a.bin")
    with atomic_folder(tmp_path / "b") as temporary:
        temporary.mkdir()
    assert sorted(os.listdir(tmp_path)) == ["a.bin", "b"]
