"""Clean pictures from raw files with little noise: long exposures, averages, or frames that were never noisy."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import numpy as np

from data_gen.sources.folder import FolderSource, check_extensions
from data_gen.sources.source import CleanImage
from simulator.color.reproducible import nine_digits_each
from simulator.errors import require
from simulator.raw.raw_reader import RawFile, read_raw_file

KEY = "raw_files"
EXTENSIONS = (".dng", ".arw", ".cr2", ".cr3", ".nef", ".nrw", ".orf", ".pef", ".raf", ".rw2")


@dataclass(frozen=True)
class RawFiles(FolderSource):
    """Raw files as LibRaw reads them: (code - black) / (white - black), each file with its own filter pattern.

    Codes below black, which noise makes, become 0: no light is negative.
    raw_files: folder, with all folders in it.
    extensions: of the files to take, in lower case.
    """

    key: ClassVar[str] = KEY
    raw_files: Annotated[Path, "folder of raw files"]
    extensions: tuple[str, ...] = EXTENSIONS

    def __post_init__(self) -> None:
        check_extensions(self.extensions)

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        """Read one file; nothing is drawn.

        Raises PhotositeError for a file that is missing or damaged, with another pattern than 2 x 2 of R, G, G, B or none
        (X-Trans), or with levels that leave no range.
        """
        raw = read_raw_file(self.raw_files / name)
        span_dn = raw.white_level_dn - raw.black_level_dn
        rule = f"{raw.path}: not above its black level; the file tells wrong levels, take it out of the folder"
        require(bool((span_dn > 0).all()), "white level", f"{raw.white_level_dn} DN", rule)
        signal = np.empty(raw.mosaic.shape, np.float32)
        for row, column in ((0, 0), (0, 1), (1, 0), (1, 1)):
            above_dn = raw.mosaic[row::2, column::2] - np.float32(raw.black_level_dn[row, column])
            signal[row::2, column::2] = above_dn / np.float32(span_dn[row, column])
        return CleanImage(np.maximum(signal, np.float32(0)), raw.cfa, _white_balance(raw), raw.color_matrix)


def _white_balance(raw: RawFile) -> tuple[float, float, float]:
    """Return the gains as shot; else those that the colour matrix gives for daylight; all 1 for MONO."""
    if raw.cfa == "MONO":
        return 1.0, 1.0, 1.0
    if raw.white_balance is not None:
        return raw.white_balance
    rule = f"{raw.path}: tells neither white balance nor colour matrix; take it out of the folder"
    require(raw.color_matrix is not None, "white balance", "none", rule)
    white = np.array(raw.color_matrix) @ (0.95047, 1.0, 1.08883)  # D65, ASTM E308
    red, green, blue = nine_digits_each(white[1] / white).tolist()
    return red, green, blue
