"""Lists of PSF files become tables: Huygens listings of Zemax over blur radius, field and colour."""

import itertools

import numpy as np
import pytest

from simulator.errors import PhotositeError
from simulator.optics.psf.psf_file import read_psf

PITCH_UM = 3.0
TURNS = {"right": 0, "down": 3, "left": 2, "up": 1}  # of a grid whose tail points right, so that it points there


def spot(tail):
    """A grid of 9 x 9 points of 1 um: light in the middle, and a tail of that many points to the right."""
    grid = np.zeros((9, 9))
    grid[4, 4] = 10.0
    grid[4, 5 : 5 + tail] = 2.0
    return grid


def save_zemax(path, grid):
    """Write a grid as Zemax lists a Huygens PSF, UTF-16 with a byte order mark."""
    head = [
        "Listing of Huygens PSF Data",
        "",
        "File : C:\\lens.zmx",
        "Polychromatic Huygens PSF",
        "0.4861 to 0.6563 µm at 0.0000, 14.0000 (deg).",
        "Data spacing is 1.000 µm.",
        "Data area is 9.000 by 9.000 µm.",
        "Strehl ratio: 0.512",
        "Pupil grid size: 64 by 64",
        "Image grid size: 9 by 9",
        "Center point is: 5, 5",
        "Center coordinates  : 0.00000000E+00, 1.24000000E+01 Millimeters",
        "",
    ]
    rows = ["\t".join(f"{value:.6E}" for value in row) for row in grid]
    path.write_bytes(("\r\n".join(head + rows) + "\r\n").encode("utf-16"))


def save_list(folder, header, *lines):
    (folder / "list.csv").write_text("\n".join([header, *lines]) + "\n")
    return folder / "list.csv"


@pytest.mark.parametrize("outwards", TURNS)
def test_grids_are_turned_outwards_and_put_into_one_table(tmp_path, outwards):
    lines = []
    for index, (radius, field) in enumerate(itertools.product((-1.0, 2.0), (0.0, 1.0))):
        save_zemax(tmp_path / f"{index}.txt", np.rot90(spot(2 * index % 4), TURNS[outwards]))
        lines.append(f"{index}.txt, {field}, {outwards}, {radius}")
    table = read_psf(save_list(tmp_path, "file,field,outwards,blur_radius_px", *lines), PITCH_UM)
    assert table.blur_radii_px.tolist() == [-1.0, 2.0] and table.fields.tolist() == [0.0, 1.0] and table.cells == 3
    for index, (row, column) in enumerate(itertools.product(range(2), range(2))):
        expected = spot(2 * index % 4)
        kernel = table.kernels[row, column, 0]
        assert kernel.shape == (9, 9)  # three photosites of 3 um in cells of 1 um: the grid's own points
        np.testing.assert_allclose(kernel, expected / expected.sum(), atol=1e-6)


def test_colours_have_files_of_their_own_or_share_one(tmp_path):
    for name, tail in (("red", 3), ("all", 1), ("axis", 0)):
        save_zemax(tmp_path / f"{name}.txt", spot(tail))
    lines = "axis.txt,0,,", "all.txt,0.7,right,", "red.txt,0.7,right,red"
    table = read_psf(save_list(tmp_path, "file,field,outwards,channel", *lines), PITCH_UM)
    assert table.kernels.shape[:3] == (1, 2, 3) and table.blur_radii_px.tolist() == [0.0]
    assert np.array_equal(table.kernels[0, 1, 1], table.kernels[0, 1, 2])
    assert table.kernels[0, 1, 0, 4, 7] > 0 and table.kernels[0, 1, 1, 4, 7] == 0
    assert np.array_equal(table.kernels[0, 0, 0], table.kernels[0, 0, 2])


def test_kernels_of_different_width_share_their_middle(tmp_path):
    np.save(tmp_path / "small.npy", np.full((3, 3), 1 / 9))
    np.save(tmp_path / "large.npy", np.full((7, 7), 1 / 49))
    table = read_psf(save_list(tmp_path, "file,blur_radius_px", "small.npy,0", "large.npy,3"), PITCH_UM)
    assert table.kernels.shape == (2, 1, 1, 7, 7) and table.cells == 1
    assert table.kernels[0, 0, 0, 2:5, 2:5] == pytest.approx(1 / 9) and table.kernels[0].sum() == pytest.approx(1)


@pytest.mark.parametrize(
    ("header", "lines", "says"),
    [
        ("name", ["a.txt"], "columns = name: give the columns file, field"),
        ("file,angle", ["a.txt,1"], "columns = file, angle: give the columns"),
        ("file", [], "lines = 0: list one kernel"),
        ("file,field", ["a.txt,far"], "line 2: has a field or blur radius that is no number"),
        ("file,field", ["a.txt,0.5"], "line 2: outwards = nothing: say where the picture's centre is not"),
        ("file,field", ["a.txt,-1"], "line 2: field = -1.0: give a share"),
        ("file,channel", ["a.txt,teal"], "line 2: channel = teal: give red, green, blue or nothing"),
        ("file", ["a.txt", "a.txt"], "line = 3: has the blur radius, field and channel of another line"),
        ("file", ["none.txt"], "list.csv: line 2: .*none.txt: no such file"),
        ("file", ["list.csv"], "file = list.csv: list .txt or .npy files"),
        ("file,blur_radius_px,channel", ["a.txt,0,", "a.txt,1,red"], "has no kernel for blur radius 1 px, field 0, green"),
        ("file,blur_radius_px", ["a.txt,0", "b.npy,1"], r"cells = \[1, 3\]: list files of one kind"),
    ],
)
def test_a_bad_list_is_one_message(tmp_path, header, lines, says):
    save_zemax(tmp_path / "a.txt", spot(1))
    np.save(tmp_path / "b.npy", np.full((3, 3), 1 / 9))
    with pytest.raises(PhotositeError, match=says):
        read_psf(save_list(tmp_path, header, *lines), PITCH_UM)
