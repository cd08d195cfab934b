"""The reference implementation of EMVA 1288 on the same frames: PyPI's emva1288, which is no part of Photosite."""

import logging
import math
import warnings
from pathlib import Path

import numpy as np
import pytest

from simulator.config import load_camera
from simulator.measurement.curves.stated_sheet import stated_sheet
from simulator.measurement.emva1288.checks import check_emva
from simulator.measurement.emva1288.files_to_planes import COLOR_OF, measure_emva
from simulator.measurement.emva1288.frames import HALF, SHARES, EmvaBench, EmvaFiles, take_emva_frames
from simulator.measurement.emva1288.xml_sheet import CURVES, QUANTITIES, sheet_rows, write_xml_sheet
from simulator.measurement.statistics.high_pass import high_pass
from simulator.measurement.statistics.spatial_variance import Stack
from simulator.raw.raw_reader import read_raw_file

pytestmark = pytest.mark.slow


def import_peer(monkeypatch):
    """The package calls np.asfarray, which NumPy 2 has no longer."""
    monkeypatch.setattr(np, "asfarray", lambda a, dtype=float: np.asarray(a, dtype=float), raising=False)
    return pytest.importorskip("emva1288.process", reason="emva1288 is not installed: pip install 'photosite[peers]'")


def peer_results(files: EmvaFiles, plane: str, folder: Path, monkeypatch):
    """Results of emva1288 1.0.2 for one plane of the files, handed over as a descriptor of .npy files."""
    process = import_peer(monkeypatch)
    color, lines = files.colors[COLOR_OF[plane]], []

    def block(kind, photons, paths):
        lines.append(f"{kind} 10000000 {photons}".strip())
        for path in paths:
            name = f"{plane}_{path.stem}.npy"
            np.save(folder / name, read_raw_file(path).planes()[plane])
            lines.append(f"i {name}")

    height, width = read_raw_file(files.dark_stack[0]).planes()[plane].shape
    block("d", "", files.dark_stack[:2])
    for photons, pair in zip(color.photons, color.pairs, strict=True):
        block("b", photons, pair)
    block("d", "", files.dark_stack)
    block("b", color.photons[-1] * HALF / SHARES[-1], color.stack)
    descriptor = folder / f"{plane}.txt"
    descriptor.write_text("\n".join(["v 4.0", f"n 14 {width} {height}", *lines]) + "\n")
    info = process.ParseEmvaDescriptorFile(str(descriptor), loglevel=logging.ERROR)
    images = process.LoadImageData(info.images, str(folder), fload=np.load, loglevel=logging.ERROR)
    return process.Results1288(process.Data1288(images.data, loglevel=logging.ERROR).data, loglevel=logging.ERROR)


BODY = ["camera.stages.prnu.sigma=0.01", "camera.stages.dsnu.sigma=3 e-", "camera.stages.column_offset.sigma=1 DN"]


@pytest.mark.parametrize(("iso", "settings"), [(800, BODY), (3200, [])])
def test_the_reference_implementation_agrees_on_the_same_frames(tmp_path, monkeypatch, iso, settings):
    """Within the tolerances of `photosite validate emva`, of ours and of the camera file alike."""
    camera = load_camera("sony_a7s2", settings)
    bench = EmvaBench(camera, iso, tmp_path)
    files = take_emva_frames(bench, 1)
    found = measure_emva(files)
    checks = {(check.quantity, check.where): check for check in check_emva(found, bench)}
    for name in ("Gr", "B"):
        plane, peer = found.planes[name], peer_results(files, name, tmp_path, monkeypatch)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # roots of variances below 0, which it gives as nan
            theirs = {
                "K": peer.K,
                "quantum efficiency": peer.QE / 100.0,
                "sigma_d": peer.sigma_d,
                "saturation": peer.u_e_sat,
                "SNR_max": peer.SNR_max,
                "dynamic range": peer.DR,
                "LE_min": peer.LE_min,
                "LE_max": peer.LE_max,
                "DSNU": peer.DSNU1288,
                "PRNU": peer.PRNU1288 / 100.0,
            }
        for quantity, value in theirs.items():
            check = checks[quantity, name]
            if check.reason_unchecked:
                continue
            for other in (check.measured, check.expected):
                off = abs(value - other) / (other if check.relative else 1.0)
                assert off <= check.tolerance, (quantity, name, value, check)
        assert peer.sigma_y_dark == pytest.approx(math.sqrt(plane.dark.variance_dn2), rel=0.01)


def test_the_reference_implementation_reads_our_data_sheets(tmp_path, monkeypatch):
    """Its reader gives every number back, under the names, in lower case, of its own results."""
    process = import_peer(monkeypatch)
    sheet = stated_sheet(load_camera("sony_a7s2", BODY), 1600, 525.0)
    write_xml_sheet(sheet, tmp_path / "sheet.xml")
    found = process.routines.xml_to_dict(str(tmp_path / "sheet.xml"))
    rows = {(section, name): value for section, name, _, _, value in sheet_rows(sheet)}
    assert rows == {(section, name): found[section][name.lower()]["value"] for section, name in rows}
    curves = found["sensitivity"]["qe_spectral"]["data"]
    assert set(curves) == {"wavelength", "red", "green", "blue"}
    np.testing.assert_array_equal(curves["green"], sheet.efficiency["green"])
    names = {(each["section"], name) for name, each in process.routines.cls_1288_info(process.Results1288).items()}
    ours = {(section, name) for section, part in QUANTITIES.items() for name in part if section != "info" and name != CURVES}
    assert ours <= names
    histograms, indices = ({name for name in names if word in name[1]} for word in ("histogram", "index"))
    variances = {("spatial", f"s_2_y_{name}{dark}") for name in ("measured", "cav", "rav") for dark in ("", "_dark")}
    assert names - ours == histograms | indices | variances


def test_our_high_pass_is_made_of_the_reference_implementations_boxes(monkeypatch):
    """Its filter of whole numbers is the frame less a box, times the box's area; it has the boxes, but not their chain."""
    filtered = import_peer(monkeypatch).routines.high_pass_filter
    frame = np.random.default_rng(3).integers(0, 4096, (70, 90))
    smooth = frame.astype(np.float64)
    for side in (7, 11):
        found = filtered(smooth, side)
        inside = smooth[side // 2 : -(side // 2), side // 2 : -(side // 2)]
        smooth = inside - found["img"] / found["multiplicator"]
    binomial = (smooth[:-2] + 2 * smooth[1:-1] + smooth[2:]) / 4
    binomial = (binomial[:, :-2] + 2 * binomial[:, 1:-1] + binomial[:, 2:]) / 4
    expected = frame[9:-9, 9:-9] - binomial + frame.mean()
    np.testing.assert_allclose(high_pass(Stack(frame.astype(np.float64), 1.0, 2)).mean_dn, expected, rtol=0, atol=1e-8)
