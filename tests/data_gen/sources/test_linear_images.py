"""Linear pictures and spectral cubes as a camera sees them: the integral in float64, the exposure where it was asked."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.camera_builders import small_camera
from helpers.picture_files import put
from helpers.raw_frame import random_frame

from data_gen.sources.linear_images import LinearImages
from data_gen.sources.spectral_cubes import SpectralCubes
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, reflectance_basis
from simulator.config import load_camera
from simulator.errors import PhotositeError
from simulator.raw.dng.writer import dng_bytes


@pytest.fixture(scope="module")
def camera():
    return load_camera("sony_a7s2")


def read(source, name, seed=0):
    return source.read(name, np.random.default_rng(seed))


def photons(camera, light, grid=WAVELENGTHS_NM):
    """Relative electrons per reflectance at each wavelength, (wavelengths, channels), by trapezoids of 0.02 nm.

    Light times reflectance is linear between the wavelengths, the response between its own.
    """
    fine = np.linspace(grid[0], grid[-1], round((grid[-1] - grid[0]) / 0.02) + 1)
    steps = np.full(fine.size, 0.02)
    steps[[0, -1]] /= 2
    curves = [np.interp(fine, camera.response.wavelengths_nm, c, 0, 0) for c in camera.response.quantum_efficiency.T]
    triangles = np.stack([np.interp(fine, grid, row) for row in np.eye(len(grid))])
    return triangles @ (np.stack(curves, axis=-1) * (fine * steps)[:, None]) * illuminant(light, grid)[:, None]


def linear(height=12, width=14, channels=3, seed=1):
    return (np.random.default_rng(seed).random((height, width, channels)) ** 3 * 5).astype(np.float32)


@pytest.mark.parametrize("light", ["D65", "A"])
@pytest.mark.parametrize("name", ["a.exr", "a.hdr", "a.tif", "a.npy"])
def test_colours_are_integrals_over_light_and_response(tmp_path, camera, light, name):
    pixels = linear()
    put(tmp_path / name, pixels)
    picture = read(LinearImages(tmp_path, camera, (light,)), name)
    expected = pixels.astype(np.float64) @ reflectance_basis("mallett2019") @ photons(camera, light)
    expected *= 0.9 / np.percentile(expected.max(axis=2), 99)
    tolerance = {"rtol": 0.02, "atol": 0.02} if name.endswith("hdr") else {"rtol": 2e-6}  # RGBE keeps 8 bits
    np.testing.assert_allclose(picture.signal, expected, **tolerance)
    white = photons(camera, light).sum(axis=0)
    np.testing.assert_allclose(picture.white_balance, white[1] / white, rtol=1e-6)
    assert picture.cfa is None and picture.signal.dtype == np.float32 and picture.color_matrix is not None


def test_the_percentile_gets_its_signal_and_lights_go_beyond(tmp_path, camera):
    pixels = linear(40, 50)
    pixels[3, 4] = 1e4
    put(tmp_path / "a.exr", pixels)
    signal = read(LinearImages(tmp_path, camera, exposed_percentile=90.0, exposed_signal=0.4), "a.exr").signal
    assert np.mean(signal.max(axis=2) <= 0.4) == pytest.approx(0.9, abs=1 / 2000)
    assert signal.max() > 100


def test_grey_is_neutral_and_a_monochrome_camera_sees_one_plane(tmp_path, camera):
    put(tmp_path / "a.npy", linear(channels=1)[..., 0])
    picture = read(LinearImages(tmp_path, camera, ("A",)), "a.npy")
    balanced = picture.signal * picture.white_balance
    np.testing.assert_allclose(balanced[..., 0], balanced[..., 2], rtol=1e-5)
    mono = read(LinearImages(tmp_path, small_camera(cfa="MONO")), "a.npy")
    assert mono.signal.shape == (12, 14) and mono.cfa == "MONO"
    np.testing.assert_allclose(
        mono.signal / mono.signal.max(), linear(channels=1)[..., 0] / linear(channels=1).max(), rtol=1e-6
    )


@pytest.mark.parametrize("quantity", ["reflectance", "radiance"])
def test_a_cube_is_integrated_over_the_response(tmp_path, camera, quantity):
    grid = np.arange(400.0, 701.0, 20.0)
    cube = linear(channels=grid.size)
    put(tmp_path / "a.npy", cube)
    np.savetxt(tmp_path / "nm.txt", grid)
    picture = read(SpectralCubes(tmp_path, camera, tmp_path / "nm.txt", quantity, ("A",)), "a.npy")
    if quantity == "reflectance":  # the light is known every 5 nm
        between = np.stack([np.interp(np.arange(400.0, 701.0, 5.0), grid, row) for row in np.eye(grid.size)])
        seen = between @ photons(camera, "A", np.arange(400.0, 701.0, 5.0))
        white = seen.sum(axis=0)
    else:
        white = photons(camera, "A", grid).sum(axis=0)
        seen = photons(camera, "A", grid) / illuminant("A", grid)[:, None]
    expected = cube.astype(np.float64) @ seen
    np.testing.assert_allclose(picture.signal, expected * 0.9 / np.percentile(expected.max(axis=2), 99), rtol=2e-6)
    np.testing.assert_allclose(picture.white_balance, white[1] / white, rtol=1e-6)


def test_the_file_of_wavelengths_is_no_cube(tmp_path, camera):
    put(tmp_path / "a.npy", linear(channels=4))
    np.save(tmp_path / "nm.npy", np.array([450.0, 500, 550, 600]))
    assert SpectralCubes(tmp_path, camera, tmp_path / "nm.npy").names() == ("a.npy",)


def test_other_wavelengths_of_a_folder_of_cubes_are_told(tmp_path, camera):
    put(tmp_path / "a.npy", linear(channels=4))
    found = []
    for last_nm in (600, 610):
        np.save(tmp_path / "nm.npy", np.array([450.0, 500, 550, last_nm]))
        found.append(list(SpectralCubes(tmp_path, camera, tmp_path / "nm.npy").fingerprints()))
    assert found[0] != found[1]
    (tmp_path / "nm.npy").unlink()
    with pytest.raises(PhotositeError, match=r"wavelengths = .*nm\.npy: cannot be read .*; check the path"):
        list(SpectralCubes(tmp_path, camera, tmp_path / "nm.npy").fingerprints())


def test_bad_files_are_refused_by_name(tmp_path, camera):
    source = LinearImages(tmp_path, camera)
    broken = linear()
    broken[2, 3] = np.nan
    for name, pixels in {
        "nan.exr": broken,
        "dark.exr": 0 * linear(),
        "minus.exr": linear() - 1,
        "two.npy": linear(channels=2),
    }.items():
        put(tmp_path / name, pixels)
    (tmp_path / "text.exr").write_text("no picture")
    (tmp_path / "raw.tif").write_bytes(dng_bytes(random_frame()))
    cases = {
        "nan.exr": r"^linear_images = .*nan\.exr: NaN in 1 of 168 pixels",
        "dark.exr": r"exposed_percentile = 99.0: .*dark\.exr is black there",
        "minus.exr": r"^linear_images = .*minus\.exr: negative radiance in",
        "two.npy": r"^linear_images = .*two\.npy: has 2 channels",
        "raw.tif": r"^linear_images = .*raw\.tif: is a raw file of a camera.* --output linear_srgb --out \S*raw\.exr$",
        "text.exr": r"^linear_images = .*text\.exr: cannot be read",
        "gone.exr": r"^linear_images = .*gone\.exr: no such file",
    }
    for name, message in cases.items():
        with pytest.raises(PhotositeError, match=message):
            read(source, name)
    assert read(replace(source, negative="clip"), "minus.exr").signal.min() == 0


def test_bad_cubes_are_refused_by_name(tmp_path, camera):
    put(tmp_path / "a.npy", linear(channels=4))
    (tmp_path / "nm.txt").write_text("450 500 550")
    with pytest.raises(PhotositeError, match=r"^wavelengths of .*a\.npy = .*nm\.txt: holds 3 wavelengths"):
        read(SpectralCubes(tmp_path, camera, tmp_path / "nm.txt"), "a.npy")
    with pytest.raises(PhotositeError, match=r"^spectral_cubes = .*a\.npy: names no wavelengths"):
        read(SpectralCubes(tmp_path, camera), "a.npy")


@pytest.mark.parametrize("kind", [LinearImages, SpectralCubes])
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"exposed_percentile": 0.0}, "exposed_percentile = 0.0"),
        ({"exposed_signal": -1.0}, "exposed_signal = -1.0"),
        ({"illuminants": ("D66",)}, "no such illuminant"),
        ({"extensions": ("EXR",)}, "endings in lower case"),
    ],
)
def test_wrong_settings_are_refused(tmp_path, camera, kind, changes, message):
    with pytest.raises(PhotositeError, match=message):
        kind(tmp_path, camera, **changes)
