"""Spectral cubes of any kind of file, as pictures whose channels are named by their wavelength."""

from pathlib import Path

from simulator.errors import require
from simulator.scene.envi_file import find_envi_header, read_envi
from simulator.scene.isetcam_file import read_isetcam
from simulator.scene.pixel_file import PixelFile, read_pixels


def read_cube(path: Path, key: str) -> PixelFile:
    """Read an EXR or .npy as `read_pixels` does, a .mat of ISETCam, or an ENVI cube by its header or its data.

    key: configuration key for messages. Raises PhotositeError for a file that is missing, damaged or none of these.
    """
    require(path.exists(), key, path, "no such file; check the path")
    require(path.is_file(), key, path, "not a file; give the path of a spectral cube")
    if path.suffix.lower() == ".mat":
        return read_isetcam(path, key)
    if (header := find_envi_header(path)) is not None:
        return read_envi(header, path, key)
    return read_pixels(path, key)
