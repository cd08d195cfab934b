"""Signals of lines of a frame, from its raw file and that of a dark frame."""

from dataclasses import dataclass

import numpy as np

from simulator.measurement.shutter_check.frames import ShutterBench, TakenFrame
from simulator.raw.raw_reader import read_raw_file

CLIPPED = 1e-3  # share of codes 0 in a dark frame above which its mean is no black level


@dataclass(frozen=True)
class LineReader:
    """Reads frames as lines in the order in which the shutter opens them.

    by_columns: whether lines are columns. is_reversed: whether the last one is opened first.
    """

    by_columns: bool
    is_reversed: bool

    def read(self, frame: TakenFrame) -> np.ndarray:
        """Return codes above black, (lines, photosites of a line) float64 [DN]. Raises PhotositeError.

        Black is the mean of the dark frame at each place of the 2 x 2 block of the filter; the black level of the metadata
        where the dark frame is clipped.
        """
        raw, dark = read_raw_file(frame.path), read_raw_file(frame.dark)
        is_clipped = float(np.mean(dark.mosaic == 0)) > CLIPPED
        codes = raw.mosaic.astype(np.float64)
        for y in range(2):
            for x in range(2):
                codes[y::2, x::2] -= raw.black_level_dn[y, x] if is_clipped else dark.mosaic[y::2, x::2].mean(dtype=np.float64)
        lines = codes.T if self.by_columns else codes
        return lines[::-1] if self.is_reversed else lines

    def means(self, frame: TakenFrame) -> np.ndarray:
        """Return the mean of each line above black, (lines,) float64 [DN]. Raises PhotositeError."""
        return self.read(frame).mean(axis=1)


def line_reader(bench: ShutterBench) -> LineReader:
    """Return the reader of a bench's frames."""
    return LineReader(bench.by_columns, bench.is_reversed)


def over_flat(bench: ShutterBench, frame: TakenFrame, flat: TakenFrame) -> np.ndarray:
    """Return a frame over the mean of a frame of even light at each place of the 2 x 2 block, (lines, photosites) float64."""
    reader = line_reader(bench)
    light, even = reader.read(frame), reader.read(flat)
    for y in range(2):
        for x in range(2):
            light[y::2, x::2] /= even[y::2, x::2].mean()
    return light
