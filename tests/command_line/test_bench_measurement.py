"""`photosite measure`: a body made with NumPy comes back from a folder of its files; what is missing is one message."""

import dataclasses
import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest
from helpers.numpy_body import NumpyBody
from helpers.randomness import accept
from scipy import signal, stats

from simulator.command_line.main import main
from simulator.measurement.statistics.signal_to_noise import least_signal_e, photographic_snr

ISO, STEP_S, DARKS, STEPS = 200, 0.01, 6, 13
BODY = NumpyBody(
    seed=5, shape=(120, 160), lam=0.14, colors=(1.0, 1.0, 1.0, 1.0), bias=(0.0, 0.0, 0.0, 0.0), column=0.0, dark_current=0.0
)
PLACES = np.mgrid[-1 : 1 : 120 * 1j, -1 : 1 : 160 * 1j]
LIGHT = 1.0 / (1.0 + 0.2 * (PLACES[0] ** 2 + PLACES[1] ** 2)) ** 2  # of the body's flats


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """Dark frames, and pairs of flats at 13 exposure times from a tenth of white to 1.3 of it, six more at half of it."""
    folder, number = tmp_path_factory.mktemp("bench"), 0
    for index in range(DARKS):
        BODY.write(folder / f"dark_{index}.dng", ISO, time_s=STEP_S, frame=index)
    for step in range(1, STEPS + 1):
        for index in range(2 if step != 6 else 8):
            number += 1
            level = 0.12 * step * (BODY.white - BODY.black)
            BODY.write(folder / f"flat_{step:02d}_{index}.dng", ISO, level, STEP_S * step, 100 + number)
    return folder


def run(capsys, *arguments) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(["measure", *map(str, arguments)])
    told = capsys.readouterr()
    return ended.value.code, told.out, told.err


def p_of(interval: dict, truth: float) -> float:
    """Two-sided p-value of a truth, by the 95 % interval."""
    error = (interval["high"] - interval["low"]) / (2 * 1.96)
    return float(2 * stats.norm.sf(abs(interval["value"] - truth) / error))


def test_noise_is_that_of_the_body_and_ranges_are_of_the_closed_form(bench, tmp_path, capsys):
    code, out, _ = run(
        capsys, "noise", bench, "--pixel-pitch", "5um", "--circle-of-confusion", "30um", "--json", "--out", tmp_path
    )
    assert code == 0 and (tmp_path / "noise.png").stat().st_size > 0
    content = json.loads(out)
    assert content == json.loads((tmp_path / "noise.json").read_text())
    (row,) = content["isos"]
    gain = BODY.k(ISO)
    accept({"K": p_of(row["gain_dn_per_e"], gain), "read": p_of(row["read_noise_dn"], BODY.read_noise(ISO))})
    measured = row["gain_dn_per_e"]["value"]
    dark_dn2 = row["read_noise_dn"]["value"] ** 2 + row["row_noise_dn"]["value"] ** 2 + 1 / 12
    sigma_e = math.sqrt(dark_dn2) / measured
    assert row["full_scale_e"] == pytest.approx((BODY.white - BODY.black) / measured, rel=1e-3)
    for name, snr in (("range_ev", 1.0), ("pdr_ev", photographic_snr(5.0, 30.0))):
        assert row[name] == pytest.approx(math.log2(row["full_scale_e"] / least_signal_e(sigma_e, snr)), rel=1e-9)


def test_the_table_has_a_line_for_each_iso(bench, capsys):
    code, out, err = run(capsys, "noise", bench)
    assert code == 0 and "K [DN/e-]" in out and "PDR" not in out and "clip; used for the white level" in err


def test_emva_of_a_folder_gives_the_bodys_numbers(bench, tmp_path, capsys):
    """Mean DSNU of the planes by its scatter: each plane is a quarter of one body."""
    code, out, err = run(capsys, "emva", bench, "--out", tmp_path)
    assert code == 0 and "saturation capacity" in out and "quantum efficiency" not in out
    assert "no quantum efficiency" in err and "6 dark frames" in err and (tmp_path / "emva.png").stat().st_size > 0
    content = json.loads((tmp_path / "emva.json").read_text())
    planes = content["planes"]
    assert set(planes) == {"R", "Gr", "Gb", "B"} and content["light_in"] == "exposure time [s]"
    checks = {f"K {name}": p_of(plane["gain"], BODY.k(ISO)) for name, plane in planes.items()}
    dark = np.hypot(BODY.read_noise(ISO), BODY.row_noise(ISO)) / BODY.k(ISO)
    checks |= {f"sigma_d {name}": p_of(plane["read_noise"], dark) for name, plane in planes.items()}
    accept(checks)
    for plane in planes.values():
        dsnu = plane["dsnu"]
        assert abs(dsnu["pixel"] - BODY.dsnu) < 5 * math.hypot(dsnu["error"], BODY.dsnu / math.sqrt(2 * 60 * 80))
        deviation = plane["linearity"]["deviation"]
        assert np.abs(deviation).max() < 0.002


def test_the_light_in_photons_gives_the_quantum_efficiency(bench, tmp_path, capsys):
    """Electrons per second of the body over E A lambda / (h c)."""
    options = ("--irradiance", "10 uW/cm^2", "--wavelength", "525 nm", "--pixel-pitch", "5um")
    assert run(capsys, "emva", bench, "--out", tmp_path, *options)[0] == 0
    photons_per_s = 0.1 * 25e-12 * 525e-9 / (6.62607015e-34 * 299792458.0)
    electrons_per_s = LIGHT.mean() * 0.12 * (BODY.white - BODY.black) / BODY.k(ISO) / STEP_S
    content = json.loads((tmp_path / "emva.json").read_text())
    for plane in content["planes"].values():
        error = plane["gain"]["high"] / plane["gain"]["value"] - 1.0  # 95 %
        assert plane["quantum_efficiency"]["value"] == pytest.approx(electrons_per_s / photons_per_s, rel=2.0 * error + 0.002)
    for name in content["planes"]:
        assert_sheet_is_table(
            tmp_path / f"emva_{name}.xml", {row["quantity"] + row["unit"]: row["planes"][name] for row in content["summary"]}
        )


def test_behind_the_high_pass_uneven_light_is_no_prnu(bench, tmp_path, capsys):
    """PRNU of this very body in its own light, by NumPy: with what the filter leaves of the shading of so small a frame."""
    code, _, err = run(capsys, "emva", bench)
    assert code == 0 and "the light, or the lens, is uneven; give --high-pass" in err
    code, out, err = run(capsys, "emva", bench, "--high-pass", "--out", tmp_path)
    assert code == 0 and "high pass" in out and "uneven" not in err
    content = json.loads((tmp_path / "emva.json").read_text())
    assert content["high_pass"] and ElementTree.parse(tmp_path / "emva_Gr.xml").getroot().get("high_pass") == "yes"
    checks = {}
    for index, (name, plane) in enumerate(content["planes"].items()):
        rows, columns = slice(index // 2, None, 2), slice(index % 2, None, 2)
        truths = {"dsnu": BODY.pattern["dsnu"] + BODY.pattern["column"] / BODY.k(ISO), "prnu": LIGHT * BODY.pattern["prnu"]}
        for kind, truth in truths.items():
            unit = truth.mean() if kind == "prnu" else 1.0
            found = plane[kind]
            of_gain = (plane["gain"]["high"] / plane["gain"]["value"] - 1.0) / 1.96 if kind == "dsnu" else 0.0
            error = math.hypot(found["error"], of_gain * found["pixel"])
            checks[kind, name] = float(
                2 * stats.norm.sf(abs(found["pixel"] - pixel_pattern(truth[rows, columns]) / unit) / error)
            )
    accept(checks)


def pixel_pattern(pattern):
    """Standard deviation between photosites of a pattern behind the high pass, less rows and columns."""
    line = np.convolve(np.convolve(np.full(7, 1 / 7), np.full(11, 1 / 11)), [0.25, 0.5, 0.25])
    passed = (pattern - signal.convolve2d(pattern, np.outer(line, line), mode="same"))[9:-9, 9:-9]
    rest = passed - passed.mean(axis=0) - passed.mean(axis=1, keepdims=True) + passed.mean()
    rows, columns = rest.shape
    return math.sqrt(np.sum(rest**2) / (rows - 1) / (columns - 1) / (1 - 2 * line[9] ** 2 + (line @ line) ** 2))


def assert_sheet_is_table(path, summary: dict[str, float]) -> None:
    """Every number of the summary stands in the data sheet."""
    names = {"wavelengthnm": "wavelength", "quantum efficiency%": "QE", "gain KDN/e-": "K", "1 / Ke-/DN": "inverse_K"}
    names |= {"temporal dark noise sigma_de-": "sigma_d", "temporal dark noise sigma_y.darkDN": "sigma_y_dark"}
    names |= {
        "absolute sensitivity thresholdphotons": "u_p_min",
        "saturation capacitye-": "u_e_sat",
        "saturationphotons": "u_p_sat",
    }
    names |= {"SNR_max": "SNR_max", "SNR_maxdB": "SNR_max_dB", "dynamic rangedB": "DR_dB"}
    names |= {"linearity error LE_min%": "LE_min", "linearity error LE_max%": "LE_max"}
    for kind, unit in (("DSNU", "e-"), ("PRNU", "%")):
        names |= {
            f"{kind}{part}{unit}": f"{kind}1288{end}"
            for part, end in ((" of rows", "_row"), (" of columns", "_col"), (" of pixels", "_pixel"))
        }
        names[f"{kind}{unit}"] = f"{kind}1288"
    root = ElementTree.parse(path).getroot()
    values = {one.tag: float(one.find("Value").text) for part in root for one in part}
    assert root.get("plane") in path.name and values["pixel_size"] == 5.0
    assert set(summary) == {*names, "dynamic rangestops"}
    for quantity, name in names.items():
        assert values[name] == pytest.approx(summary[quantity], rel=1e-12), name


@pytest.mark.parametrize(
    ("arguments", "messages"),
    [
        (("emva", "dark_0.dng", "flat_01_0.dng"), ["ISO 200: EMVA 1288 needs more:", "two dark frames", "pairs of flats at 5"]),
        (
            ("emva", "--irradiance", "1 W/m^2", "."),
            ["--irradiance 1 W/m^2: photons take all three: give --wavelength and --pixel-pitch"],
        ),
        (("emva", "--iso", "100", "."), ["--iso 100: no file is of it: 200"]),
        (("noise", "dark_0.dng"), ["no ISO can be measured", "ISO 200 is left out"]),
        (("noise", ".", "--circle-of-confusion", "20um"), ["--circle-of-confusion 20um: goes with --pixel-pitch"]),
        (("noise", "nothing"), ["nothing: no such file or folder"]),
    ],
)
def test_what_is_missing_is_one_message(bench, capsys, monkeypatch, arguments, messages):
    monkeypatch.chdir(bench)
    code, _, err = run(capsys, *arguments)
    assert code == 1 and err.count("error:") == 1 and all(message in err for message in messages)


def test_emva_of_dark_frames_that_end_at_0_says_which_numbers_are_wrong(tmp_path, capsys):
    body = dataclasses.replace(BODY, black=0.0, black_in_file=0, sigma_pre=20.0)
    for index in range(2):
        body.write(tmp_path / f"dark_{index}.dng", ISO, time_s=STEP_S, frame=index)
        for step in range(1, STEPS + 1):
            body.write(
                tmp_path / f"flat_{step:02d}_{index}.dng", ISO, 0.12 * step * body.white, STEP_S * step, 100 * step + index
            )
    code, _, err = run(capsys, "emva", tmp_path)
    assert code == 0 and "codes of the dark frames end at 0" in err and "dynamic range too high" in err
