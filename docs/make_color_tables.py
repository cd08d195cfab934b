"""Writes the tables of colour differences in docs/raw_files.md: a noise-free ColorChecker through camera, DNG and LibRaw.

python docs/make_color_tables.py
"""

import tempfile
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simulator import develop, load_camera, load_shot, simulate
from simulator.color.camera_matrices import (
    adapted_to_d50,
    as_shot_neutral,
    camera_response,
    chart_reflectances,
    color_matrix,
    delta_e_in_d50,
    forward_matrix,
)
from simulator.color.colour_science import colour_science
from simulator.color.root_polynomials import fit_color_correction
from simulator.color.spectra import WAVELENGTHS_NM, illuminant, tristimulus
from simulator.raw.dng.writer import write_dng
from simulator.sensor.camera.camera_sections import SpectralResponse

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "raw_files.md"
END = "<!-- end of table -->\n"
FORWARD, CORRECTED = (f"<!-- {name} by docs/make_color_tables.py -->\n" for name in ("forward matrices", "table"))
CAMERAS = {
    "sony_a7s2": "Sony A7S II",
    "sony_a7_iii": "Sony A7 III",
    "nikon_d850": "Nikon D850",
    "canon_5d_mark_iv": "Canon 5D Mark IV",
}
LIGHTS = ("A", "D50", "D65")
READ_LIGHTS = ("A", "D50", "D65", "FL2", "FL11", "LED-B1", "LED-B3")
ENDS_K = {"A": 2850.0, "D65": 6500.0}  # as Adobe's DNG SDK has them
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


def read_as_dng(response: SpectralResponse, light: str) -> np.ndarray:
    """XYZ under D50 (24, 3) that a DNG reader gives to the chart in a light, by ColorMatrix and ForwardMatrix for A and D65.

    DNG 1.7.1, chapter 6: the light's temperature is where the interpolated ColorMatrix takes its chromaticity to AsShotNeutral;
    ForwardMatrix is interpolated over the reciprocal temperature, and multiplies the camera values divided by AsShotNeutral.
    """
    colour, curves = colour_science(), (response.wavelengths_nm, response.quantum_efficiency)
    neutral = as_shot_neutral(illuminant(light), *curves, WAVELENGTHS_NM)
    colors, forwards = ([function(*curves, end) for end in ENDS_K] for function in (color_matrix, forward_matrix))
    share = 0.5  # of A
    for _ in range(50):
        xyz = np.linalg.solve(share * colors[0] + (1.0 - share) * colors[1], neutral)
        kelvin = float(colour.xy_to_CCT(xyz[:2] / xyz.sum(), method="Hernandez 1999"))
        warm, cold = (1.0 / ENDS_K[end] for end in ("A", "D65"))
        share = float(np.clip((1.0 / kelvin - cold) / (warm - cold), 0.0, 1.0))
    power = illuminant(light)
    spectra = np.vstack([power, chart_reflectances(WAVELENGTHS_NM) * power])
    white, *patches = camera_response(spectra, WAVELENGTHS_NM, *curves)
    return np.array(patches) / white @ (share * forwards[0] + (1.0 - share) * forwards[1]).T


def forward_table() -> str:
    """Mean and largest difference of a DNG reader, and the mean with the forward matrix of that very light, as Markdown."""
    lines = ["| camera | " + " | ".join(READ_LIGHTS) + " |", "|---" * (1 + len(READ_LIGHTS)) + "|"]
    for camera, name in CAMERAS.items():
        response, cells = load_camera(camera).response, []
        for light in READ_LIGHTS:
            power = illuminant(light)
            true_xyz = adapted_to_d50(tristimulus(chart_reflectances(WAVELENGTHS_NM) * power), light)
            found = delta_e_in_d50(read_as_dng(response, light), true_xyz)
            spectra = np.vstack([power, chart_reflectances(WAVELENGTHS_NM) * power])
            curves = response.wavelengths_nm, response.quantum_efficiency
            white, *patches = camera_response(spectra, WAVELENGTHS_NM, *curves)
            least = delta_e_in_d50(np.array(patches) / white @ forward_matrix(*curves, light).T, true_xyz)
            cells.append(f"{found.mean():.2f}, {found.max():.1f} ({least.mean():.2f})")
        lines.append(" | ".join([f"| {name}", *cells]) + " |")
    return "\n".join(lines) + "\n"


TABLES = {FORWARD: forward_table, CORRECTED: table}


def written_table(mark: str) -> str:
    """A table as it stands in the page, by the line above it."""
    return PAGE.read_text(encoding="utf-8").partition(mark)[2].partition(END)[0]


def main() -> None:
    """Compute the tables and put them into the page."""
    for mark, make in TABLES.items():
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(mark)
        PAGE.write_text(before + mark + make() + END + rest.partition(END)[2], encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
