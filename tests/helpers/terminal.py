"""The command `photosite` in a terminal of its own, as narrow as one likes."""

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios
from pathlib import Path

ROOT = Path(__file__).parents[2]


def run_in_terminal(*words: str, columns: int = 40, **environment: str) -> str:
    """Return all that a command writes to a terminal, its control characters included. environment: over that of the test."""
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 30, columns, 0, 0))
    kept = {name: value for name, value in os.environ.items() if name not in ("FORCE_COLOR", "NO_COLOR", "COLUMNS", "TERM")}
    command = [sys.executable, "-m", "simulator", *words]
    told = b""
    with subprocess.Popen(
        command, stdin=its, stdout=its, stderr=its, env=kept | {"PYTHONPATH": str(ROOT)} | environment
    ) as process:
        os.close(its)
        while True:
            try:
                part = os.read(ours, 2**16)
            except OSError:  # Linux's answer when the other end is closed
                break
            if not part:
                break
            told += part
        assert process.wait() == 0, told
    os.close(ours)
    return told.decode("utf-8")
