"""A truth that takes too long is given up, and an audit that is ended leaves no worker at work."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from audit.limits import limited_time

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
POOL = """
import os, sys
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
sys.path.insert(0, {benchmarks!r})
from audit.limits import end_with_parent

def work():
    print(os.getpid(), flush=True)
    while True:
        pass

if __name__ == "__main__":
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=end_with_parent) as pool:
        pool.submit(work).result()
"""


class GivenUpError(Exception):
    pass


def test_work_ends_after_its_processor_time():
    with pytest.raises(GivenUpError, match="too long"), limited_time(0.05, GivenUpError("too long")):
        for _ in range(100_000):  # a second and more
            sum(range(1000))
    assert signal.getitimer(signal.ITIMER_PROF) == (0.0, 0.0)


def test_work_that_waits_is_not_ended():
    with limited_time(0.05, GivenUpError("too long")):
        time.sleep(0.1)


def is_running(pid: int) -> bool:
    """Whether a process is there, and is no zombie, which has ended."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text("utf-8").rsplit(")", 1)[1].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc, which tells zombies from processes at work")
def test_a_worker_ends_with_the_process_that_started_it(tmp_path):
    script = tmp_path / "pool.py"
    script.write_text(POOL.format(benchmarks=str(BENCHMARKS)), "utf-8")
    parent = subprocess.Popen([sys.executable, str(script)], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    worker = int(parent.stdout.readline())
    assert is_running(worker)
    parent.kill()
    parent.wait()
    for _ in range(500):
        if not is_running(worker):
            break
        time.sleep(0.02)
    ended = not is_running(worker)
    if not ended:
        os.kill(worker, signal.SIGKILL)
    assert ended
