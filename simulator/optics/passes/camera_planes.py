"""Spectral integration: a surface's spectral planes as electron radiance in each of the camera's colours."""

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.scene_part import ALIGNED_PX, ScenePart
from simulator.scene.scene import Layer

EIGHT = 8  # bands that kernels/camera_planes.cl sums side by side


def in_eights(weights: np.ndarray) -> np.ndarray:
    """Weights (bands, channels) as the kernel reads them: of 8 bands and more (eights, channels, 8) float32.

    The last eight ends with the last band, and has 0 for bands that the one before has counted.
    """
    bands, channels = weights.shape
    if bands < EIGHT:
        return np.ascontiguousarray(weights, np.float32)
    whole = bands // EIGHT * EIGHT
    eights = weights[:whole].reshape(-1, EIGHT, channels)
    if whole < bands:
        last = np.zeros((1, EIGHT, channels), weights.dtype)
        last[0, whole - bands :] = weights[whole:]
        eights = np.concatenate([eights, last])
    return np.ascontiguousarray(eights.transpose(0, 2, 1), np.float32)


def camera_planes(
    device: Device, layer: Layer, weights: np.ndarray, with_coverage: bool, part: ScenePart | None = None
) -> Buffer:
    """Device buffer (channels, scene height, scene width) float32 of a layer's electron radiance [e- s^-1 um^-2 sr^-1].

    weights: (bands, channels) float32 of `electron_radiance_weights`. with_coverage: append the layer's coverage (0 to 1).
    part: pixels that are computed, the others being undefined; None: all of the scene.
    """
    height, width, bands = layer.planes.shape
    part = part or ScenePart(0, 0, width, height)
    channels, pixels, rows = weights.shape[1], height * width, slice(part.y, part.y + part.height)
    planes = device.empty((channels + with_coverage, pixels), np.float32)
    scene = np.ascontiguousarray(layer.planes[rows], np.float32)
    arranged = in_eights(weights)
    device.run(
        device.kernel("camera_planes", {"BANDS": bands, "CHANNELS": channels}),
        (part.width, part.height, channels if arranged.ndim == 2 else 1),
        (ALIGNED_PX, 1, 1) if part.width < width else None,
        scene=device.share(scene),
        weights=device.upload(arranged),
        planes=planes,
        width=width,
        pixels=pixels,
        first_column=part.x,
        first_row=part.y,
        eights=len(arranged),
    )
    if with_coverage:
        first = 4 * (channels * pixels + part.y * width)
        if layer.coverage is None:
            device.fill(planes, np.float32(1.0), 4 * channels * pixels)
        else:
            device.write(planes, layer.coverage[rows].astype(np.float32, copy=False).reshape(-1), first)
    device.finish()  # the device may share memory with `scene`, which is freed on return
    return planes
