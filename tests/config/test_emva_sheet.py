"""EMVA 1288 data sheets in CSV and XML: the camera that they state, against the same camera written in YAML."""

import math

import numpy as np
import pytest

from simulator.config import load_camera, load_shot
from simulator.errors import PhotositeError
from simulator.pipeline.simulate import simulate

SHEET = """\
quantity,value,unit,wavelength
# a sensor that nobody made
Vendor,Nobody
Model,NB-2020
Width,96,px
Height,64,px
Pixel size,4.5,µm
Bit depth,12,bit
Quantum efficiency (η),62.5,%,525 nm
Overall system gain (K),0.365,DN/e-
Temporal dark noise (σ_d),2.31,e-
Saturation capacity (µ_e.sat),10500,e-
Dynamic range,72.1,dB
DSNU1288,0.84,e-
PRNU1288,0.42,%
Dark current (µ_I),1.9,e-/s
Dark signal,16,DN
"""
CAMERA = """\
make: Nobody
model: NB-2020
width: 96
height: 64
pixel_pitch: 4.5 um
cfa: MONO
bit_depth: 12
black_level: 16 DN
response: {wavelengths: {start: 400 nm, step: 300 nm}, peak_quantum_efficiency: 0.625, relative: [[1], [1]]}
iso_table: {100: {gain: 0.365 DN/e-, read_noise: 0.84315 DN}}
stages: {photon_shot_noise: {}, full_well: {capacity: 10500 e-}, dark_current: {rate: 1.9 e-/s}, dsnu: {sigma: 0.84 e-}, prnu: {sigma: 0.0042}}
"""  # noqa: E501
SHOT = """\
scene: {chart: flat_field, luminance: 100 cd/m^2, reflectance: 1}
lens: {focal_length: 50 mm, f_number: f/4}
exposure: {time: 1/100 s, iso: 100}
camera: {base: sheet.csv, stages: {photon_shot_noise: null, dsnu: null, prnu: null}}
"""


def save(folder, text):
    (folder / "sheet.csv").write_text(text, encoding="utf-8")
    return str(folder / "sheet.csv")


def without_arrays(camera):
    return {key: value for key, value in vars(camera).items() if key not in ("response", "sources")}


def test_a_sheet_states_the_camera_of_the_same_numbers(tmp_path):
    sheet = load_camera(save(tmp_path, SHEET))
    (tmp_path / "camera.yaml").write_text(CAMERA)
    written = load_camera(str(tmp_path / "camera.yaml"))
    assert without_arrays(sheet) == without_arrays(written)
    assert np.array_equal(sheet.response.quantum_efficiency, written.response.quantum_efficiency)
    assert np.array_equal(sheet.response.wavelengths_nm, written.response.wavelengths_nm)


def test_a_shot_takes_it_as_a_base(tmp_path):
    save(tmp_path, SHEET)
    (tmp_path / "shot.yaml").write_text(SHOT)
    raw = simulate(load_shot(tmp_path / "shot.yaml"))
    assert raw.dn.shape == (64, 96) and raw.noise_free_dn == pytest.approx(16 + 0.365 * raw.mean_electrons, abs=0.01)


def test_numbers_in_other_units_are_the_same(tmp_path):
    other = SHEET.replace("Overall system gain (K),0.365,DN/e-", f"Inverse of overall system gain (1/K),{1 / 0.365!r},e-/DN")
    other = other.replace("(σ_d),2.31,e-", f"(σ_y.dark),{math.hypot(2.31 * 0.365, 12**-0.5)!r},DN")
    other = other.replace("DSNU1288,0.84,e-", f"dsnu,{0.84 * 0.365!r},DN").replace("4.5,µm", "0.0045, mm")
    other = other.replace("62.5,%,525 nm", "0.625,").replace("10500,e-", "10.5,ke-")
    one, two = (without_arrays(load_camera(save(tmp_path, text))) for text in (SHEET, other))
    assert two["pixel_pitch_um"] == pytest.approx(4.5)
    assert two["iso_table"][100].gain_dn_per_e == pytest.approx(0.365)
    assert two["iso_table"][100].read_noise_dn == pytest.approx(one["iso_table"][100].read_noise_dn)
    assert two["stages"]["dsnu"].sigma_e == pytest.approx(0.84) and two["stages"]["full_well"].capacity_e == 10500


def test_a_well_that_the_adc_cannot_show_is_left_to_the_adc(tmp_path):
    assert "full_well" not in load_camera(save(tmp_path, SHEET.replace("10500", "11200"))).stages


def test_quantum_efficiencies_by_wavelength_and_colour_are_curves(tmp_path):
    line = "Quantum efficiency (η),62.5,%,525 nm\n"
    mono = "".join(f"quantum efficiency,{value},%,{nm}\n" for nm, value in ((450, 40), (525, 62.5), (550, 60), (650, 30)))
    response = load_camera(save(tmp_path, SHEET.replace(line, mono))).response
    assert response.wavelengths_nm.tolist() == list(range(450, 651, 25))
    expected = np.interp(response.wavelengths_nm, [450, 525, 550, 650], [0.4, 0.625, 0.6, 0.3])
    np.testing.assert_allclose(response.quantum_efficiency[:, 0], expected, rtol=1e-12)
    rows = [("red", 450, 2), ("red", 600, 40), ("green", 450, 10), ("green", 600, 20), ("blue", 450, 35), ("blue", 600, 3)]
    color = "".join(f"Quantum efficiency {name},{value},%,{nm} nm\n" for name, nm, value in rows)
    camera = load_camera(save(tmp_path, SHEET.replace(line, color + "Colour filter,GBRG\n")))
    assert camera.cfa == "GBRG"
    np.testing.assert_allclose(camera.response.quantum_efficiency, [[0.02, 0.1, 0.35], [0.4, 0.2, 0.03]], rtol=1e-12)


@pytest.mark.parametrize(
    "stated",
    [
        {465: 50, 525: 60, 630: 30},
        {400: 20, 470: 55, 530: 62, 590: 50, 617: 45, 660: 30, 740: 12, 850: 3},
        {465.25: 50, 525: 60, 630: 30},
    ],
)
def test_a_curve_goes_through_all_wavelengths_that_a_sheet_states_and_ends_at_the_last(tmp_path, stated):
    line = "Quantum efficiency (η),62.5,%,525 nm\n"
    mono = "".join(f"quantum efficiency,{value},%,{nm}\n" for nm, value in stated.items())
    response = load_camera(save(tmp_path, SHEET.replace(line, mono))).response
    nm, efficiency = response.wavelengths_nm, response.quantum_efficiency[:, 0]
    np.testing.assert_allclose(np.interp(list(stated), nm, efficiency), [0.01 * value for value in stated.values()], rtol=1e-9)
    np.testing.assert_allclose([nm[0], nm[-1]], [min(stated), max(stated)], rtol=1e-12)


def test_colours_may_be_measured_at_wavelengths_of_their_own(tmp_path):
    line = "Quantum efficiency (η),62.5,%,525 nm\n"
    rows = [("red", 590, 30), ("red", 634, 50), ("green", 505, 20), ("green", 547, 60), ("blue", 430, 10), ("blue", 465, 40)]
    color = "".join(f"Quantum efficiency {name},{value},%,{nm} nm\n" for name, nm, value in rows)
    response = load_camera(save(tmp_path, SHEET.replace(line, color))).response
    for name, nm, value in rows:
        curve = response.quantum_efficiency[:, ("red", "green", "blue").index(name)]
        assert np.interp(nm, response.wavelengths_nm, curve) == pytest.approx(0.01 * value, rel=1e-9)


@pytest.mark.parametrize(
    ("stated", "says"),
    [
        ((450.0, 450.001), "names a wavelength twice"),
        ((450.01, 5000.0, 9999.98), "has no even grid of less than"),
        ((450.0, 1e300), r"wavelength = 1e\+300 nm: give nm, up to 10000"),
    ],
)
def test_wavelengths_that_no_grid_holds_are_one_message(tmp_path, stated, says):
    line = "Quantum efficiency (η),62.5,%,525 nm\n"
    mono = "".join(f"quantum efficiency,50,%,{nm}\n" for nm in stated)
    with pytest.raises(PhotositeError, match=says):
        load_camera(save(tmp_path, SHEET.replace(line, mono)))


def test_an_efficiency_that_noise_has_measured_above_100_percent_is_100_percent_and_said(tmp_path):
    camera = load_camera(save(tmp_path, SHEET.replace("62.5,%", "100.03,%")))
    assert camera.response.quantum_efficiency.max() == 1.0
    assert "its quantum efficiency of 100.03 % is taken as 100 %" in str(camera.sources)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("PRNU1288,0.42,%", "PRNU1288,0.42,e-", r"sheet.csv:15: PRNU1288 = 0.42: has the unit e-; write one of %, nothing"),
        ("PRNU1288,0.42,%", "PRMU,0.42,%", r"sheet.csv:15: PRMU = 0.42: is no quantity that is known"),
        ("PRNU1288,0.42,%", 'PRNU1288,"0,42",%', "sheet.csv:15: PRNU1288 = 0,42: is no number"),
        ("Bit depth,12,bit\n", "", "quantity = bit depth: is missing; add a line"),
        ("Pixel size,4.5", "Pixel size,-4.5", "sheet.csv:7: Pixel size = -4.5: is no number of 0 or more"),
        ("Width,96", "Width,9.5", "sheet.csv:5: Width = 9.5: is a whole number"),
        ("quantity,value", "name,number", "columns = name, number, unit, wavelength: give the columns quantity"),
        ("Dark signal,16,DN", "DSNU,1,e-", "sheet.csv:17: DSNU = 1: is stated twice"),
        ("62.5,%", "162.5,%", "quantum efficiency = 1.625: give shares"),
        ("62.5,%", "102.1,%", "quantum efficiency = 1.021: give shares"),
        ("525 nm", "green", "sheet.csv:9: .*has a wavelength of green; give a number in nm"),
    ],
)
def test_a_bad_sheet_is_one_message(tmp_path, old, new, says):
    assert SHEET.count(old) == 1
    with pytest.raises(PhotositeError, match=says):
        load_camera(save(tmp_path, SHEET.replace(old, new)))


def test_a_value_that_no_camera_has_is_told_with_its_line(tmp_path):
    with pytest.raises(PhotositeError, match=r"sheet.csv:8: camera.bit_depth = "):
        load_camera(save(tmp_path, SHEET.replace("Bit depth,12", "Bit depth,40")))


# As the reference implementation writes its results: names of columns in lower case, units in LaTeX, what was not measured nan.
RESULTS = """\
<results>
  <sensitivity>
    <K><section>sensitivity</section><short>System gain</short><value>0.365</value><unit>$DN/e^-$</unit></K>
    <QE><short>Quantum efficiency</short><value>62.5</value><unit>\\%</unit></QE>
    <sigma_d><value>2.31</value><unit>$e^-$</unit></sigma_d>
    <u_e_sat><value>10500.0</value><unit>$e^-$</unit></u_e_sat>
  </sensitivity>
  <dark_current><u_I_mean><value>nan</value></u_I_mean></dark_current>
  <spatial>
    <DSNU1288><Value>0.84</Value></DSNU1288>
    <PRNU1288><Value>0.42</Value></PRNU1288>
  </spatial>
</results>
"""
BESIDE = """\
scene: {chart: flat_field, luminance: 100 cd/m^2, reflectance: 1}
lens: {focal_length: 50 mm, f_number: f/4}
exposure: {time: 1/100 s, iso: 100}
camera: {base: results.xml, width: 96, height: 64, bit_depth: 12, pixel_pitch: 4.5 um, black_level: 16 DN}
"""


def save_results(folder, text=RESULTS):
    (folder / "results.xml").write_text(text, encoding="utf-8")
    (folder / "shot.yaml").write_text(BESIDE)
    return folder / "shot.yaml"


def test_results_of_the_reference_implementation_are_a_camera_with_what_stands_beside(tmp_path):
    camera = load_shot(save_results(tmp_path)).camera
    sheet = load_camera(save(tmp_path, SHEET.replace("Dark current (µ_I),1.9,e-/s\n", "")))
    own = {"make", "model"}
    one, two = ({key: value for key, value in without_arrays(each).items() if key not in own} for each in (camera, sheet))
    assert one == two and camera.make == "unknown" and camera.model == "results"
    assert np.array_equal(camera.response.quantum_efficiency, sheet.response.quantum_efficiency)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("0.365", "0,365", "results.xml:3: overall system gain = 0,365: is no number"),
        ("results>", "sheet>", "results.xml: root element = sheet: a data sheet begins with <results>"),
        ("</spatial>", "", "results.xml: cannot be read .*write it again"),
        ("<K>", "<k>", "results.xml: cannot be read"),
        (
            "sigma_d",
            "sigma_e",
            "results.xml: quantity = temporal dark noise: is missing; add a line for it, or state it beside",
        ),
        (
            "  <spatial>",
            "<more><QE_spectral><Data><wavelength>400 500</wavelength><mono>1</mono></Data></QE_spectral></more><spatial>",
            "results.xml:9: QE_spectral.mono: has 1 numbers, but the wavelengths in line 9 are 2",
        ),
    ],
)
def test_bad_results_are_one_message(tmp_path, old, new, says):
    with pytest.raises(PhotositeError, match=says):
        load_shot(save_results(tmp_path, RESULTS.replace(old, new)))
