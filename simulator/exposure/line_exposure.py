"""The pass in which lines collect different shares of the light."""

import numpy as np

from simulator.device import Buffer, Device
from simulator.exposure.exposed_light import ExposedLight, LightComponent
from simulator.sensor.camera.camera_sections import Window

ROWS = {"columns": 0, "rows": 1, "all": 2}  # macro of kernels/line_exposure.cl


def expose_lines(device: Device, mosaic: Buffer, window: Window, exposed: ExposedLight, component: LightComponent) -> None:
    """Multiply a mosaic of a component's light by the shares of its lines, in place. Nothing is launched where all are 1.

    mosaic: (height, width) float32 of electron radiance. window: area of the sensor that it covers.
    """
    shares = exposed.window_shares(component, window)
    if bool((shares == 1.0).all()):
        return
    kernel = device.kernel("line_exposure", {"ROWS": ROWS[exposed.axis]})
    device.run(kernel, (window.width, window.height), None, mosaic=mosaic, shares=device.upload(np.ascontiguousarray(shares)))


def add_exposed_lines(
    device: Device, mosaic: Buffer, light: Buffer, window: Window, exposed: ExposedLight, component: LightComponent
) -> None:
    """Add to a mosaic, in place, the light of another component times the shares of its lines.

    mosaic, light: (height, width) float32 of electron radiance. window: area of the sensor that both cover.
    """
    shares = np.ascontiguousarray(exposed.window_shares(component, window))
    kernel = device.kernel("add_line_exposure", {"ROWS": ROWS[exposed.axis]}, file="line_exposure.cl")
    arguments = {"mosaic": mosaic, "light": light, "shares": device.upload(shares)}
    device.run(kernel, (window.width, window.height), None, **arguments)
