"""Spectral cubes: radiance comes out as it went in, whatever the file calls its wavelengths."""

import numpy as np
import OpenImageIO as oiio
import pytest

from simulator.color.spectra import illuminant, luminance_cd_m2
from simulator.errors import PhotositeError
from simulator.scene.arrays import scene_from_spectra
from simulator.scene.depth import DepthChannel
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.spectral_cube import SpectralCubeScene
from simulator.scene.wavelengths import parse_channel


def write_exr(path, pixels, names):
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], oiio.FLOAT)
    spec.channelnames = tuple(names)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec) and output.write_image(np.ascontiguousarray(pixels)) and output.close(), (
        output.geterror()
    )
    return path


def cube(bands, height=3, width=4):
    return np.random.default_rng(2).random((height, width, bands)).astype(np.float32) + 0.1


def save(folder, pixels, wavelengths):
    np.save(folder / "cube.npy", pixels)
    np.savetxt(folder / "nm.txt", wavelengths)
    return {"spectral_cube": folder / "cube.npy", "wavelengths": folder / "nm.txt"}


def radiance(scene):
    return scene.planes.astype(np.float64) @ scene.spectra_w_m2_sr_nm


NAMINGS = ["{}nm", "w{}", "{}", "S0.{}nm", "S0.{},000000nm", "{}.000nm", "w{}.000", "spectrum.w{}.000nm"]


@pytest.mark.parametrize("naming", NAMINGS)
def test_channels_named_by_wavelength_become_planes_in_order(tmp_path, naming):
    pixels, wavelengths = cube(31), np.arange(400, 701, 10)
    names = [naming.format(nm) for nm in wavelengths]
    order = np.random.default_rng(3).permutation(31)
    file = write_exr(tmp_path / "cube.exr", pixels[..., order], [names[index] for index in order])
    scene = SpectralCubeScene(file).load()
    assert scene.wavelengths_nm.tolist() == wavelengths.tolist()
    assert np.array_equal(scene.planes, pixels)
    assert np.array_equal(radiance(scene), pixels.astype(np.float64))
    assert any("dark outside 400 to 700 nm" in note for note in scene.notes)


def test_fractions_of_a_nanometre_and_other_channels_are_understood(tmp_path):
    pixels = cube(6)
    file = write_exr(tmp_path / "cube.exr", pixels, ("S0.450,5nm", "S0.460,5nm", "S1.450,5nm", "S1.460,5nm", "R", "Z"))
    stored = oiio.ImageInput.open(str(file)).spec().channelnames
    scene = SpectralCubeScene(file, depth_m=DepthChannel()).load()
    assert set(stored) >= {"R", "Z", "S1.450,5nm"}
    assert scene.wavelengths_nm.tolist() == [450.5, 460.5]
    assert np.array_equal(scene.planes, pixels[..., :2]) and np.array_equal(scene.depth_m, pixels[..., 5])


@pytest.mark.parametrize("kind", ["npy", "txt", "csv", "csv with header"])
def test_wavelengths_of_a_npy_cube_come_from_a_file(tmp_path, kind):
    wavelengths = np.arange(380.0, 781.0, 100)
    pixels = cube(5)
    np.save(tmp_path / "cube.npy", pixels[..., ::-1])
    file = tmp_path / f"nm.{kind[:3]}"
    if kind == "npy":
        np.save(file, wavelengths[::-1])
    elif kind == "txt":
        np.savetxt(file, wavelengths[::-1])
    else:
        file.write_text(("wavelength\n" if "header" in kind else "") + ",".join(map(str, wavelengths[::-1])) + "\n")
    scene = SpectralCubeScene(tmp_path / "cube.npy", file).load()
    assert scene.wavelengths_nm.tolist() == wavelengths.tolist() and np.array_equal(scene.planes, pixels)
    assert not scene.notes


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("S0.5,5E-7m", ("S0", 550.0)),
        ("T.0,55um", ("T", 550.0)),
        ("S0.545,0771963THz", ("S0", 550.0)),
        ("S0.55.nm", ("S0", 55.0)),
        ("545.00-555.00nm", ("", 550.0)),
        ("w550", ("", 550.0)),
        ("550", ("", 550.0)),
        ("S0.0nm", ("S0", None)),
        ("R", ("", None)),
        ("5", ("", None)),
    ],
)
def test_a_channel_states_its_wavelength_in_any_unit(name, says):
    group, wavelength_nm = parse_channel(name)
    assert group == says[0] and wavelength_nm == (None if says[1] is None else pytest.approx(says[1], abs=1e-6))


def test_bins_of_wavelengths_are_taken_at_their_middle(tmp_path):
    """Mitsuba 0.6 and RenderToolbox name the bounds of a bin."""
    pixels, edges = cube(4), np.linspace(400.0, 440.0, 5)
    names = [f"{low:.2f}-{high:.2f}nm" for low, high in zip(edges[:-1], edges[1:], strict=True)]
    scene = SpectralCubeScene(write_exr(tmp_path / "cube.exr", pixels, names)).load()
    assert scene.wavelengths_nm.tolist() == [405.0, 415.0, 425.0, 435.0] and np.array_equal(scene.planes, pixels)


def test_a_file_of_the_spectral_layout_holds_reflectance_and_radiance(tmp_path):
    """The layout of Fichet et al. (2021) with both, and reradiation of a fluorescent surface, which is no wavelength's own."""
    pixels = cube(9)
    names = ("R", "G", "B", "S0.450,0nm", "S0.460,0nm", "S1.450,0nm", "T.450,0nm", "T.460,0nm", "T.450,0nm.460,0nm")
    file = write_exr(tmp_path / "cube.exr", pixels, names)
    assert np.array_equal(SpectralCubeScene(file).load().planes, pixels[..., 3:5])
    lit = SpectralCubeScene(file, quantity="reflectance", luminance_cd_m2=10.0).load()
    assert np.array_equal(lit.planes, pixels[..., 6:8])


@pytest.mark.filterwarnings("ignore:Aligning")
def test_files_of_colour_science_are_read(tmp_path):
    """Reflectances of 24 patches, written by colour-science's own code for the layout of Fichet et al. (2021)."""
    colour = pytest.importorskip("colour")
    patches = list(colour.SDS_COLOURCHECKERS["ISO 17321-1"].values())
    truth = np.array([patch.values for patch in patches]).reshape(4, 6, -1)
    layout = colour.io.Specification_Fichet2021(is_emissive=False)
    file = tmp_path / "checker.exr"
    colour.write_spectral_image_Fichet2021(patches, str(file), "float32", layout, shape=truth.shape)
    with pytest.raises(PhotositeError, match="scene.quantity = radiance: .*holds reflectances .channels T."):
        SpectralCubeScene(file).load()
    scene = SpectralCubeScene(file, quantity="reflectance", luminance_cd_m2=100.0).load()
    assert np.array_equal(scene.planes, truth.astype(np.float32))
    assert scene.spectra_w_m2_sr_nm.shape == (81, 81)


def test_even_steps_beyond_the_visible_are_cut_and_noted(tmp_path):
    pixels = cube(61)
    scene = SpectralCubeScene(**save(tmp_path, pixels, np.arange(350, 951, 10))).load()
    assert scene.wavelengths_nm.tolist() == list(range(380, 781, 10))
    assert np.array_equal(scene.planes, pixels[..., 3:44])
    assert any("left out" in note for note in scene.notes)


def test_uneven_wavelengths_are_linear_between_their_neighbours(tmp_path):
    wavelengths = np.array([300.0, 400.0, 413.0, 500.0, 620.0, 900.0])
    pixels = cube(6)
    scene = SpectralCubeScene(**save(tmp_path, pixels, wavelengths)).load()
    assert scene.wavelengths_nm.tolist() == [380.0, 400.0, 413.0, 500.0, 620.0, 780.0]  # cut at 380 and 780 nm
    truth = np.array([np.interp(scene.wavelengths_nm, wavelengths, spectrum) for spectrum in pixels.reshape(-1, 6)])
    assert radiance(scene).reshape(-1, 6) == pytest.approx(truth, rel=1e-6)


def test_uneven_and_even_sampling_of_one_smooth_spectrum_give_the_same_electrons(tmp_path):
    def electrons(wavelengths):
        pixels = (illuminant("3200 K", wavelengths) * np.ones((1, 1, 1))).astype(np.float32)
        scene = SpectralCubeScene(**save(tmp_path, pixels, wavelengths)).load()
        weights = electron_radiance_weights(scene, np.array([420.0, 500.0, 580.0]), np.array([[0.0], [1.0], [0.0]]))
        return (scene.planes @ weights).item()

    uneven = np.sort(np.append(np.arange(380.0, 781.0, 5.0), [381.0, 502.5, 777.7]))
    assert electrons(uneven) == pytest.approx(electrons(np.arange(380.0, 781.0, 5.0)), rel=2e-4)  # the 5 nm sum's own error


def test_radiance_with_a_luminance_is_scaled_to_that_mean(tmp_path):
    files = save(tmp_path, cube(31), np.arange(400, 701, 10))
    scene = SpectralCubeScene(**files, luminance_cd_m2=80.0).load()
    assert luminance_cd_m2(radiance(scene), scene.wavelengths_nm).mean() == pytest.approx(80.0, rel=1e-6)


def test_reflectance_is_lit_and_white_has_the_luminance(tmp_path):
    pixels = np.ones((1, 2, 41), np.float32)
    pixels[0, 1] = 0.25
    files = save(tmp_path, pixels, np.arange(380, 781, 10))
    scene = SpectralCubeScene(**files, quantity="reflectance", luminance_cd_m2=60.0, illuminant="A").load()
    assert luminance_cd_m2(radiance(scene), scene.wavelengths_nm) == pytest.approx(np.array([[60.0, 15.0]]), rel=1e-6)
    assert scene.spectra_w_m2_sr_nm.sum(axis=0) / scene.illuminant == pytest.approx(
        scene.spectra_w_m2_sr_nm[0, 0] / scene.illuminant[0]
    )


BAD_CUBES = {
    "infrared only": (cube(3), [900, 910, 920], "nothing between 380 and 780 nm"),
    "micrometres": (cube(3), [0.4, 0.5, 0.6], "nothing between 380 and 780 nm"),
    "one visible below": (
        cube(3),
        [300, 370, 380],
        r"300 to 380 nm \(cube.npy\): has only 380 nm from 380 to 780 nm; give two",
    ),
    "one visible above": (cube(2), [780, 900], r"780 to 900 nm \(cube.npy\): has only 780 nm from 380 to 780 nm; give two"),
    "too few wavelengths": (cube(3), [400, 500], "holds 2 wavelengths, but .*3 channels"),
    "one twice": (cube(3), [400, 400, 500], "each once"),
    "NaN": (np.where(np.arange(3) == 1, np.nan, cube(3)), [400, 500, 600], "NaN in 12 of 12 pixels"),
    "negative": (cube(3) - 5, [400, 500, 600], "negative in 12 of 12 pixels, the first at x = 0, y = 0"),
}


@pytest.mark.parametrize("case", BAD_CUBES)
def test_a_bad_cube_is_one_message(tmp_path, case):
    pixels, wavelengths, says = BAD_CUBES[case]
    with pytest.raises(PhotositeError, match=says):
        SpectralCubeScene(**save(tmp_path, pixels, wavelengths)).load()


@pytest.mark.parametrize(
    ("names", "says"),
    [
        (("R", "G", "B"), "names no wavelengths"),
        (("left.450nm", "left.460nm", "right.450nm"), "2 groups \\(left, right\\)"),
        (("450", "R"), "two or more"),
    ],
)
def test_channels_that_tell_no_wavelengths_are_refused(tmp_path, names, says):
    file = write_exr(tmp_path / "cube.exr", cube(len(names)), names)
    with pytest.raises(PhotositeError, match=says):
        SpectralCubeScene(file).load()


def test_npy_needs_wavelengths_and_missing_files_are_named(tmp_path):
    files = save(tmp_path, cube(3), [400, 500, 600])
    with pytest.raises(PhotositeError, match="give wavelengths"):
        SpectralCubeScene(files["spectral_cube"]).load()
    with pytest.raises(PhotositeError, match="scene.wavelengths = .*none.txt: no such file"):
        SpectralCubeScene(files["spectral_cube"], tmp_path / "none.txt").load()
    (tmp_path / "words.txt").write_text("400\nfive hundred\n")
    with pytest.raises(PhotositeError, match="one number in nm per line"):
        SpectralCubeScene(files["spectral_cube"], tmp_path / "words.txt").load()


def test_a_black_cube_cannot_be_scaled_but_is_a_scene(tmp_path):
    files = save(tmp_path, np.zeros((1, 1, 3), np.float32), [400, 500, 600])
    assert SpectralCubeScene(**files).load().planes.max() == 0
    with pytest.raises(PhotositeError, match="black"):
        SpectralCubeScene(**files, luminance_cd_m2=1.0).load()


def test_reflectances_in_integers_are_refused(tmp_path):
    files = save(tmp_path, np.full((2, 2, 3), 40000, np.uint16), [400, 500, 600])
    with pytest.raises(PhotositeError, match="scene.spectral_cube = .*: holds integers without a scale.*give floats"):
        SpectralCubeScene(**files, quantity="reflectance", luminance_cd_m2=100.0).load()
    with pytest.raises(PhotositeError, match="cube = array: holds integers without a scale.*give floats"):
        scene_from_spectra(np.ones((2, 2, 3), int), [400, 500, 600], quantity="reflectance", luminance_cd_m2=100.0)


def test_reflectance_needs_a_luminance(tmp_path):
    with pytest.raises(PhotositeError, match="luminance of white"):
        SpectralCubeScene(tmp_path / "a.npy", quantity="reflectance")
