"""Maps of the truth twin: variance of the code, depth of the scene, radius of the lens's blur circle."""

import numpy as np

from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.distortion import Warp
from simulator.optics.lens.lens import Lens
from simulator.scene.compositing import visible_depth_m
from simulator.scene.scene import Scene, is_depth_map
from simulator.sensor.camera.readout_window import ReadoutGeometry
from simulator.sensor.code_variance import code_variance
from simulator.sensor.hdr_plan import HdrSensorPlan
from simulator.sensor.hdr_variance import combined_variance
from simulator.sensor.sensor_plan import SensorPlan


def variance_map(sensor: SensorPlan, mean_electrons: np.ndarray, *later_electrons: np.ndarray) -> np.ndarray:
    """Return the variance of each code over frames, (height, width) float32 [DN^2]: temporal noise and rounding.

    mean_electrons: (height, width) mean photoelectrons of the frame's pixels [e-]; later_electrons: those of the further
        exposures of an HDR read-out. `simulator.sensor.code_variance` lists the noises that it holds.
    """
    count = sensor.readout.summed
    if isinstance(sensor, HdrSensorPlan):
        return combined_variance(sensor, (mean_electrons, *later_electrons), count)
    return code_variance(sensor.moment_steps(), mean_electrons, count)


def depth_map(scene: Scene, projection: Projection, layout: ReadoutGeometry) -> np.ndarray:
    """Return the depth at each pixel's centre, along the optical axis, (height, width) float32 [m]; inf is allowed.

    Nearest scene pixel: a mean over a depth edge would be a distance at which there is no surface. Of several layers, see
    `visible_depth_m`.
    """
    depth_m, frame = visible_depth_m(scene), layout.computed
    shape = (layout.binned.height, layout.binned.width)
    if not is_depth_map(depth_m):
        return np.full(shape, depth_m, np.float32)[layout.kept]
    factor = 1 if layout.binning is None else layout.binning.factor
    if projection.warp is not None:
        return _warped_depth(depth_m, projection, projection.warp, layout, shape, factor)[layout.kept]
    indices = []
    for first, offset, pixels, scene_pixels in (
        (frame.y, projection.offset_y, shape[0], depth_m.shape[0]),
        (frame.x, projection.offset_x, shape[1], depth_m.shape[1]),
    ):
        centres = first + centres_px(pixels, factor, layout.filter_step)
        indices.append(np.clip(np.floor(offset + projection.scale * centres), 0, scene_pixels - 1).astype(np.intp))
    return depth_m[np.ix_(*indices)].astype(np.float32)[layout.kept]


def _warped_depth(
    depth_m: np.ndarray, projection: Projection, warp: Warp, layout: ReadoutGeometry, shape: tuple[int, int], factor: int
) -> np.ndarray:
    """Return the depth at each pixel's centre through a lens with distortion, (height, width) float32 [m]."""
    across, down = (centres_px(count, factor, layout.filter_step) for count in shape[::-1])
    channel = min(1, len(warp.magnification) - 1)  # the green one, as in kernels/projection.cl
    x_px, y_px = np.meshgrid(layout.computed.x + across, layout.computed.y + down)
    x, y = warp.undistorted(x_px, y_px, channel)
    column = np.clip(np.floor(projection.offset_x + projection.scale * x), 0, depth_m.shape[1] - 1).astype(np.intp)
    row = np.clip(np.floor(projection.offset_y + projection.scale * y), 0, depth_m.shape[0] - 1).astype(np.intp)
    return depth_m[row, column].astype(np.float32)


def blur_map(sensor: SensorPlan, lens: Lens, depth_m: np.ndarray) -> np.ndarray:
    """Return the radius of the circle of confusion at each pixel's depth, (height, width) float32 [pixels of the frame], >= 0.

    depth_m: (height, width) [m], as `depth_map` returns it. The radius is that of `ThinLens.blur_radius_um`.
    """
    binning = sensor.readout.binning
    pitch_um = sensor.camera.pixel_pitch_um * (1 if binning is None else binning.factor)
    if depth_m.min() == depth_m.max():
        return np.full(depth_m.shape, abs(float(lens.blur_radius_um(depth_m.flat[0]))) / pitch_um, np.float32)
    return np.abs(lens.blur_radius_um(depth_m) / pitch_um).astype(np.float32)


def centres_px(pixels: int, factor: int, filter_step: int) -> np.ndarray:
    """Return the centres of a frame's pixels [photosites from its edge]; of a binned pixel, the centre of its photosites.

    factor: binned photosites per side; 1: none. filter_step: period of the colour filter [photosites].
    """
    block, phase = np.divmod(np.arange(pixels), filter_step)
    return block * factor * filter_step + phase + 0.5 * filter_step * (factor - 1) + 0.5
