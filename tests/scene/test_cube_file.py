"""Spectral cubes of other programs: ISETCam's .mat from Octave, ENVI from Spectral Python, and all layouts of ENVI."""

from pathlib import Path

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.scene.envi_file import parse_header
from simulator.scene.spectral_cube import SpectralCubeScene

FILES = Path(__file__).parents[1] / "files"  # made by the scripts beside them
PLANCK_J_S, LIGHT_M_PER_S = 6.62607015e-34, 2.99792458e8


def radiance(scene):
    return scene.planes.astype(np.float64) @ scene.spectra_w_m2_sr_nm


def test_a_linear_model_of_isetcam_becomes_radiance():
    """The photons of write_isetcam.m, anew in float64, as energy."""
    own_nm = np.arange(400.0, 701.0, 10.0)
    t = (own_nm - 400) / 300
    first, second = np.array([[1, 2, 3], [4, 5, 6]]), np.array([[0, 1, 0], [-1, 0, 2]])
    photons = first[..., None] * 1e13 * (1 + t) + second[..., None] * 3e13 * np.sin(np.pi * t) + 2e12 * (1 - t)
    scene = SpectralCubeScene(FILES / "isetcam_linear.mat").load()
    assert scene.wavelengths_nm.tolist() == own_nm.tolist()
    np.testing.assert_allclose(radiance(scene), photons * PLANCK_J_S * LIGHT_M_PER_S / (own_nm * 1e-9), rtol=1e-6)
    assert any("write field_of_view: 10 deg" in note for note in scene.notes)


def test_photons_of_isetcam_become_radiance():
    scene = SpectralCubeScene(FILES / "isetcam_photons.mat").load()
    photons = 1e14 * np.stack([[[1, 2, 3], [4, 5, 6]], [[2, 2, 2], [2, 2, 2]], [[6, 5, 4], [3, 2, 1]]], axis=-1)
    energy_j = PLANCK_J_S * LIGHT_M_PER_S / np.array([450e-9, 550e-9, 650e-9])
    np.testing.assert_allclose(radiance(scene), photons * energy_j, rtol=1e-6)


def save_mat(path, **variables):
    scipy_io = pytest.importorskip("scipy.io")
    scipy_io.savemat(path, variables)
    return path


def test_negative_photons_are_set_to_nothing_and_told(tmp_path):
    cube = np.ones((2, 2, 3))
    cube[0, 0, 1] = -1.0
    scene = SpectralCubeScene(save_mat(tmp_path / "a.mat", data=cube, wavelength=[450.0, 550.0, 650.0])).load()
    assert scene.planes[0, 0, 1] == 0 and any("8.3 % of its values were negative" in note for note in scene.notes)


def test_a_file_of_another_program_is_refused(tmp_path):
    with pytest.raises(PhotositeError, match="holds rad, bands; needs mcCOEF"):
        SpectralCubeScene(save_mat(tmp_path / "a.mat", rad=np.ones((2, 2, 3)), bands=[450, 550, 650])).load()
    with pytest.raises(PhotositeError, match=r"photons of shape \(2, 2, 3\) at 2 wavelengths"):
        SpectralCubeScene(save_mat(tmp_path / "b.mat", photons=np.ones((2, 2, 3)), wave=[450, 550])).load()
    (tmp_path / "c.mat").write_bytes(b"MATLAB 5.0 MAT-file" + b"x" * 200)
    with pytest.raises(PhotositeError, match="scene.spectral_cube = .*c.mat: cannot be read"):
        SpectralCubeScene(tmp_path / "c.mat").load()


@pytest.mark.parametrize("name", ["envi.hdr", "envi.img"])
def test_a_cube_of_spectral_python_is_read(name):
    rows, columns, bands = np.indices((3, 4, 4))
    scene = SpectralCubeScene(FILES / name, quantity="reflectance", luminance_cd_m2=10.0).load()
    np.testing.assert_allclose(scene.planes, (1000 * rows + 100 * columns + 10 * bands + 1) / 1e4, rtol=1e-6)
    assert scene.wavelengths_nm[0] == 450.0 and scene.wavelengths_nm[-1] == 600.0
    assert any("1 bad bands" in note for note in scene.notes)


def save_envi(folder, cube, interleave="bsq", byte_order=0, offset=0, **more):
    """Write (height, width, bands) as ENVI; more: fields of the header, names with _ for blanks, None to leave one out."""
    codes = {"u1": 1, "i2": 2, "i4": 3, "f4": 4, "f8": 5, "u2": 12, "u4": 13, "i8": 14, "u8": 15}
    axes = {"bsq": (2, 0, 1), "bil": (0, 2, 1), "bip": (0, 1, 2)}[interleave]
    stored = cube.astype(cube.dtype.newbyteorder(">" if byte_order else "<")).transpose(axes)
    (folder / "cube.dat").write_bytes(b"\xff" * offset + stored.tobytes())
    fields = {"samples": cube.shape[1], "lines": cube.shape[0], "bands": cube.shape[2], "header offset": offset}
    fields |= {"data type": codes[cube.dtype.str[1:]], "interleave": interleave, "byte order": byte_order}
    fields |= {"wavelength": "{450,\n 550,\n 650}", "wavelength units": "Nanometers"}
    fields |= {name.replace("_", " "): value for name, value in more.items()}
    lines = [f"{name} = {value}" for name, value in fields.items() if value is not None]
    (folder / "cube.hdr").write_text("ENVI\ndescription = {\n  a = b, a cube}\n; a remark\n" + "\n".join(lines) + "\n")
    return folder / "cube.hdr"


@pytest.mark.parametrize("interleave", ["bsq", "bil", "bip"])
@pytest.mark.parametrize("kind", ["u1", "i2", "f4", "f8", "u2"])
@pytest.mark.parametrize("byte_order", [0, 1])
def test_all_layouts_of_envi_hold_the_same_cube(tmp_path, interleave, kind, byte_order):
    cube = np.random.default_rng(1).integers(0, 100, (3, 5, 3)).astype(kind)
    header = save_envi(tmp_path, cube, interleave, byte_order, offset=7)
    for path in (header, tmp_path / "cube.dat"):
        scene = SpectralCubeScene(path).load()
        assert np.array_equal(scene.planes, cube.astype(np.float32)) and scene.wavelengths_nm.tolist() == [450.0, 550.0, 650.0]


def test_gains_and_offsets_make_radiance(tmp_path):
    cube = np.arange(18, dtype=np.uint16).reshape(2, 3, 3)
    header = save_envi(tmp_path, cube, data_gain_values="{0.5, 1, 2}", data_offset_values="{1, 0, 3}")
    np.testing.assert_allclose(SpectralCubeScene(header).load().planes, cube * [0.5, 1, 2] + [1, 0, 3], rtol=1e-6)


def test_integer_reflectances_need_a_scale(tmp_path):
    """Radiance in integers is scaled by its luminance; nothing says what 40000 of a reflectance is."""
    cube = np.full((2, 3, 3), 40000, np.uint16)
    told = "scene.spectral_cube = .*cube.hdr: holds integers without a scale.*reflectance scale factor"
    for fields in ({}, {"reflectance_scale_factor": 0}, {"data_offset_values": "{1, 1, 1}"}, {"data_ignore_value": 0}):
        with pytest.raises(PhotositeError, match=told):
            SpectralCubeScene(save_envi(tmp_path, cube, **fields), None, "reflectance", 100.0).load()
    for fields in ({"reflectance_scale_factor": 50000}, {"data_gain_values": "{2e-5, 2e-5, 2e-5}"}):
        scene = SpectralCubeScene(save_envi(tmp_path, cube, **fields), None, "reflectance", 100.0).load()
        np.testing.assert_allclose(scene.planes, 0.8, rtol=1e-6)
    assert SpectralCubeScene(save_envi(tmp_path, cube)).load().planes.max() == 40000.0


def test_wavelengths_may_come_from_a_file_and_lack_a_unit(tmp_path):
    cube = np.ones((2, 3, 3), np.float32)
    header = save_envi(tmp_path, cube, wavelength_units="Unknown", wavelength="{0.45, 0.55, 0.65}")
    scene = SpectralCubeScene(header).load()
    assert scene.wavelengths_nm == pytest.approx([450, 550, 650]) and any(
        "taken as micrometers" in note for note in scene.notes
    )
    header = save_envi(tmp_path, cube, wavelength=None)
    with pytest.raises(PhotositeError, match="names no wavelengths"):
        SpectralCubeScene(header).load()
    np.savetxt(tmp_path / "nm.txt", [500.0, 510.0, 520.0])
    assert SpectralCubeScene(header, tmp_path / "nm.txt").load().wavelengths_nm.tolist() == [500.0, 510.0, 520.0]


@pytest.mark.parametrize("own", [True, False])
def test_bad_bands_are_left_out_whoever_states_the_wavelengths(tmp_path, own):
    cube = np.ones((2, 3, 4), np.float32) * (1, 1e6, 2, 3)
    fields = {"wavelength": "{450, 500, 550, 650}"} if own else {"wavelength": None}
    header = save_envi(tmp_path, cube.astype(np.float32), bbl="{1, 0, 1, 1}", **fields)
    np.savetxt(tmp_path / "nm.txt", [450.0, 500.0, 550.0, 650.0])
    scene = SpectralCubeScene(header, None if own else tmp_path / "nm.txt").load()
    assert np.array_equal(scene.planes, cube[..., [0, 2, 3]]) and scene.wavelengths_nm.tolist() == [450.0, 550.0, 650.0]
    assert any("1 bad bands" in note for note in scene.notes)


@pytest.mark.parametrize("kind", [np.int16, np.float32])
def test_bands_without_data_are_refused_only_where_they_are_used(tmp_path, kind):
    cube = np.full((2, 3, 5), 4, kind)
    cube[..., 1] = cube[..., 4] = -9999  # a bad band, and one in the infrared behind one
    fields = {"wavelength": "{450, 550, 650, 800, 1400}", "data_ignore_value": -9999, "data_gain_values": "{1, 1, 0.5, 1, 1}"}
    scene = SpectralCubeScene(save_envi(tmp_path, cube, bbl="{1, 0, 1, 1, 1}", **fields)).load()
    assert scene.wavelengths_nm.tolist() == [450.0, 650.0, 780.0] and np.unique(scene.planes).tolist() == [2.0, 4.0]
    told = (
        r"scene.spectral_cube = .*cube.hdr: has no data \(data ignore value -9999\) in 6 of 6 pixels, .*crop these pixels away"
    )
    with pytest.raises(PhotositeError, match=told):
        SpectralCubeScene(save_envi(tmp_path, cube, **fields)).load()


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"data_type": 6}, "has data type 6; known are"),
        ({"lines": None}, "states `lines` as nothing"),
        ({"bands": 0}, "is a cube of 2 x 3 x 0"),
        ({"interleave": "bsq", "lines": 20}, "holds 72 bytes, but cube.hdr tells of 720; the file is cut short"),
        ({"wavelength": "{450, 550}"}, "has 2 wavelengths for 3 bands"),
        ({"wavelength": "{450, red, 650}"}, "has words in its list `wavelength`"),
        ({"wavelength_units": "Wavenumber"}, "wavelengths in wavenumber"),
        ({"file_compression": 1}, "is compressed"),
        ({"data_ignore_value": 1}, "has no data .* in 6 of 6 pixels"),
        ({"data_gain_values": "{1, 2}"}, "has 2 data gain values"),
        ({"bbl": "{1}"}, "a list of 1 bad bands"),
        ({"bbl": "{0, 0, 0}"}, "marks all of its 3 bands as bad"),
    ],
)
def test_a_bad_header_is_one_message(tmp_path, fields, says):
    header = save_envi(tmp_path, np.ones((2, 3, 3), np.float32), **fields)
    with pytest.raises(PhotositeError, match=says):
        SpectralCubeScene(header).load()


def test_a_header_without_data_is_refused(tmp_path):
    header = save_envi(tmp_path, np.ones((2, 3, 3), np.float32))
    (tmp_path / "cube.dat").unlink()
    with pytest.raises(PhotositeError, match="is a header without data; put them beside it as one of cube, cube.img"):
        SpectralCubeScene(header).load()


def test_braces_may_run_over_lines():
    fields = parse_header("ENVI\nWavelength   Units = nm\nwavelength = {\n 1,\n 2}\nmap info = {UTM, x = 3}\nsamples = 4\n")
    assert fields == {"wavelength units": "nm", "wavelength": "1,\n 2", "map info": "UTM, x = 3", "samples": "4"}
