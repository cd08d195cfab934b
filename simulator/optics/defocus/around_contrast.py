"""Range of the light within the blur circles of surfaces whose radius varies, apart for circles of each size.

Means between two tabulated radii err by how much the light varies that circles of these radii see, and most where circles are
small: the light around them counts there, and not what the largest circle of the scene holds.
"""

import math

import numpy as np

from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.edge_contrast import WIDEST_PX
from simulator.optics.defocus.layer_contrast import Surface
from simulator.optics.defocus.scene_light import MOST, composite, seen_contrast
from simulator.scene.window_filters import window_maximum, window_mean, window_minimum

AROUND_PX = (0.25, 0.375, 0.625, 0.75, 1.0, 1.5, 2.0, 3.0, 6.0, 12.0, math.inf)  # largest blur radius of each size
BEYOND_PX = 1.0  # what images of the next tabulated radius reach beyond a circle, and half of a diagonal of a photosite


def around_contrast(layers: list[Surface], defocus: Defocus, scale: float, step: int) -> tuple[float, ...]:
    """Return `SceneContrast.around` of layers at rest, front to back.

    layers: with all scene pixels, or every so many (step). scale: of these pixels per photosite.

    The light behind a layer is that at rest, or its mean within the largest circle of what is behind: what the edge of a
    layer out of focus lies before is out of focus, too.
    """
    sizes: list[list[np.ndarray]] = [[] for _ in AROUND_PX]
    for number, radius in enumerate(defocus.radii_px[: len(layers)]):
        if not isinstance(radius, np.ndarray):
            continue
        radii_px = np.abs(radius[::step, ::step])
        size_of, smallest_px = np.searchsorted(AROUND_PX, radii_px), float(radii_px.min())
        lights = [composite(layers[number:])]
        if layers[number][1] is not None and number + 1 < len(layers):
            behind_px = max(float(np.abs(one).max()) for one in defocus.radii_px[number + 1 : len(layers)])
            behind = window_mean(composite(layers[number + 1 :]), _width(behind_px, scale), "nearest")
            lights.append(composite([layers[number], (behind, None)]))
        for size in np.unique(size_of).tolist():
            least_px = max(AROUND_PX[size - 1] if size else 0.0, smallest_px)
            width = _width(min(AROUND_PX[size], defocus.largest_px) + BEYOND_PX, scale)
            within = max(_width(max(least_px - 0.5, 0.0), scale), round(scale))  # a circle inside a photosite sees that alone
            there = size_of == size
            high, low, mean = (
                join([window(light, side, "nearest")[there] for light in lights], axis=0)
                for join, window, side in (
                    (np.max, window_maximum, width),
                    (np.min, window_minimum, width),
                    (np.min, window_mean, within),
                )
            )
            sizes[size].append(seen_contrast(high - low, mean, defocus.accuracy).max(axis=-1))
    pixels = layers[0][0][..., 0].size
    return tuple(_most(np.concatenate(parts), pixels) if parts else 0.0 for parts in sizes)


def _most(seen: np.ndarray, pixels: int) -> float:
    """Greatest contrast but for those of the share MOST leaves of a frame of so many pixels; 0: there are no more."""
    beyond = int((1.0 - MOST) * pixels)
    return float(np.partition(seen, -1 - beyond)[-1 - beyond]) if len(seen) > beyond else 0.0


def _width(radius_px: float, scale: float) -> int:
    """Width of a window that holds a circle in the middle of a pixel [pixels]."""
    return min(2 * math.ceil(radius_px * scale) + 1, WIDEST_PX)
