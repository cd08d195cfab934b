"""A raw frame made by hand for the tests of files and development."""

from typing import Any

import numpy as np

from simulator.raw.raw_image import Raw
from simulator.sensor.camera.cfa import CfaName

# Nikon D850 under D65 as Adobe's converter publishes it, in 1/10000 (LibRaw colordata.cpp).
COLOR_MATRIX = np.array([[1.0405, -0.3755, -0.1270], [-0.5461, 1.3787, 0.1793], [-0.1040, 0.2015, 0.6785]])
NEUTRAL = (0.5, 1.0, 0.625)


def random_frame(
    height: int = 96, width: int = 128, cfa: CfaName = "RGGB", bit_depth: int = 14, seed: int = 1, **changes: Any
) -> Raw:
    """Codes drawn evenly from 0 to the white level; every field set, `changes` over them."""
    white = 2**bit_depth - 1
    dn = np.random.default_rng(seed).integers(0, white, (height, width), dtype=np.uint16, endpoint=True)
    mono = cfa == "MONO"
    fields = dict(
        dn=dn,
        mean_electrons=(dn * np.float32(2.25)).astype(np.float32),
        noise_free_dn=(dn + np.float32(0.125)).astype(np.float32),
        cfa=cfa,
        bit_depth=bit_depth,
        black_level_dn=white // 32,
        white_level_dn=white,
        noise_profile=((2e-4, 3e-7),) if mono else ((2e-4, 3e-7), (2.5e-4, 4e-7), (3e-4, 5e-7)),
        gain_dn_per_e=0.5,
        color_matrix=None if mono else COLOR_MATRIX,
        as_shot_neutral=(1.0,) if mono else NEUTRAL,
        make="Photosite",
        model="Test Body",
        lens_model="50mm f/1.8 thin lens",
        exposure_time_s=1 / 125,
        f_number=2.8,
        focal_length_mm=50.0,
        focal_length_35mm_mm=75.2,
        focus_distance_m=2.5,
        iso=400,
        name="frame",
    )
    return Raw(**(fields | changes))
