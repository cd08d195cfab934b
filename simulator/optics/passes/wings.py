"""Adds the wings of diffraction to the light on the sensor."""

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.psf.wings import Wings
from simulator.sensor.camera.camera_sections import Window


def add_wings(
    device: Device, mosaic: Buffer, wings: Wings, weights: np.ndarray, cfa_macros: dict[str, object], window: Window
) -> None:
    """Add light from beyond the kernels to a mosaic of electron radiance, in place.

    weights: (bands, channels), of `OpticsPlan`. cfa_macros: of kernels/cfa.h for the window, the photosites of the mosaic.
    """
    veil = wings.veil(weights)
    device.run(
        device.kernel("wings", {"PER_CELL": f"{1.0 / wings.cell_px!r}f", **cfa_macros}),
        (window.width, window.height),
        None,
        mosaic=mosaic,
        veil=device.upload(veil),
        image_share=device.upload(wings.image_share.astype(np.float32)),
        window_x=window.x,
        window_y=window.y,
        rows=veil.shape[1],
        columns=veil.shape[2],
    )
