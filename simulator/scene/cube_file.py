"""Spectral cubes of any kind of file, as pictures whose channels are named by their wavelength."""

import os
from pathlib import Path

from simulator.errors import check_file
from simulator.scene.envi_file import find_envi_header, find_other_envi_file, read_envi
from simulator.scene.isetcam_file import read_isetcam
from simulator.scene.pixel_file import PixelFile, read_pixels


def read_cube(path: Path, key: str) -> PixelFile:
    """Read an EXR or .npy as `read_pixels` does, a .mat of ISETCam, or an ENVI cube by its header or its data.

    key: configuration key for messages. Raises PhotositeError for a file that is missing, damaged or none of these.
    """
    check_file(path, key)
    if path.suffix.lower() == ".mat":
        return read_isetcam(path, key)
    if (header := find_envi_header(path)) is not None:
        return read_envi(header, path, key)
    return read_pixels(path, key)


def files_beside_cube(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """Return the files that are read with a cube: the data of an ENVI header, or the header of its data."""
    path = Path(path)
    if path.suffix.lower() == ".mat":
        return ()
    try:
        other = find_other_envi_file(path)
    except OSError:  # the file is not there, or cannot be read
        return ()
    return () if other is None else (other,)
