"""A photograph of arrays: no file goes in, first_shot/ comes out, with a few numbers of it on the screen.

python examples/first_shot.py
"""

import sys
from pathlib import Path

import numpy as np

from photosite import (
    Camera,
    Exposure,
    Raw,
    Seeds,
    Shot,
    ThinLens,
    develop,
    load_camera,
    save,
    scene_from_rgb,
    simulate,
    write_image,
)


def grey_wedge(camera: Camera, iso: int) -> Shot:
    """Eight greys a stop apart, 2 m away; the upper half of them hangs on the wall behind, at 4 m."""
    rgb = np.tile(0.5 ** np.repeat(np.arange(8.0), 60)[:, None], (320, 1, 3))  # linear, 1 is white
    depth_m = np.full((320, 480), 2.0)
    depth_m[:160] = 4.0
    scene = scene_from_rgb(rgb, luminance_cd_m2=120.0, illuminant="D65", depth_m=depth_m)
    lens = ThinLens(focal_length_mm=50.0, f_number=2.0, focus_distance_m=2.0)
    return Shot(scene, lens, Exposure(time_s=1 / 2000, iso=iso), camera, Seeds(frame=1), name=f"iso{iso}")


def take(shot: Shot, out: Path) -> Raw:
    """Simulate, save the raw file with its truth, and develop it."""
    raw = simulate(shot, progress=lambda what, share: print(f"\r{share:4.0%} {what:8}", end="", file=sys.stderr))
    write_image(out / f"{shot.name}.png", develop(raw, bits=8))
    print("\r", save(raw, out).dng)
    return raw


if __name__ == "__main__":
    body = load_camera("sony_a7s2", ["camera.window={x: 1800, y: 1200, width: 640, height: 426}"])
    for iso in (1600, 25600):
        raw = take(grey_wedge(body, iso), Path("first_shot"))
        error_dn = raw.dn - raw.noise_free_dn
        print(f"ISO {raw.iso}: {raw.mean_electrons.mean():.0f} e- on average, noise {error_dn.std():.1f} DN")
