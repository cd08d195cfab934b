"""Spectral integration: a surface's spectral planes as electron radiance in each of the camera's colours."""

import numpy as np

from simulator.device import Buffer, Device
from simulator.scene.scene import Layer


def camera_planes(device: Device, layer: Layer, weights: np.ndarray, with_coverage: bool) -> Buffer:
    """Device buffer (channels, scene height, scene width) float32 of a layer's electron radiance [e- s^-1 um^-2 sr^-1].

    weights: (bands, channels) float32 of `electron_radiance_weights`. with_coverage: append the layer's coverage (0 to 1).
    """
    height, width, bands = layer.planes.shape
    channels, pixels = weights.shape[1], height * width
    planes, scene = device.empty((channels + with_coverage, pixels), np.float32), np.ascontiguousarray(layer.planes, np.float32)
    device.run(
        device.kernel("camera_planes", {"BANDS": bands, "CHANNELS": channels}),
        (pixels, channels),
        None,
        scene=device.share(scene),
        weights=device.upload(weights),
        planes=planes,
    )
    if with_coverage:
        if layer.coverage is None:
            device.fill(planes, np.float32(1.0), 4 * channels * pixels)
        else:
            device.write(planes, layer.coverage.astype(np.float32, copy=False).reshape(-1), 4 * channels * pixels)
    device.finish()  # the device may share memory with `scene`, which is freed on return
    return planes
