"""Whole processes, timed: what a start costs, and how much memory is used at most."""

import os
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Ended:
    """A process that ended well. time_s, cpu_s: wall and processor time [s]. peak_bytes: most memory in use."""

    time_s: float
    cpu_s: float
    peak_bytes: int


def time_process(*arguments: str, folder: Path | None = None) -> Ended:
    """Run Python with these arguments to its end, in a folder. Raises RuntimeError with what it said when it fails.

    Modules are compiled once, as those of an installed package are, also where the environment forbids Python to keep that.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command, started = [sys.executable, *arguments], time.perf_counter()
    process = subprocess.Popen(command, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = process.stderr.read() if process.stderr else b""
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{' '.join(command)} failed: {said.decode(errors='replace')[-2000:]}")
    return Ended(time.perf_counter() - started, used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss)
