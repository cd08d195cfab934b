"""The reference blur of deep pictures: rays through a thin lens to the samples of each pixel, which are never merged."""

import math
from dataclasses import dataclass

import numpy as np

from simulator.device import Device
from simulator.optics.defocus.field_pupil import CatsEyes
from simulator.optics.geometry.projection import Projection
from simulator.optics.ray_reference.layered_rays import CfaBlock, ray_arguments, ray_defines
from simulator.scene.deep_pixels import DeepPixels, surface_slopes
from simulator.sensor.camera.camera import Window

STEEPEST = 0.6  # largest change of the radius per photosite and axis within one surface
OPAQUE = 80.0  # optical depth that counts as opaque
BESIDE_PX = 2.0  # t before the least and beyond the greatest radius, where tilted samples may be met


@dataclass(frozen=True)
class DeepBlur:
    """Signed blur radii of the samples of a deep picture [photosites].

    near_px, far_px: (samples,) at their near and far ends. infinite_px: of infinite distance.
    """

    near_px: np.ndarray
    far_px: np.ndarray
    infinite_px: float


class DeepPicture:
    """Samples on the device. weights: (bands, channels) [e- s^-1 um^-2 sr^-1], electron radiance of each plane."""

    def __init__(self, device: Device, pixels: DeepPixels, blur: DeepBlur, weights: np.ndarray, projection: Projection) -> None:
        self.device, self.projection, self.channels = device, projection, weights.shape[1]
        with np.errstate(divide="ignore"):
            depth = np.minimum(-np.log1p(-pixels.alpha.astype(np.float64)), OPAQUE)
        slopes = surface_slopes(pixels, blur.near_px, STEEPEST / projection.scale)
        table = np.stack([blur.near_px, blur.far_px, pixels.alpha, depth, *slopes], axis=-1)
        colour = (pixels.planes @ weights).T
        spans = _spans(pixels, blur)
        crossed = float((spans[:, 1] - spans[:, 0]).max())
        crossed *= projection.scale * 2.0 * math.sqrt(2.0)  # by a ray through a corner of the pupil
        if projection.warp is not None:
            crossed *= 2.0  # lenses magnify less
        self.buffers = {
            "starts": device.upload(pixels.starts.astype(np.uint32)),
            "samples": device.upload(table.astype(np.float32)),
            "colour": device.upload(colour.astype(np.float32)),
            "spans": device.upload(spans.astype(np.float32)),
        }
        self.struct = {
            "width": projection.scene_width,
            "height": projection.scene_height,
            "layers": pixels.layers,
            "samples": len(pixels.alpha),
            "steps": math.ceil(crossed) + 4,
            "scale": projection.scale,
            "offset_x": projection.offset_x,
            "offset_y": projection.offset_y,
            "reach": max(float(np.abs(spans).max()), 1.0),
            "infinite": blur.infinite_px,
        }

    def sample(
        self, points: np.ndarray, frame: Window, cfa: CfaBlock, places: np.ndarray, eyes: CatsEyes | None = None
    ) -> np.ndarray:
        """Mean light of some photosites of a frame in their own colours, (n,) float32.

        points: of `ray_samples`. cfa, places, eyes: as of `sample_lens`.
        """
        warp = self.projection.warp
        defines: dict[str, object] = {"DISTORTION": 0} if warp is None else {"DISTORTION": 1, **warp.macros()}
        light = self.device.empty(places.shape, np.float32)
        self.device.run(
            self.device.kernel("lens_deep", ray_defines(1, cfa, eyes) | defines),
            places.shape,
            None,
            places=self.device.upload(places.astype(np.uint32)),
            light=light,
            picture=self.struct,
            **self.buffers,
            **ray_arguments(self.device, points, frame, eyes),
        )
        return self.device.download(light, places.shape, np.float32)


def _spans(pixels: DeepPixels, blur: DeepBlur) -> np.ndarray:
    """Least and greatest radius at which a ray may meet samples of each layer, (layers, 2); equal where it has none."""
    bounds = pixels.starts[:: (len(pixels.starts) - 1) // pixels.layers]
    spans = np.zeros((pixels.layers, 2))
    for span, first, end in zip(spans, bounds[:-1], bounds[1:], strict=True):
        if end > first:
            span[:] = blur.near_px[first:end].min() - BESIDE_PX, blur.far_px[first:end].max() + BESIDE_PX
    return spans
