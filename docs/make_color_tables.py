"""Writes the tables of colour differences in docs/raw_files.md: a noise-free ColorChecker through camera, DNG and LibRaw.

python docs/make_color_tables.py
"""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simulator import develop, load_shot, simulate
from simulator.color.camera_matrices import color_matrix
from simulator.color.colour_science import colour_science
from simulator.color.root_polynomials import fit_color_correction
from simulator.raw.dng.writer import write_dng
from simulator.sensor.camera.camera_sections import SpectralResponse

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "raw_files.md"
MARKS = "<!-- table by docs/make_color_tables.py -->\n", "<!-- end of table -->\n"
CAMERAS = {
    "sony_a7s2": "Sony A7S II",
    "sony_a7_iii": "Sony A7 III",
    "nikon_d850": "Nikon D850",
    "canon_5d_mark_iv": "Canon 5D Mark IV",
}
LIGHTS = ("A", "D50", "D65")
SIZE = 720, 480


@dataclass(frozen=True)
class Chart:
    """The 24 patches as a camera saw them.

    measured: (24, 3) means of the metric development. true_xyz: (24, 3) of the same reflectances in this light, white Y = 1.
    names: of the patches.
    """

    response: SpectralResponse
    light: str
    measured: np.ndarray
    true_xyz: np.ndarray
    names: tuple[str, ...]

    def differences(self, xyz: np.ndarray) -> np.ndarray:
        """Delta E 2000 of found XYZ (24, 3), one scale for the whole chart: (24,)."""
        colour = colour_science()
        xyz = xyz * (xyz[:, 1] @ self.true_xyz[:, 1]) / (xyz[:, 1] @ xyz[:, 1])
        white = colour.CCS_ILLUMINANTS["CIE 1931 2 Degree Standard Observer"][self.light]
        return colour.delta_E(*(colour.XYZ_to_Lab(each, white) for each in (xyz, self.true_xyz)), method="CIE 2000")

    def by_matrix(self) -> np.ndarray:
        """Delta E 2000 with the colour matrix of this very light."""
        to_camera = color_matrix(self.response.wavelengths_nm, self.response.quantum_efficiency, self.light)
        return self.differences(self.measured @ np.linalg.inv(to_camera).T)

    def by_root_polynomials(self) -> np.ndarray:
        """Delta E 2000 with the colour correction of this light."""
        correction = fit_color_correction(self.response.wavelengths_nm, self.response.quantum_efficiency, self.light)
        return self.differences(correction.xyz(self.measured))


def photograph(camera: str, light: str, folder: Path) -> Chart:
    """Take the chart without noise, write the DNG into a folder and measure what LibRaw makes of it."""
    settings = [f"camera={camera}", f"scene.illuminant={light}", "lens.cos4=false", "exposure.time=1/60 s"]
    shot = load_shot(ROOT / "configs" / "shots" / "color_checker.yaml", settings)
    raw = simulate(replace(shot, camera=replace(shot.camera, width_px=SIZE[0], height_px=SIZE[1], window=None)))
    raw = replace(raw, dn=np.rint(raw.noise_free_dn).astype(np.uint16))
    assert raw.dn.max() < raw.white_level_dn, "nothing may clip"
    write_dng(raw, folder / "chart.dng")
    picture = develop(folder / "chart.dng", output="metric", demosaic="linear")
    corners = np.round(np.array(shot.scene.patch_boxes()) * [*SIZE, *SIZE]).astype(int)
    measured = [picture[y0:y1, x0:x1].mean(axis=(0, 1), dtype=float) for x0, y0, x1, y1 in corners]
    return Chart(shot.camera.response, light, np.array(measured), *true_patches(light))


def true_patches(light: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """XYZ of the 24 patches under a light by colour-science, white Y = 1, and their names."""
    colour = colour_science()
    shape = colour.SpectralShape(380, 780, 5)
    observer = colour.MSDS_CMFS["CIE 1931 2 Degree Standard Observer"].copy().align(shape)
    power = colour.SDS_ILLUMINANTS[light].copy().align(shape)
    chart = colour.SDS_COLOURCHECKERS["ColorChecker N Ohta"]
    patches = [colour.sd_to_XYZ(patch.copy().align(shape), observer, power, method="Integration") for patch in chart.values()]
    return np.array(patches) / 100.0, tuple(chart)


def table() -> str:
    """Mean and largest difference of each camera in each light, as Markdown."""
    lines = ["| camera | matrix, A | matrix, D50 | matrix, D65 | root polynomials, A | D50 | D65 |", "|---" * 7 + "|"]
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        for camera, name in CAMERAS.items():
            charts = [photograph(camera, light, Path(folder)) for light in LIGHTS]
            found = [chart.by_matrix() for chart in charts] + [chart.by_root_polynomials() for chart in charts]
            lines.append(" | ".join([f"| {name}", *(f"{each.mean():.2f}, {each.max():.2f}" for each in found)]) + " |")
    return "\n".join(lines) + "\n"


def written_table() -> str:
    """The table as it stands in the page."""
    return PAGE.read_text(encoding="utf-8").partition(MARKS[0])[2].partition(MARKS[1])[0]


def main() -> None:
    """Compute the table and put it into the page."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(MARKS[0])
    after = rest.partition(MARKS[1])[2]
    PAGE.write_text(before + MARKS[0] + table() + MARKS[1] + after, encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
