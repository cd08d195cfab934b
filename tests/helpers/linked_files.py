"""Inputs of several files, of which a shot names one: an ENVI cube, and a list of PSF files."""

from pathlib import Path

import numpy as np

HEADER = """\
ENVI
samples = 32
lines = 24
bands = 5
data type = 4
interleave = bsq
byte order = 0
wavelength units = nm
wavelength = {400, 475, 550, 625, 700}
"""
SHOT = """\
scene: {spectral_cube: NAMED, depth: 2 m}
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m, psf: psf.csv}
exposure: {time: 1/100 s, iso: 100}
camera: {base: sony_a7s2, width: 32, height: 24}
"""
FILES = ("cube.hdr", "cube.img", "psf.csv", "kernels/green.npy", "kernels/rest.npy")


def put_cube(folder: Path, radiance: float = 0.01) -> None:
    """Write cube.img with columns of this radiance and its half [W m^-2 sr^-1 nm^-1], and cube.hdr unless it stands."""
    if not (folder / "cube.hdr").exists():
        (folder / "cube.hdr").write_text(HEADER)
    planes = np.full((5, 24, 32), radiance, "<f4")
    planes[..., ::2] *= 0.5
    planes.tofile(folder / "cube.img")


def put_kernel(folder: Path, name: str, size: int) -> None:
    """Write an even kernel of size x size photosites into folder/kernels."""
    (folder / "kernels").mkdir(exist_ok=True)
    np.save(folder / "kernels" / f"{name}.npy", np.full((size, size), 1.0 / size**2))


def put_list(folder: Path) -> None:
    """Write psf.csv with a kernel of green and one of the other colours, which two lines name."""
    for name, size in (("green", 1), ("rest", 3)):
        put_kernel(folder, name, size)
    lines = ("green,kernels/green.npy", "red,kernels/rest.npy", "blue,kernels/rest.npy")
    (folder / "psf.csv").write_text("\n".join(("channel,file", *lines)) + "\n")


def put_shot(folder: Path, named: str = "cube.hdr") -> Path:
    """Write FILES and a shot of them, and return its path. named: file of the cube that the shot names."""
    put_cube(folder)
    put_list(folder)
    path = folder / "linked.yaml"
    path.write_text(SHOT.replace("NAMED", named))
    return path
