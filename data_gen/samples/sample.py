"""One training sample: what the camera gave, what it would have given without noise, and the numbers behind it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from simulator.sensor.camera.cfa import CfaName

Mode = Literal["single", "burst", "dark", "noise_only", "multi_exposure"]


@dataclass(frozen=True)
class Sample:
    """A pair for a denoiser. Everything is a mosaic in raw codes with its pedestal; packing is the writer's work.

    index: number in the data set; the sample is a function of the data set's seed and this number alone.
    noisy_dn: (frames, height, width) uint16 codes [DN]; one frame unless the mode is burst or multi_exposure. A code below
        black stays below black.
    clean_dn: (frames, height, width) float32, the code without noise and rounding of the reference exposure, which has
        `exposure_ratio` times the light of the noisy frame; clipped at white [DN].
    variance_dn2: (frames, height, width) float32, variance of each noisy code [DN^2]; None when it was not asked for.
    cfa: colours of the 2x2 block at the upper left corner, row by row.
    black_level_dn: mean code without light, dark current included, if none ended at 0 [DN]. white_level_dn: [DN].
    bit_depth: of the codes.
    gain_dn_per_e: K of EMVA 1288 [DN/e-]. read_noise_dn: standard deviation of that code in one frame [DN].
    white_balance: gains of R, G, B that make the light's white neutral, green = 1.
    color_matrix: (3, 3) XYZ to camera under D65; None when not known.
    exposure_ratios: light of the reference exposure over that of each noisy frame, (frames,).
    offsets_px: (frames, 2) shift of each frame against the first, y and x [px]; zeros unless the mode is burst. Of a moving
        camera, that of the crop's middle.
    frame_seeds: (frames,) seeds of what is new in each frame; body_seed: of what belongs to the camera body.
    sharp_dn: (frames, height, width) float32, what clean_dn would be if all rows were exposed in the middle of the exposure,
        within an instant; of a moving camera, as are all below; else None [DN].
    flow_px: (frames, 2, height, width) float32, way y and x on the picture from the first frame, of what stands there in the
        first frame, each in the middle of its row's exposure [px].
    mid_exposure_s: (frames,) middle of the exposure of the crop's rows [s], on the clock of the camera's path.
    poses_deg: (frames, 3) tilt, pan and roll of the camera then [deg].
    exposure_time_s: of each row [s]. readout_time_s: from the first row of the sensor to one past the last [s].
    source: name of the picture it was cut from; crop: top, left [px] of the picture; augmentation: flips and transposition.
    """

    index: int
    mode: Mode
    noisy_dn: np.ndarray
    clean_dn: np.ndarray
    variance_dn2: np.ndarray | None
    cfa: CfaName
    bit_depth: int
    black_level_dn: float
    white_level_dn: int
    gain_dn_per_e: float
    read_noise_dn: float
    white_balance: tuple[float, float, float]
    color_matrix: tuple[tuple[float, ...], ...] | None
    camera: str
    iso: int
    exposure_ratios: tuple[float, ...]
    offsets_px: tuple[tuple[float, float], ...]
    frame_seeds: tuple[int, ...]
    body_seed: int
    source: str
    crop: tuple[int, int]
    augmentation: str
    sharp_dn: np.ndarray | None = None
    flow_px: np.ndarray | None = None
    mid_exposure_s: tuple[float, ...] | None = None
    poses_deg: tuple[tuple[float, ...], ...] | None = None
    exposure_time_s: float | None = None
    readout_time_s: float | None = None
