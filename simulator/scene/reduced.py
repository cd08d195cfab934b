"""A scene on a coarser grid, or its middle alone: for quick pictures, whose photosites see many of its pixels at a time."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from simulator.scene.scene import Layer, Scene, is_depth_map

if TYPE_CHECKING:
    from scipy.sparse import csr_array


def reduce_scene(scene: Scene, width: int) -> Scene:
    """Return the scene on a grid of at most `width` columns; a scene that has no more is returned as it is.

    Colours and coverages of the new grid are means over its pixels' areas. Depth is that of one pixel of each, since a mean of
    two surfaces lies on neither. A deep picture is that of its layers. Arrays of the result cannot be written to.
    """
    height, columns = scene.planes.shape[:2]
    if columns <= width:
        return scene
    shape = max(1, round(height * width / columns)), width
    reduced = replace(scene.with_layers(_reduce_layer(layer, shape) for layer in scene.layers), deep=None)
    for array in reduced.arrays():
        array.setflags(write=False)
    return reduced


def crop_scene(scene: Scene, width: int, height: int) -> Scene:
    """Return the middle of a scene, of at least `width` x `height` pixels where it has them; what is left lies where it did.

    A deep picture, and a scene without a field of view, are returned as they are. Arrays of the result cannot be written to.
    """
    rows, columns = scene.planes.shape[:2]
    down, across = (max(0, (whole - wanted) // 2) for whole, wanted in ((rows, height), (columns, width)))
    if scene.deep is not None or scene.field_of_view_deg is None or down == across == 0:
        return scene
    middle = slice(down, rows - down), slice(across, columns - across)
    tangent = math.tan(math.radians(0.5 * scene.field_of_view_deg)) * (columns - 2 * across) / columns
    middle_alone = scene.with_layers(_crop_layer(layer, middle) for layer in scene.layers)
    cropped = replace(middle_alone, field_of_view_deg=math.degrees(2.0 * math.atan(tangent)))
    for array in cropped.arrays():
        array.setflags(write=False)
    return cropped


def _crop_layer(layer: Layer, part: tuple[slice, slice]) -> Layer:
    """Return a part of a layer."""
    depth_m = np.ascontiguousarray(layer.depth_m[part]) if is_depth_map(layer.depth_m) else layer.depth_m
    coverage = None if layer.coverage is None else np.ascontiguousarray(layer.coverage[part])
    return Layer(np.ascontiguousarray(layer.planes[part]), depth_m, coverage)


def _reduce_layer(layer: Layer, shape: tuple[int, int]) -> Layer:
    """Return a layer on a grid of this height and width."""
    coverage = None if layer.coverage is None else np.clip(_mean(layer.coverage[..., np.newaxis], shape)[..., 0], 0.0, 1.0)
    depth_m = layer.depth_m
    if is_depth_map(depth_m):
        rows, columns = (
            ((np.arange(new) + 0.5) * (old / new)).astype(np.intp) for new, old in zip(shape, depth_m.shape, strict=True)
        )
        depth_m = np.ascontiguousarray(depth_m[np.ix_(rows, columns)])
    return Layer(np.maximum(_mean(layer.planes, shape), 0.0), depth_m, coverage)


def _mean(values: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Return the means of (height, width, channels) float32 over the areas of the pixels of a coarser grid."""
    height, width, channels = values.shape
    rows, columns = (_area_weights(*lengths) for lengths in zip((height, width), shape, strict=True))
    upright = (rows @ values.reshape(height, width * channels)).reshape(shape[0], width, channels)
    across = columns @ upright.transpose(1, 0, 2).reshape(width, shape[0] * channels)
    return np.ascontiguousarray(across.reshape(shape[1], shape[0], channels).transpose(1, 0, 2))


def _area_weights(length: int, wanted: int) -> "csr_array":
    """Return the share of each of `length` pixels in each of `wanted` longer ones, (wanted, length) float32."""
    from scipy.sparse import csr_array

    edges = np.arange(wanted + 1) * (length / wanted)
    first, last = np.floor(edges[:-1]).astype(np.intp), np.minimum(np.ceil(edges[1:]).astype(np.intp), length)
    counts = last - first
    starts = np.concatenate([[0], np.cumsum(counts)])
    pixels = np.arange(starts[-1]) - np.repeat(starts[:-1] - first, counts)
    low, high = np.repeat(edges[:-1], counts), np.repeat(edges[1:], counts)
    overlaps = np.minimum(high, pixels + 1.0) - np.maximum(low, pixels)
    shares = (overlaps * (wanted / length)).astype(np.float32)
    return csr_array((shares, pixels, starts), shape=(wanted, length))
