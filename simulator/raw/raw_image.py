"""Result of a simulated shot: the raw frame, its ground truth, and the metadata that a raw converter needs."""

from dataclasses import dataclass, field

import numpy as np

from simulator.displayed import Displayed
from simulator.raw.late_field import LateField
from simulator.raw.raw_format import RawFormat
from simulator.sensor.camera.cfa import CfaName

LATE = ("mean_electrons", "noise_free_dn", "resolved")


@dataclass(frozen=True)
class Raw(Displayed):
    """A raw frame, its ground truth, and the metadata that a raw converter needs.

    dn: (height, width) uint16 codes, linear in light [DN].
    mean_electrons: (height, width) float32, mean photoelectrons per photosite, before any noise [e-].
    noise_free_dn: (height, width) float32, the code without noise and rounding, clipped as the sensor clips [DN].
        Both are LATE: they may be given as functions that make them. Those of a simulated frame are computed on its device
        when they are first read; until then the frame holds the light on the sensor, 4 bytes for each photosite.
    cfa: colours from the frame's upper left corner on, of one period of the filter pattern, as `Cfa.named` reads it; "MONO" has
        no filter.
    black_level_dn: pedestal [DN]. black_offsets_dn: black level less pedestal at the four places of a 2x2 block [DN].
    white_level_dn: largest code the frame can reach [DN].
    linearization: (stored codes,) uint16, ascending, the code in `dn` of each code that a file stores (DNG LinearizationTable);
        None: a file stores `dn` itself.
    noise_profile: (S, O) per colour plane (R, G, B, or one): variance of the signal x that runs from 0 at
        black to 1 at white is S x + O (DNG 1.4, NoiseProfile).
    gain_dn_per_e: K of EMVA 1288, codes for each of `mean_electrons` [DN/e-]; 0 where it is not known.
    dark_noise_dn: standard deviation of the code without light [DN]; 0 where it is not known.
    color_matrix: (3, 3) XYZ to camera under D65 (DNG ColorMatrix); None for MONO.
    color_matrix_a: the same under illuminant A; None when only one is known.
    forward_matrix_d65, forward_matrix_a: (3, 3) white-balanced camera to XYZ under D50 (DNG ForwardMatrix); None when
        not known.
    as_shot_neutral: camera RGB of a white surface in the scene's light, largest = 1 (DNG AsShotNeutral).
    format: how a raw file holds the codes.
    baseline_exposure_ev: exposure correction with which middle grey is developed to 18 % (DNG BaselineExposure); None when
        not known.
    date_time: time of the exposure, such as 2026-05-01 12:30:00; None when the shot does not give one.
    active_area: top, left, bottom, right of the light-sensitive area [px]; the rest is optical black. None: whole frame.
    charge_reach_px: photosites of the optical black beside the active area, and above and below it, that charge of the active
        area may reach by electrical crosstalk and blooming.
    warp_rectilinear: mapping from the corrected to the distorted picture (DNG 1.4, WarpRectilinear): kr0..kr3, kt0, kt1 of
        each colour plane, and the optical centre (x, y) as shares of the active area's sides; None without distortion.
    truth: further channels of the truth EXR: "variance" [DN^2], "depth" [m], "blur" [pixels], each (height, width)
        float32, "flow" (height, width, 2) [pixels], and "rgb" (height, width, 3, or 1 for MONO), 0 at black and 1 at white.
        docs/raw_files.md.
    resolved: the shot, seeds, versions and device, plain data for the JSON sidecar. LATE, too: a shot whose parts were
        replaced is described when it is read.
    """

    dn: np.ndarray
    mean_electrons: np.ndarray
    noise_free_dn: np.ndarray
    cfa: CfaName
    bit_depth: int
    black_level_dn: float
    white_level_dn: int
    noise_profile: tuple[tuple[float, float], ...]
    color_matrix: np.ndarray | None
    as_shot_neutral: tuple[float, ...]
    make: str
    model: str
    lens_model: str
    exposure_time_s: float
    f_number: float
    focal_length_mm: float
    focal_length_35mm_mm: float
    focus_distance_m: float
    iso: int
    color_matrix_a: np.ndarray | None = None
    forward_matrix_d65: np.ndarray | None = None
    forward_matrix_a: np.ndarray | None = None
    baseline_exposure_ev: float | None = None
    gain_dn_per_e: float = 0.0
    dark_noise_dn: float = 0.0
    name: str = "shot"
    black_offsets_dn: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    linearization: np.ndarray | None = None
    format: RawFormat = RawFormat()
    date_time: str | None = None
    active_area: tuple[int, int, int, int] | None = None
    charge_reach_px: tuple[int, int] = (1, 1)
    warp_rectilinear: tuple[tuple[tuple[float, ...], ...], tuple[float, float]] | None = None
    truth: dict[str, np.ndarray] = field(default_factory=dict)
    resolved: dict[str, object] = field(default_factory=dict)

    def __getstate__(self) -> dict[str, object]:
        """Return all fields, the late ones computed, so that a copy or another process needs no device."""
        return {**vars(self), **{name: getattr(self, name) for name in LATE}}

    @property
    def edges(self) -> tuple[int, int, int, int]:
        """Top, left, bottom and right of the active area [px]."""
        return self.active_area or (0, 0, *self.dn.shape)

    @property
    def active(self) -> tuple[slice, slice]:
        """Rows and columns of the active area."""
        top, left, bottom, right = self.edges
        return slice(top, bottom), slice(left, right)


for _name in LATE:
    setattr(Raw, _name, LateField(_name))
