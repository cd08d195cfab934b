"""Veiling glare: light that surfaces and edges of a lens scatter over the whole sensor (ISO 9358).

A fraction g of the light is scattered evenly: E = (1 - g) E_image + g * mean of E_image over the whole sensor, in each colour
by itself. A small black patch in a uniform field then has g times the irradiance of the field: the veiling glare index.
"""

import math
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.error_term import ErrorTerm
from simulator.optics.geometry.projection import Projection
from simulator.scene.bands import least_of_bands, most_of_bands
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.kernel.kernel_program import sensor_defines
from simulator.sensor.stages.irradiance import Irradiance

GLARE = "veiling glare"  # effect of the terms
LEAST_OPEN = 1e-4  # relative illumination below which the veil fades with the image
STRIPS = 64  # least number along a side of the sensor, so that relative illumination is constant within each


class Noise(Protocol):
    """Light and noise of a shot, `simulator.optics.defocus.accuracy.Accuracy`."""

    @property
    def electrons(self) -> float:
        """Of the brightest light [e-]."""
        ...

    @property
    def read_noise_e(self) -> float:
        """Of a photosite [e-]."""
        ...

    @property
    def electrons_per_radiance(self) -> float:
        """Of a photosite [e- per e- s^-1 um^-2 sr^-1]."""
        ...


@dataclass(frozen=True)
class VeilingGlare:
    """Scattered light, even over the sensor.

    share: g. irradiance: (channels,) float64 of the veil, g * mean of the image's electron irradiance [e- s^-1 um^-2].
    by_band: (bands, channels) float64, the parts of it that come from each band of the scene.
    least_radiance: the veil of the darkest channel, as electron radiance [e- s^-1 um^-2 sr^-1]. range_radiance: most by which
    light of a channel differs over the scene [e- s^-1 um^-2 sr^-1].
    """

    share: float
    irradiance: np.ndarray
    by_band: np.ndarray | None = None
    least_radiance: float = 0.0
    range_radiance: float = math.inf

    def lit_by(self, bands: slice) -> Self:
        """Return the scattered light of these bands of the scene alone."""
        assert self.by_band is not None  # plan_veiling_glare gives it
        part = np.zeros_like(self.by_band)
        part[bands] = self.by_band[bands]
        return replace(self, irradiance=part.sum(axis=0), by_band=part)


def plan_veiling_glare(
    share: float, scene: Scene, weights: np.ndarray, projection: Projection, camera: Camera, irradiance: Irradiance
) -> VeilingGlare | None:
    """Scattered light of a scene of one surface; None without.

    weights: (bands, channels) [e- s^-1 um^-2 sr^-1]. The mean is that of the scene's own pixels over the whole sensor, in
    float64, so that it does not depend on the window; blur, motion and distortion change it by what `glare_errors` states.
    """
    if share == 0:
        return None
    height, width = scene.planes.shape[:2]
    row, tall, y = _strips(camera.height_px, height, projection.offset_y, projection.scale)
    column, wide, x = _strips(camera.width_px, width, projection.offset_x, projection.scale)
    mean = np.zeros(scene.planes.shape[2])
    for pixel, share_of_sensor, place in zip(row, tall, y - irradiance.centre_y_px, strict=True):
        open_ = irradiance.relative_illumination(np.hypot(place, x - irradiance.centre_x_px))
        seen = np.bincount(column, wide * open_, width)  # of this row's pixels
        mean += share_of_sensor * (seen @ scene.planes[pixel])
    scattered_sr = share * irradiance.effective_solid_angle_sr
    by_band = scattered_sr * (mean[:, np.newaxis] * weights)
    differs = float(((most_of_bands(scene.planes) - least_of_bands(scene.planes)) @ np.abs(weights)).max())
    return VeilingGlare(share, scattered_sr * (mean @ weights), by_band, share * float((mean @ weights).min()), differs)


def glare_errors(
    glare: VeilingGlare | None, noise: Noise, sensor_px: tuple[int, int], moved_px: float, stretch: float
) -> list[ErrorTerm]:
    """Return the error of the veil by what is neglected in the mean of the light.

    moved_px: way over which blur or motion moves light. stretch: largest local magnification of a distortion. Light that moves
    by a way, either way alike, crosses a border by a quarter of it on average, and what comes in its place differs by at most
    the range of the light. Light that is magnified weighs more: the mean is off by up to half of the range of the light times
    half of the range of the magnified area. Lamps are left out of that range.
    """
    if glare is None:
        return []
    width, height = sensor_px
    crossed = min(0.25 * moved_px * 2.0 * (width + height) / (width * height), 1.0)
    weighed = min(0.25 * abs(stretch**2 - 1.0), 1.0)
    noise_e = math.sqrt(max(glare.least_radiance * noise.electrons_per_radiance + noise.read_noise_e**2, 1.0))
    range_e = min(glare.range_radiance * noise.electrons_per_radiance, noise.electrons)
    sigma = glare.share * (crossed + weighed) * range_e / noise_e
    return [
        ErrorTerm(GLARE, "the mean light of the scene without blur, motion and distortion", sigma, "lower lens.veiling_glare")
    ]


def _strips(photosites: int, pixels: int, offset: float, scale: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Strips along an axis of the sensor: the scene pixel of each, its fraction of the side, its centre [photosites]."""
    first, last = (min(max(edge, 0.0), float(pixels)) for edge in (offset, offset + scale * photosites))
    inner = np.arange(np.floor(first) + 1.0, np.ceil(last))
    edges = np.unique(np.concatenate([np.linspace(first, last, STRIPS + 1), inner]))
    middle = 0.5 * (edges[:-1] + edges[1:])
    return middle.astype(np.intp), np.diff(edges) / (last - first), (middle - offset) / scale


def add_veiling_glare(
    device: Device,
    mosaic: Buffer,
    glare: VeilingGlare,
    irradiance: Irradiance,
    cfa_macros: dict[str, object],
    window: Window,
) -> None:
    """Scatter a fraction of the light evenly over a mosaic of electron radiance, in place.

    irradiance: of the lens, by which the fused kernel multiplies afterwards. window: photosites of the mosaic.
    """
    defines, numbers = sensor_defines((irradiance,))
    lens = {name: value for name, value in defines.items() if name.startswith(irradiance.stem.upper())}
    device.run(
        device.kernel("veiling_glare", lens | cfa_macros),
        (window.width, window.height),
        None,
        mosaic=mosaic,
        veil=device.upload(glare.irradiance.astype(np.float32)),
        parameters=device.upload(numbers),
        window_x=window.x,
        window_y=window.y,
        image_share=1.0 - glare.share,
        least_open=LEAST_OPEN * irradiance.effective_solid_angle_sr,
    )
