"""Every variant of a raw file that we write, for the tests of other programs: payloads, levels, edges and orientations."""

import itertools
from typing import Any

import numpy as np

from helpers.flat_patches import patch_frame
from helpers.raw_frame import random_frame
from simulator.raw.raw_format import RawFormat
from simulator.raw.raw_image import Raw

CFAS = ("RGGB", "BGGR", "GRBG", "GBRG", "MONO")
DEPTHS = (8, 10, 12, 14, 16)
SIZES = ((96, 128), (97, 131), (22, 23), (300, 22))
# Exif 2.3, Orientation, which says what side of the picture row 0 and column 0 are: from the codes to an upright view.
UPRIGHT = {
    1: lambda stored: stored,  # top, left
    2: lambda stored: stored[:, ::-1],  # top, right
    3: lambda stored: stored[::-1, ::-1],  # bottom, right
    4: lambda stored: stored[::-1],  # bottom, left
    5: lambda stored: stored.swapaxes(0, 1),  # left, top
    6: lambda stored: stored.swapaxes(0, 1)[:, ::-1],  # right, top
    7: lambda stored: stored.swapaxes(0, 1)[::-1, ::-1],  # right, bottom
    8: lambda stored: stored.swapaxes(0, 1)[::-1],  # left, bottom
}


def as_stored(picture: np.ndarray, orientation: int) -> np.ndarray:
    """Turn an upright view back to the codes: 6 and 8 undo each other, the others themselves."""
    return UPRIGHT[{6: 8, 8: 6}.get(orientation, orientation)](picture)


def code_frames() -> dict[str, Raw]:
    """Frames of random codes by name, no two alike."""
    seeds, found = itertools.count(), {}

    def add(name: str, *arguments: Any, **changes: Any) -> None:
        found[name] = random_frame(*arguments, seed=next(seeds), **changes)

    for cfa, size, depth in itertools.product(CFAS, SIZES, DEPTHS):
        add(f"{cfa}_{size[0]}_{depth}", *size, cfa, depth)
    for payload, cfa, size, depth in itertools.product(("packed", "lossless_jpeg"), CFAS, SIZES[:2], DEPTHS):
        add(f"{payload}_{cfa}_{size[0]}_{depth}", *size, cfa, depth, format=RawFormat(payload))
    for orientation in UPRIGHT:
        add(f"held_{orientation}", format=RawFormat(orientation=orientation))
    for cfa, payload in itertools.product(CFAS, ("uncompressed", "packed", "lossless_jpeg")):
        add(f"edge_{cfa}_{payload}", 96, 128, cfa, active_area=(8, 16, 92, 124), format=RawFormat(payload))
    for cfa in CFAS:
        add(f"white_below_{cfa}", 97, 131, cfa, white_level_dn=9000)
        add(f"white_above_{cfa}", 97, 131, cfa, 12, black_level_dn=130, white_level_dn=15000)
        add(f"blacks_{cfa}", 97, 131, cfa, black_offsets_dn=(-11.0, -1.0, 9.0, 19.0))
        add(f"fractional_blacks_{cfa}", 97, 131, cfa, black_offsets_dn=(0.25, 0.5, 0.75, 0.0))
    return found


# What `patch_frame` takes, and the format. RawTherapee takes no file below about 100 kB for a raw file.
PICTURES = {cfa: ((240, 320, cfa, 14), {}) for cfa in CFAS}
PICTURES |= {f"{depth} bits": ((241, 333, "GBRG", depth), {}) for depth in (8, 10, 12, 16)}
PICTURES |= {"MONO, 16 bits": ((241, 333, "MONO", 16), {})}
PICTURES |= {f"packed, {depth} bits": ((401, 560, "GRBG", depth), {"payload": "packed"}) for depth in (10, 12, 14)}
PICTURES |= {f"JPEG, {depth} bits": ((401, 563, "BGGR", depth), {"payload": "lossless_jpeg"}) for depth in DEPTHS}
PICTURES |= {f"held {number}": ((240, 320, "GBRG", 14), {"orientation": number}) for number in range(2, 9)}
PICTURES |= {
    "edge": ((260, 340, "GRBG", 14), {"active_area": (12, 16, 252, 336)}),
    "black per place": ((240, 320, "GRBG", 14), {"black_offsets_dn": (0.0, 8.0, 16.0, 0.0)}),
    "black per place, greens apart": ((240, 320, "GRBG", 14), {"black_offsets_dn": (0.0, 8.0, 16.0, 24.0)}),
    "white above": ((240, 320, "RGGB", 12), {"light": 0.25, "black_level_dn": 130, "white_level_dn": 15000}),
    "white below": ((240, 320, "RGGB", 14), {"white_level_dn": 9000}),
}


def picture_frame(name: str) -> tuple[Raw, np.ndarray]:
    """One frame of PICTURES, and the linear sRGB (8, 3) of its patches."""
    arguments, changes = PICTURES[name]
    form = RawFormat(**{key: changes[key] for key in ("payload", "orientation") if key in changes})
    raw, shown = patch_frame(*arguments, format=form, **{key: changes[key] for key in changes if not hasattr(form, key)})
    if name == "white below":
        raw.dn[:16] = 16383  # above white, beside what `patch_means` looks at
    return raw, shown
