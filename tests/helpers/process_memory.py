"""Memory that this process has in use."""

import os
from pathlib import Path

import pytest

STATUS = Path("/proc/self/statm")
reads_memory = pytest.mark.skipif(not STATUS.exists(), reason="the resident memory is read from /proc")


def resident_bytes() -> int:
    return int(STATUS.read_text(encoding="ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
