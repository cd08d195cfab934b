"""Compositing of a scene's layers: the picture, and the depth, that a pinhole camera sees of them."""

import itertools
from dataclasses import replace

import numpy as np

from simulator.scene.deep_pixels import DeepPixels
from simulator.scene.scene import Layer, Scene, is_depth_map


def flatten_layers(scene: Scene) -> Scene:
    """Return the scene as one layer: the composite of all, at `visible_depth_m`. A scene of one layer is returned as it is."""
    if not scene.behind:
        return scene
    planes, coverage = composite_planes(scene.layers)
    return replace(scene, planes=planes, depth_m=visible_depth_m(scene), coverage=coverage, behind=())


def join_layers(scene: Scene) -> Scene:
    """Return the scene with layers one behind the other at one distance as one layer, their composite.

    Rays that start at a photosite meet them at one place: what is seen is their composite there, no product of means of each.
    A scene without such layers, and a deep picture, is returned as it is.
    """
    layers = scene.layers
    same = [_are_at_one_distance(*pair) for pair in itertools.pairwise(layers)]
    if scene.deep is not None or not any(same):
        return scene

    def join() -> Scene:
        runs = [[layers[0]]]
        for layer, is_same in zip(layers[1:], same, strict=True):
            if is_same:
                runs[-1].append(layer)
            else:
                runs.append([layer])
        joined = [Layer(planes, run[0].depth_m, covered) for run in runs for planes, covered in [composite_planes(tuple(run))]]
        made = scene.with_layers(joined)
        if not any(array.flags.writeable for array in scene.arrays()):  # plans are kept with what is joined, too
            for array in made.arrays():
                array.setflags(write=False)
        return made

    return scene.remember("joined layers", join)


def _are_at_one_distance(a: Layer, b: Layer) -> bool:
    return not is_depth_map(a.depth_m) and not is_depth_map(b.depth_m) and bool(a.depth_m == b.depth_m)


def composite_planes(layers: tuple[Layer, ...]) -> tuple[np.ndarray, np.ndarray | None]:
    """Composite layers, nearest first: the sum of planes * product of (1 - coverage) of all nearer layers; and its coverage.

    The operator "over" of Porter and Duff 1984, for planes that are multiplied by coverage. Returns (height, width, bands) and
    (height, width), float32; of one layer, the layer's own arrays.
    """
    first, *behind = layers
    if not behind:
        return first.planes, first.coverage
    planes, transmittance = first.planes.copy(), _uncovered(first.coverage, first.planes.shape[:2])
    for layer in behind:
        for row, light in enumerate(layer.planes):  # row by row, so that no temporary array is as large as the picture
            planes[row] += light * transmittance[row, :, None]
        transmittance *= _uncovered(layer.coverage, transmittance.shape)
    return planes, 1.0 - transmittance


def visible_depth_m(scene: Scene) -> float | np.ndarray:
    """Return the distance of the visible surface at each pixel [m], (height, width) float32, or a float for one distance.

    It is that of the first layer at which this layer and all nearer ones cover more than half the pixel; infinity where all
    layers together cover no more than half.
    """
    if scene.coverage is None:
        return scene.depth_m
    shape = scene.planes.shape[:2]
    depth, transmittance = np.full(shape, np.inf, np.float32), np.ones(shape, np.float32)
    for layer in scene.layers:
        was_open = transmittance >= 0.5
        transmittance *= _uncovered(layer.coverage, shape)
        np.copyto(depth, np.float32(layer.depth_m), where=was_open & (transmittance < 0.5))
    return depth


def deep_pixels_of(layers: tuple[Layer, ...]) -> DeepPixels:
    """Return layers as samples of pixels, each layer one of the samples: a pixel that it covers is a surface of its depth."""
    shape = layers[0].planes.shape[:2]
    planes, alpha, depth, counts = [], [], [], []
    for layer in layers:
        coverage = np.ones(shape, np.float32) if layer.coverage is None else layer.coverage
        own = np.flatnonzero(coverage)
        planes.append(layer.planes.reshape(-1, layer.planes.shape[2])[own])
        alpha.append(coverage.ravel()[own])
        depth.append(np.broadcast_to(np.asarray(layer.depth_m, np.float64), shape).ravel()[own])
        counts.append(coverage.ravel() != 0)
    starts = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    depth_m = np.concatenate(depth)
    return DeepPixels(starts, shape[1], np.concatenate(planes), np.concatenate(alpha), depth_m, depth_m, len(layers))


def _uncovered(coverage: np.ndarray | None, shape: tuple[int, ...]) -> np.ndarray:
    """Return 1 - coverage, (height, width) float32; 0 for a layer that covers every pixel."""
    return np.zeros(shape, np.float32) if coverage is None else 1.0 - coverage
