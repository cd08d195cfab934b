"""Light of a scene to which errors are compared: its brightest light, and its differences between neighbouring pixels."""

from dataclasses import dataclass

import numpy as np

from simulator.optics.defocus.accuracy import LAMP_PEAK, Accuracy
from simulator.scene.bands import most_of_bands
from simulator.scene.content_keys import freeze
from simulator.scene.sample_places import sample_places
from simulator.scene.scene import Layer, Scene

LEAST_DETAIL = 1e-9  # of an even scene, which others divide by; what follows from it is not seen
MOST = 0.999  # quantile that counts as the greatest contrast
LAMP = 2.0  # brightest lights of which a single pixel is a lamp
BRIGHT = 0.999  # quantile of the scene's radiance that counts as its brightest, so that a few highlights do not loosen the rest
_ROWS = 256  # of a scene that are searched at a time
_SAMPLES = 400  # places per axis at which the scene's radiance is sampled


def brightest_electrons(scene: Scene, weights: np.ndarray, per_radiance: float) -> float:
    """Electrons of the brightest light: greatest BRIGHT quantile of all layers and channels.

    weights: (bands, channels) of scene planes in electron radiance. per_radiance: electrons per electron radiance.
    """
    brightest = 0.0
    for layer in scene.layers:
        places = np.ix_(*(sample_places(size, _SAMPLES) for size in layer.planes.shape[:2]))
        light = layer.planes[places].reshape(-1, layer.planes.shape[2]) @ weights
        brightest = max(brightest, float(np.quantile(light, BRIGHT, axis=0).max()))
    return float(brightest * per_radiance)


def peak_electrons(scene: Scene, weights: np.ndarray, per_radiance: float) -> float:
    """Electrons of the brightest pixel of all layers; the arguments are those of `brightest_electrons`."""
    return float(max((most_of_bands(layer.planes) @ weights).max() for layer in scene.layers) * per_radiance)


def lamp_electrons(accuracy: Accuracy) -> float:
    """Electrons above which a pixel is a lamp, which counts by itself; infinite in a scene without one."""
    return LAMP_PEAK * accuracy.electrons if accuracy.has_lamps else np.inf


def brighter_pixels(planes: np.ndarray, weights: np.ndarray, limits: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rows and columns of the pixels above a limit in any channel, (pixels,), and their light (pixels, channels).

    planes: (rows, columns, bands). weights: (bands, channels). limits: of each channel, or of all [electron radiance].
    """
    rows, columns, lights = [], [], []
    for first in range(0, len(planes), _ROWS):
        light = planes[first : first + _ROWS] @ weights.astype(np.float32)
        row, column = np.nonzero((light > limits).any(axis=-1))
        rows.append(row + first)
        columns.append(column)
        lights.append(light[row, column])
    return np.concatenate(rows), np.concatenate(columns), np.concatenate(lights)


def scene_detail(
    scene: Scene,
    weights: np.ndarray,
    per_radiance: float,
    accuracy: Accuracy,
    quantile: float = BRIGHT,
    lit: float = 0.1,
    has_lamps: bool = True,
    apart: int = 1,
) -> float:
    """Difference between neighbouring pixels of the scene, as a share of the brightest light: this quantile, above 0.

    A difference counts as much as one that is seen at the brightest light as clearly as it is seen in the noise at its own
    place, at the darker pixel with the share `lit` of the difference. weights, per_radiance: as of `brightest_electrons`.
    accuracy: of the scene's brightest light. has_lamps: whether differences beside lamps count. apart: distance of the pixels
    that are compared, over which their difference is divided [px].
    """
    noise_at_brightest = accuracy.electrons + accuracy.read_noise_e**2
    found, most_e = [LEAST_DETAIL], np.inf if has_lamps else lamp_electrons(accuracy)
    for layer in scene.layers:
        for axis in (0, 1):
            aways = [apart * (axis == side) for side in (0, 1)]
            places = [
                sample_places(max(size - away, 0), _SAMPLES) for size, away in zip(layer.planes.shape, aways, strict=False)
            ]
            first, next_ = np.ix_(*places), np.ix_(*(own + away for own, away in zip(places, aways, strict=True)))
            here, there = (per_radiance * (layer.planes[place] @ weights) for place in (first, next_))
            if not here.size:
                continue
            step = np.abs(here - there) / apart
            noise = np.minimum(here, there) + lit * step + accuracy.read_noise_e**2
            seen = step * np.sqrt(noise_at_brightest / np.maximum(noise, 1.0)) / accuracy.electrons
            seen[np.maximum(here, there) > most_e] = 0.0
            found.append(float(np.quantile(seen, quantile, axis=(0, 1)).max()))
            if layer.coverage is not None:
                borders = np.abs(layer.coverage[first] - layer.coverage[next_])
                found.append(float(np.quantile(borders, quantile)) / apart)
    return max(found)


@dataclass(frozen=True)
class SceneDetail:
    """Detail of a scene, as shares of its brightest light.

    edges: of `scene_detail`. bend: of `scene_bends`. Both in the noise of photosites with a share of the difference; dark,
    dark_bend: with none of it.
    """

    edges: float
    dark: float
    bend: float
    dark_bend: float


def sharpest_detail(scene: Scene, weights: np.ndarray, per_radiance: float, accuracy: Accuracy, lit: float) -> SceneDetail:
    """Return the largest differences and bends of all pixels, however few these are: of a small thing before an even wall.

    Those beside lamps, which count by themselves, are left out. Arguments are as of `scene_detail`.
    """
    key = "sharpest", freeze((weights, per_radiance, accuracy, lit))
    return scene.remember(key, lambda: _sharpest_detail(scene, weights, per_radiance, accuracy, lit))


def _sharpest_detail(scene: Scene, weights: np.ndarray, per_radiance: float, accuracy: Accuracy, lit: float) -> SceneDetail:
    floor_e2, most_e = accuracy.read_noise_e**2, lamp_electrons(accuracy)
    found = np.zeros(4)  # edges, dark, bend, dark_bend [standard deviations]
    for layer in scene.layers:
        rows = len(layer.planes)
        for first in range(0, rows, _ROWS):
            places = np.clip(np.arange(first - 1, min(first + _ROWS, rows) + 1), 0, rows - 1)
            light = np.pad(per_radiance * (layer.planes[places] @ weights), ((0, 0), (1, 1), (0, 0)), "edge")
            middle, left, right = light[1:-1, 1:-1], light[1:-1, :-2], light[1:-1, 2:]
            above, below = light[:-2, 1:-1], light[2:, 1:-1]
            least = np.minimum(np.minimum(np.minimum(left, right), np.minimum(above, below)), middle)
            span = np.maximum(np.maximum(np.maximum(left, right), np.maximum(above, below)), middle) - least
            bend = np.hypot(left + right - 2.0 * middle, above + below - 2.0 * middle)
            bend[least + span > most_e] = 0.0
            pairs = [(np.minimum(one, middle), np.maximum(one, middle)) for one in (right, below)]
            steps = [(np.where(more > most_e, 0.0, more - less), less, more - less) for less, more in pairs]
            for fields, own in ((slice(0, 2), steps), (slice(2, 4), [(bend, least, span)])):
                for difference, darkest, whole in own:
                    noise_e2 = (np.maximum(darkest + share * whole + floor_e2, 1.0) for share in (lit, 0.0))
                    seen = [float((difference / np.sqrt(one)).max()) for one in noise_e2]
                    found[fields] = np.maximum(found[fields], seen)
    found *= np.sqrt(accuracy.electrons + floor_e2) / accuracy.electrons
    covers = (layer.coverage for layer in scene.layers if layer.coverage is not None)
    borders = [float(np.abs(np.diff(one, axis=axis)).max(initial=0.0)) for one in covers for axis in (0, 1)]
    found[:2] = np.maximum(found[:2], max(borders, default=0.0))
    return SceneDetail(*(max(float(one), LEAST_DETAIL) for one in found))


def mixed_edges_error(scene: Scene, weights: np.ndarray, per_radiance: float, accuracy: Accuracy, scale: float) -> float:
    """Error of compositing means over photosites where layers shift apart, as a share of the brightest light.

    A photosite that an edge of a layer crosses lacks the covariance of what the edge covers and the light behind. That is at
    most a quarter of the light's range there (Popoviciu's and Cauchy and Schwarz' inequalities): halves of a photosite
    differ by as much as neighbouring pixels, or by half of the pixels that it holds. scale: scene pixels per photosite.
    Arguments are else as of `scene_detail`; the scene has several layers.
    """
    detail = scene_detail(scene.with_layers(scene.behind), weights, per_radiance, accuracy)
    return 0.25 * max(0.5 * scale, min(scale, 1.0)) * detail


def flattened_error(scene: Scene, weights: np.ndarray, per_radiance: float, accuracy: Accuracy, quantile: float) -> float:
    """Error of layers of a coarse scene that are composited pixel by pixel, as a share of the brightest light: this quantile.

    Light and coverage are linear between pixels, and so is not their product: rays that meet one layer after the other see past
    the edge of a layer where it has covered the pixel behind. Found are places in the middle between two and four pixels, where
    the difference is largest. It counts in the noise of the light that rays see. Arguments are as of `scene_detail`.
    """
    if not scene.behind:
        return 0.0
    size = scene.planes.shape[:2]
    rows, columns = (sample_places(length - 1, _SAMPLES) for length in size)
    found = [0.0]
    for ways in (((0, 0), (0, 1)), ((0, 0), (1, 0)), ((0, 0), (0, 1), (1, 0), (1, 1))):
        places = [np.ix_(rows + down, columns + right) for down, right in ways]
        through, flat = np.ones(1), np.ones((len(places), 1, 1))
        seen_e, flattened_e = np.zeros(1), np.zeros(1)
        for layer in scene.layers:
            light = np.stack([per_radiance * (layer.planes[place] @ weights) for place in places])
            seen_e = seen_e + np.expand_dims(through, -1) * light.mean(axis=0)
            flattened_e = flattened_e + (flat[..., None] * light).mean(axis=0)
            if layer.coverage is None:
                break
            open_ = 1.0 - np.stack([layer.coverage[place] for place in places])
            through, flat = through * open_.mean(axis=0), flat * open_
        noise_e = np.sqrt(np.maximum(seen_e + accuracy.read_noise_e**2, 1.0))
        error = np.abs(flattened_e - seen_e) / noise_e
        if error.size:
            found.append(float(np.quantile(error, quantile, axis=(0, 1), method="higher").max()))
    return max(found) * accuracy.sigma


def scene_bends(
    scene: Scene,
    weights: np.ndarray,
    per_radiance: float,
    accuracy: Accuracy,
    quantile: float,
    lit: float,
    has_lamps: bool = True,
) -> float:
    """Bend of the light at pixels between which it is linear, as a share of the brightest light: this quantile.

    The bend is the change of the slope from pixel to pixel, along rows and columns together, which a way over the pixel meets
    at most. It counts by the noise at its own place, at the darkest of the pixel and its neighbours with the share `lit` of
    their range. Arguments and result are else as of `scene_detail`.
    """
    noise_at_brightest = accuracy.electrons + accuracy.read_noise_e**2
    found, most_e = [LEAST_DETAIL], np.inf if has_lamps else lamp_electrons(accuracy)
    for layer in scene.layers:
        size = layer.planes.shape[:2]
        rows, columns = (sample_places(length, _SAMPLES) for length in size)
        places = [
            np.ix_(np.clip(rows + down, 0, size[0] - 1), np.clip(columns + right, 0, size[1] - 1))
            for down, right in ((0, 0), (0, -1), (0, 1), (-1, 0), (1, 0))
        ]
        five = np.stack([per_radiance * (layer.planes[place] @ weights) for place in places])
        bend = np.hypot(five[1] + five[2] - 2.0 * five[0], five[3] + five[4] - 2.0 * five[0])
        darkest = five.min(axis=0)
        noise = darkest + lit * (five.max(axis=0) - darkest) + accuracy.read_noise_e**2
        seen = bend * np.sqrt(noise_at_brightest / np.maximum(noise, 1.0)) / accuracy.electrons
        seen[five.max(axis=0) > most_e] = 0.0
        found.append(float(np.quantile(seen, quantile, axis=(0, 1), method="higher").max()))
    return max(found)


def seen_contrast(difference: np.ndarray, light: np.ndarray, accuracy: Accuracy) -> np.ndarray:
    """Difference of light that is as many standard deviations of the noise at the brightest light as it is at its own place."""
    noise = accuracy.electrons * np.maximum(light, 0.0) + accuracy.read_noise_e**2
    return np.abs(difference) * np.sqrt((accuracy.electrons + accuracy.read_noise_e**2) / np.maximum(noise, 1.0))


def shifted(values: np.ndarray, axis: int, way: int, size: int) -> np.ndarray:
    """So many values along an axis, so many places farther on; beyond its ends those at the ends."""
    return np.take(values, np.clip(np.arange(size) + way, 0, values.shape[axis] - 1), axis=axis)


def composite(layers: list[tuple[np.ndarray, np.ndarray | None]]) -> np.ndarray:
    """Light of layers over one another. layers: light (..., channels) times coverage, and coverage; None: it is 1."""
    light, through = np.zeros_like(layers[0][0], np.float32), np.ones((*layers[0][0].shape[:-1], 1), np.float32)
    for own, coverage in layers:
        light = light + through * own
        if coverage is None:
            break
        through = through * (1.0 - coverage[..., None])
    return light


def layer_at(layer: Layer, place: tuple[np.ndarray | slice, ...], to_share: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]:
    """Light, that of lamps left out, and coverage of a layer at some of its pixels."""
    return np.minimum(layer.planes[place] @ to_share, LAMP), None if layer.coverage is None else layer.coverage[place]
