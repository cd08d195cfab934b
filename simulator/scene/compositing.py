"""What a pinhole camera sees of a scene of several surfaces: they lie over one another, nearest first."""

from dataclasses import replace

import numpy as np

from simulator.scene.scene import Layer, Scene


def flatten_layers(scene: Scene) -> Scene:
    """One surface with the light of all, at `visible_depth_m`. A scene of one surface is returned as it is."""
    if not scene.behind:
        return scene
    planes, coverage = composite_planes(scene.layers)
    return replace(scene, planes=planes, depth_m=visible_depth_m(scene), coverage=coverage, behind=())


def composite_planes(layers: tuple[Layer, ...]) -> tuple[np.ndarray, np.ndarray | None]:
    """Sum over layers, nearest first, of planes * product of (1 - coverage) of those before; and the coverage of all.

    The "over" of Porter and Duff 1984 for colours times coverage. (height, width, bands) and (height, width), float32;
    of one layer they are the layer's own arrays.
    """
    first, *behind = layers
    if not behind:
        return first.planes, first.coverage
    planes, seen = first.planes.copy(), _uncovered(first.coverage, first.planes.shape[:2])
    for layer in behind:
        for row, light in enumerate(layer.planes):  # row by row: nothing of the picture's size is made on the way
            planes[row] += light * seen[row, :, None]
        seen *= _uncovered(layer.coverage, seen.shape)
    return planes, 1.0 - seen


def visible_depth_m(scene: Scene) -> float | np.ndarray:
    """Distance of what stands at each pixel [m], (height, width) float32, or a float when it is one.

    That of the first layer at which the layers so far cover more than half the pixel; infinity where they never do.
    """
    if scene.coverage is None:
        return scene.depth_m
    shape = scene.planes.shape[:2]
    depth, seen = np.full(shape, np.inf, np.float32), np.ones(shape, np.float32)
    for layer in scene.layers:
        open_before = seen >= 0.5
        seen *= _uncovered(layer.coverage, shape)
        np.copyto(depth, np.float32(layer.depth_m), where=open_before & (seen < 0.5))
    return depth


def _uncovered(coverage: np.ndarray | None, shape: tuple[int, int]) -> np.ndarray:
    """1 - coverage, (height, width) float32."""
    return np.zeros(shape, np.float32) if coverage is None else 1.0 - coverage
