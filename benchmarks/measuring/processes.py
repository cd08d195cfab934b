"""Whole processes, timed: what a start costs, and how much memory is used at most."""

import json
import os
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
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
    This file as a small process of its own starts it: what starts a process counts as that process's memory until it runs.
    """
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    command = [sys.executable, __file__, *arguments]
    found = subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False)
    if found.returncode != 0:
        raise RuntimeError(f"{' '.join(arguments)} failed: {found.stderr.decode(errors='replace')[-2000:]}")
    return Ended(**json.loads(found.stdout))


def _start(arguments: list[str]) -> int:
    """Run Python with these arguments, print what it took as JSON, and return its exit status."""
    started = time.perf_counter()
    process = subprocess.Popen([sys.executable, *arguments], stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    ended = Ended(time.perf_counter() - started, used.ru_utime + used.ru_stime, 1024 * used.ru_maxrss)
    print(json.dumps(asdict(ended)))
    return process.returncode


if __name__ == "__main__":
    sys.exit(_start(sys.argv[1:]))
