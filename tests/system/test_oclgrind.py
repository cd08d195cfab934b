"""Kernels under oclgrind, which interprets them and reports reads and writes out of bounds, and data races.

What its compiler warns of counts, too. Its check for uninitialised values is not used: it reports values that were written;
test_defocus.py poisons memory instead.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from helpers import oclgrind_case

PATHS = f"{Path(__file__).parents[2]}:{Path(__file__).parents[1]}"
ENVIRONMENT = os.environ | {"PYTHONPATH": PATHS, "PYOPENCL_NO_CACHE": "1"}  # a compiler warns only where it builds
CASES = [
    "sharp RGGB",
    "one depth MONO",
    "depth map GRBG",
    "depth map window",
    "layers RGGB",
    "layers RGGB rims",
    "layers RGGB window pair",
    "one depth RRGG/RRGG/GGBB/GGBB window",
    "sharp RRGG/RRGG/GGBB/GGBB window remosaiced",
    "sharp RGGB window blooming",
    "sharp RRRGGG/RRRGGG/RRRGGG/GGGBBB/GGGBBB/GGGBBB remosaiced",
    "sharp MONO near",
    "sharp RGGB window near",
    "sharp RGGB window near averaged veiled",
    "sharp RGGB covered",
    "sharp RGGB readings near",
    "sharp RGGB window lines",
    "sharp RGGB window moving",
    "sharp MONO moving rolling",
    "sharp RGGB window shifting",
    "sharp MONO shifting",
    "sharp RGGB window shifting apart",
    "sharp MONO shifting apart",
    "sharp RGGB window shifting apart turning",
    "sharp RGGB window shifting apart coarse",
    "sharp RGGB window shifting apart finer",
    "layers RGGB window shifting apart",
    "layers MONO moving",
    "one depth MONO moving",
    "one depth RGGB window moving",
    "rays",
    "fine",
    "coarse",
    "bands",
    "distorted",
    "steps",
    "wide",
    "joint",
    "joint lamps",
    "spread",
    "slabs",
    "vectors",
    "lamp",
    "lamps",
    "far spread",
    "columns",
]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(shutil.which("oclgrind") is None, reason="oclgrind is not installed (Debian: apt install oclgrind)"),
]


@pytest.mark.parametrize("case", CASES)
def test_nothing_is_reported(case):
    command = ["oclgrind", "--data-races", sys.executable, oclgrind_case.__file__, case]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, env=ENVIRONMENT)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout.strip() == "done Oclgrind Simulator" and not done.stderr.strip(), (done.stdout + done.stderr)[:2000]
