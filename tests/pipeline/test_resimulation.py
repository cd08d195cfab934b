"""A DNG alone gives its frame again, and says why when it cannot."""

import hashlib
import json
import shutil
import struct
import subprocess

import numpy as np
import pytest
import rawpy
from helpers.linked_files import FILES, put_cube, put_kernel, put_shot
from helpers.raw_frame import random_frame

import simulator
from simulator.color.color_tables import CONFIGS
from simulator.command_line.main import main
from simulator.errors import PhotositeError
from simulator.raw.dng.writer import dng_bytes, write_dng
from simulator.raw.dng.xmp import read_provenance

CHECKER = CONFIGS / "shots" / "color_checker.yaml"
SMALL = {"camera.window": {"x": 7, "y": 4, "width": 60, "height": 41}, "exposure.iso": 3200, "seeds": {"body": 3, "frame": 9}}
SHOT = """
scene: {image: scene.npy, depth: {image: depth.npy}, luminance: 80 cd/m^2, illuminant: 3200 K}
lens: {focal_length: 50 mm, f_number: f/2, focus_distance: 1.5 m}
exposure: {time: 1/60 s, iso: 1600, date_time: 2026-05-01 12:30:00}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 64, height: 48}}
"""


def codes(path) -> np.ndarray:
    with rawpy.imread(str(path)) as frame:
        return frame.raw_image_visible.copy()


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


@pytest.fixture
def picture_dng(tmp_path):
    """A DNG of a picture with depth, and the folder of its scene."""
    folder = tmp_path / "scene"
    folder.mkdir()
    random = np.random.default_rng(5)
    np.save(folder / "scene.npy", random.random((40, 60, 3), dtype=np.float32))
    np.save(folder / "depth.npy", (1 + random.random((40, 60))).astype(np.float32))
    (folder / "shot.yaml").write_text(SHOT)
    files = simulator.save(simulator.simulate(simulator.load_shot(folder / "shot.yaml")), tmp_path / "out")
    return files.dng, folder


STRANGE = "Ä <&>\"'\x85\uffff \U0001f4f7"  # what XML must quote, or cannot hold


CHANGES = (
    {},
    {"camera.iso_range": "extrapolate", "exposure.iso": 1_000_000},
    {"camera.model": STRANGE},
    {"raw": {"payload": "packed", "orientation": 6, "black_per_place": True}},
)


@pytest.mark.parametrize("changes", CHANGES)
def test_the_dng_alone_gives_the_same_bits(tmp_path, changes):
    raw = simulator.simulate(simulator.load_shot(CHECKER, SMALL | changes))
    files = simulator.save(raw, tmp_path / "first")
    alone = shutil.move(files.dng, tmp_path / "alone.dng")
    shutil.rmtree(tmp_path / "first")
    again = simulator.resimulate(alone)
    np.testing.assert_array_equal(codes(alone), again.dn)
    np.testing.assert_array_equal(raw.mean_electrons, again.mean_electrons)
    assert dng_bytes(again) == alone.read_bytes()


def test_another_frame_is_told(capsys, tmp_path):
    raw = simulator.simulate(simulator.load_shot(CHECKER, SMALL))
    changed = raw.dn.copy()
    changed[3, 5] ^= 1
    write_dng(simulator.Raw(**{**vars(raw), "dn": changed}), tmp_path / "a.dng")
    code, _, err = run(capsys, "resimulate", str(tmp_path / "a.dng"))
    assert code == 1 and err == f"error: {tmp_path / 'a.dng'}: 1 of 2460 codes differ from the file's\n"


def test_the_command_compares_and_writes_the_files(capsys, tmp_path, picture_dng):
    dng, _ = picture_dng
    code, out, _ = run(capsys, "resimulate", str(dng), "--out", str(tmp_path / "again"))
    lines = out.splitlines()
    assert code == 0 and lines[-1].startswith(f"{dng}: the same 3072 codes again")
    assert lines[0] == str(tmp_path / "again" / "shot.dng")
    assert (tmp_path / "again" / "shot.dng").read_bytes() == dng.read_bytes()
    assert (tmp_path / "again" / "shot.truth.exr").read_bytes() == dng.with_suffix(".truth.exr").read_bytes()


def test_the_hash_is_that_of_the_settings_the_sidecar_has(picture_dng):
    # sha256sum of the compact, sorted JSON; the sidecar holds the same settings.
    dng, folder = picture_dng
    provenance = read_provenance(dng)
    sidecar = json.loads(dng.with_suffix(".json").read_text())
    text = json.dumps(sidecar["shot"], sort_keys=True, separators=(",", ":"))
    assert provenance.config_sha256 == hashlib.sha256(text.encode()).hexdigest()
    content = {key: hashlib.sha256((folder / file).read_bytes()).hexdigest() for key, file in
               (("scene.image", "scene.npy"), ("scene.depth.image", "depth.npy"))}  # fmt: skip
    assert {each["key"]: each["sha256"] for each in provenance.inputs} == content
    assert list(provenance.inputs) == sidecar["inputs"]


def test_a_scene_that_moved_is_found_beside_the_dng(picture_dng):
    dng, folder = picture_dng
    for name in ("scene.npy", "depth.npy"):
        shutil.move(folder / name, dng.parent / name)
    np.testing.assert_array_equal(simulator.resimulate(dng).dn, codes(dng))


def test_a_missing_scene_is_named(picture_dng):
    dng, folder = picture_dng
    (folder / "depth.npy").unlink()
    with pytest.raises(
        PhotositeError, match=r"shot.dng: scene.depth.image = .*scene/depth.npy: no such file, .*put the file back"
    ):
        simulator.resimulate(dng)


def test_a_scene_with_other_content_is_named_and_the_old_one_beside_the_dng_is_taken(picture_dng):
    dng, folder = picture_dng
    old = (folder / "scene.npy").read_bytes()
    np.save(folder / "scene.npy", np.ones((40, 60, 3), np.float32))
    with pytest.raises(PhotositeError, match=r"scene.image = .*scene.npy: its content is not what it was .*SHA-256"):
        simulator.resimulate(dng)
    (dng.parent / "scene.npy").write_bytes(old)
    np.testing.assert_array_equal(simulator.resimulate(dng).dn, codes(dng))


@pytest.fixture
def linked_dng(tmp_path):
    """A DNG whose scene and lens are read from several files, of which its shot names one each, and their folder."""
    folder = tmp_path / "scene"
    folder.mkdir()
    files = simulator.save(simulator.simulate(simulator.load_shot(put_shot(folder))), tmp_path / "out")
    return files.dng, folder


def spoil_cube(folder):
    put_cube(folder, 0.03)
    return folder / "cube.img"


def spoil_kernel(folder):
    put_kernel(folder, "rest", 5)
    return folder / "kernels" / "rest.npy"


def remove_data(folder):
    (folder / "cube.img").unlink()
    return folder / "cube.img"


@pytest.mark.parametrize(
    ("spoil", "key", "says"),
    [
        (spoil_cube, "scene.spectral_cube", r"its content is not what it was .*or with cube\.hdr beside the DNG"),
        (spoil_kernel, "lens.psf", r"its content is not what it was .*or with psf\.csv beside the DNG"),
        (remove_data, "scene.spectral_cube", r"no such file; put the file back, or with cube\.hdr beside the DNG"),
    ],
)
def test_a_file_that_another_leads_to_is_named_and_the_old_ones_beside_the_dng_are_taken(linked_dng, spoil, key, says):
    dng, folder = linked_dng
    np.testing.assert_array_equal(simulator.resimulate(dng).dn, codes(dng))
    for name in FILES:
        (dng.parent / "old" / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(folder / name, dng.parent / "old" / name)
    spoilt = spoil(folder)
    with pytest.raises(PhotositeError, match=says) as caught:
        simulator.resimulate(dng)
    assert (caught.value.key, str(caught.value.value), caught.value.file) == (key, str(spoilt), dng)
    shutil.copytree(dng.parent / "old", dng.parent, dirs_exist_ok=True)
    np.testing.assert_array_equal(simulator.resimulate(dng).dn, codes(dng))


def test_files_that_moved_together_are_found_beside_the_dng(linked_dng):
    dng, folder = linked_dng
    shutil.copytree(folder, dng.parent, dirs_exist_ok=True)
    shutil.rmtree(folder)
    np.testing.assert_array_equal(simulator.resimulate(dng).dn, codes(dng))


def test_a_dng_that_tells_only_the_files_that_its_shot_names_gives_its_frame(linked_dng, tmp_path):
    """As 0.1.0 wrote them."""
    dng, folder = linked_dng
    raw = simulator.simulate(simulator.load_shot(folder / "linked.yaml"))
    old = [one for one in raw.resolved["inputs"] if one["path"].endswith(("cube.hdr", "psf.csv"))]
    write_dng(simulator.Raw(**{**vars(raw), "resolved": raw.resolved | {"inputs": old}}), tmp_path / "old.dng")
    assert len(read_provenance(tmp_path / "old.dng").inputs) == 2 < len(read_provenance(dng).inputs)
    np.testing.assert_array_equal(simulator.resimulate(tmp_path / "old.dng").dn, codes(dng))


@pytest.mark.skipif(shutil.which("exiftool") is None, reason="exiftool is not installed")
def test_a_file_that_exiftool_rewrote_still_gives_its_frame(picture_dng):
    dng, _ = picture_dng
    subprocess.run(["exiftool", "-q", "-overwrite_original", "-XMP-dc:Title=title", "-Artist=someone", dng], check=True)
    assert b"<photosite:Shot>" in dng.read_bytes()  # exiftool writes elements where we write attributes
    np.testing.assert_array_equal(simulator.resimulate(dng).dn, codes(dng))


def test_edited_settings_are_refused(picture_dng):
    dng, _ = picture_dng
    content = dng.read_bytes()
    assert content.count(b"1600,") == 1
    dng.write_bytes(content.replace(b"1600,", b"3200,"))
    with pytest.raises(PhotositeError, match="shot.dng: the shot in its XMP packet was changed"):
        simulator.resimulate(dng)


def tiff(order: str, entries: bytes = b"") -> bytes:
    magic = {"<": b"II*\0", ">": b"MM\0*"}[order]
    return magic + struct.pack(f"{order}IH", 8, len(entries) // 12) + entries


FOREIGN = {
    "holds no shot, because it was simulated from objects in Python": [dng_bytes(random_frame())],
    "holds no shot of Photosite": [
        tiff("<"),
        tiff(">"),
        tiff("<", struct.pack("<HHI4s", 700, 1, 4, b"<no>")),
    ],
    "not a DNG, or cut short": [b"", b"\xff\xd8\xff", b"II*\0", tiff("<")[:9], tiff(">", struct.pack(">HHII", 700, 1, 900, 8))],
}


@pytest.mark.parametrize("message", FOREIGN)
def test_another_file_is_one_clear_error(capsys, tmp_path, message):
    for content in FOREIGN[message]:
        (tmp_path / "a.dng").write_bytes(content)
        code, _, err = run(capsys, "resimulate", str(tmp_path / "a.dng"))
        assert code == 1 and err.startswith(f"error: {tmp_path / 'a.dng'}: ") and message in err
    code, _, err = run(capsys, "resimulate", str(tmp_path / "none.dng"))
    assert code == 1 and err == f"error: {tmp_path / 'none.dng'}: no such file; check the path\n"


def test_a_frame_without_a_shot_file_has_no_packet():
    assert b"xpacket" not in dng_bytes(random_frame())
    assert b"xpacket" in dng_bytes(random_frame(resolved={"shot": {"name": "a"}}))
