"""Codes of raw files as readers give them that never saw the frames: a fresh process has no old buffer to show."""

import subprocess
import sys
from collections.abc import Iterable
from pathlib import Path

import numpy as np

LIBRAW = """
import sys, numpy as np, rawpy
found = {}
for path in sys.argv[2:]:
    with rawpy.imread(path) as frame:
        found[path] = frame.raw_image_visible.copy()
np.savez(sys.argv[1], **found)
"""


def libraw_codes(paths: Iterable[Path], folder: Path) -> dict[str, np.ndarray]:
    """Visible codes by path, read by rawpy in one new process."""
    found = folder / "found.npz"
    subprocess.run([sys.executable, "-c", LIBRAW, found, *paths], check=True, timeout=120)
    return dict(np.load(found))


def dcraw_codes(path: Path, shape: tuple[int, int]) -> np.ndarray:
    """Codes of one file as `dcraw -D -4` writes them: a PGM of 16 bits, high byte first, at the end of its output."""
    out = subprocess.run(["dcraw", "-D", "-4", "-c", path], capture_output=True, check=True).stdout
    return np.frombuffer(out[-2 * shape[0] * shape[1] :], ">u2").reshape(shape)
