"""Light that blur circles near the focus bring over the borders of photosites of a fine scene, per radius, from its pixels."""

import numpy as np

from simulator.device.threads import in_threads
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.edge_contrast import BESIDE
from simulator.optics.defocus.edge_laws import radii_in_focus
from simulator.optics.defocus.path_contrast import parts_of
from simulator.optics.defocus.scene_light import LAMP, MOST, composite, layer_at, seen_contrast
from simulator.scene.scene import Scene
from simulator.scene.window_filters import window_mean


def crossings_in_focus(scene: Scene, to_share: np.ndarray, defocus: Defocus) -> float:
    """Return `SceneContrast.in_focus`; the arguments are those of `border_crossings`."""
    radii = [radii_in_focus(one, defocus.scale) for one in defocus.radii_px if isinstance(one, np.ndarray)]
    return max((border_crossings(scene, to_share, defocus, one) for one in radii if one.any()), default=0.0)


def border_crossings(scene: Scene, to_share: np.ndarray, defocus: Defocus, radii_px: np.ndarray | None = None) -> float:
    """Return `SceneContrast.crossings` of photosites anywhere among even squares; of a large scene, of parts.

    Over a border goes the difference of the light beside it, times BESIDE radii. Where light has a minimum all four count. With
    radii (height, width) it is the largest of the four, times the radius at that place. to_share: (bands, channels) shares of
    the brightest light per unit of the scene's planes.
    """
    side = max(round(defocus.scale), 1)

    def over_side(light: np.ndarray, axis: int) -> np.ndarray:
        first, count = side // 2, light.shape[axis] - side + 1  # of the windows that lie in the light
        return window_mean(light, side, axes=(axis,)).take(range(first, first + count), axis)

    def crossing(place: tuple[slice, slice]) -> np.ndarray:
        light = np.minimum(composite([layer_at(layer, place, to_share) for layer in scene.layers]), LAMP)
        if min(light.shape[:2]) < side + 2:
            return np.zeros(0)
        means = over_side(over_side(light, 0), 1)[1:-1, 1:-1]
        across, down = over_side(np.diff(light, axis=1), 0)[1:-1], over_side(np.diff(light, axis=0), 1)[:, 1:-1]
        gained = across[:, side:] - across[:, :-side] + down[side:] - down[:-side]
        if radii_px is not None:
            gained = np.max([abs(one) for one in (across[:, side:], across[:, :-side], down[side:], down[:-side])], axis=0)
            here = radii_px[place][1 + side // 2 :, 1 + side // 2 :][: gained.shape[0], : gained.shape[1]]
            gained = gained * here[..., None]
        return seen_contrast(BESIDE * np.abs(gained), means, defocus.accuracy).ravel()

    found = np.concatenate(in_threads(crossing, parts_of(scene, defocus.scale)))
    return float(np.quantile(found, MOST)) if found.size else 0.0
