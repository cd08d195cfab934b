"""Maps that belong to the truth of a frame: variance of the code, distance of the scene, blur circle of the lens."""

import math

import numpy as np

from simulator.lens import ThinLens
from simulator.planner import Plan
from simulator.stage import Moments

_NODES = 2**14  # of the variance over the electrons; between them it is read linearly
_REACH = 8.0  # standard deviations beyond which a clipped code has no variance left


def variance_map(planned: Plan, mean_electrons: np.ndarray) -> np.ndarray:
    """Variance of each code from frame to frame (height, width) float32 [DN^2], temporal noise and rounding.

    mean_electrons: (height, width) mean photoelectrons of the pixels that are given out [e-], as in the twin.
    It is what the stages' moments give (EMVA 1288 R4.0, eq. 9, and the stages' own terms), for a photosite without the
    body's fixed pattern, narrowed by full well and ADC: variance of a normal number held between two limits.
    The stages are evaluated at 16384 electron counts and read linearly between them, which is exact for shot noise.
    """
    count = planned.layout.binning.count if planned.layout.adds_charge else 1
    top_e = min(float(mean_electrons.max()), count * _clipping_electrons(planned))
    if top_e <= 0.0:
        return np.full(mean_electrons.shape, _variance(planned, np.zeros(1))[0], np.float32)
    nodes = _variance(planned, np.linspace(0.0, top_e / count, _NODES)).astype(np.float32)
    steps = np.append(np.diff(nodes), np.float32(0.0))
    result = np.empty(mean_electrons.shape, np.float32)
    for electrons, variance in zip(mean_electrons, result, strict=True):  # row by row: stays in the cache
        place = np.minimum(electrons * np.float32((_NODES - 1) / top_e), np.float32(_NODES - 1))
        index = place.astype(np.int32)
        variance[:] = nodes[index] + (place - index) * steps[index]
    return result


def depth_map(planned: Plan) -> np.ndarray:
    """Distance of what each pixel's centre sees, along the optical axis (height, width) float32 [m]; inf is allowed.

    Nearest scene pixel: a mean over an edge would be a distance at which nothing stands.
    """
    depth_m, layout, projection = planned.scene.depth_m, planned.layout, planned.projection
    shape = (layout.binned.height, layout.binned.width)
    if np.ndim(depth_m) == 0:
        return np.full(shape, depth_m, np.float32)[layout.kept]
    factor = 1 if layout.binning is None else layout.binning.factor
    if projection.warp is not None:
        return _warped_depth(planned, shape, factor)[layout.kept]
    indices = []
    for first, offset, pixels, scene_pixels in (
        (planned.frame.y, projection.offset_y, shape[0], depth_m.shape[0]),
        (planned.frame.x, projection.offset_x, shape[1], depth_m.shape[1]),
    ):
        centres = first + _centres_px(pixels, factor, layout.filter_step)
        indices.append(np.clip(np.floor(offset + projection.scale * centres), 0, scene_pixels - 1).astype(np.intp))
    return depth_m[np.ix_(*indices)].astype(np.float32)[layout.kept]


def _warped_depth(planned: Plan, shape: tuple[int, int], factor: int) -> np.ndarray:
    """Depth of what each pixel's centre sees through a lens that distorts, (height, width) float32 [m]."""
    depth_m, projection = planned.scene.depth_m, planned.projection
    across, down = (_centres_px(count, factor, planned.layout.filter_step) for count in shape[::-1])
    channel = min(1, planned.camera.channels - 1)  # the green one, as in kernels/projection.cl
    x, y = projection.warp.undistorted(*np.meshgrid(planned.frame.x + across, planned.frame.y + down), channel)
    column = np.clip(np.floor(projection.offset_x + projection.scale * x), 0, depth_m.shape[1] - 1).astype(np.intp)
    row = np.clip(np.floor(projection.offset_y + projection.scale * y), 0, depth_m.shape[0] - 1).astype(np.intp)
    return depth_m[row, column].astype(np.float32)


def blur_map(planned: Plan, lens: ThinLens, depth_m: np.ndarray) -> np.ndarray:
    """Radius of the blur circle of each pixel's depth (height, width) float32 [pixels of the frame], >= 0.

    The thin lens's own radius (`ThinLens.blur_radius_um`). The frame is made with radii in steps (docs/architecture.md).
    depth_m: (height, width) distance [m], as `depth_map` gives it.
    """
    pitch_um = planned.camera.pixel_pitch_um * (1 if planned.layout.binning is None else planned.layout.binning.factor)
    if depth_m.min() == depth_m.max():
        return np.full(depth_m.shape, abs(lens.blur_radius_um(depth_m.flat[0])) / pitch_um, np.float32)
    return np.abs(lens.blur_radius_um(depth_m) / pitch_um).astype(np.float32)


def _centres_px(pixels: int, factor: int, filter_step: int) -> np.ndarray:
    """Centres of the pixels of a frame in photosites from its edge; a binned pixel's is that of the sites it adds up."""
    block, phase = np.divmod(np.arange(pixels), filter_step)
    return block * factor * filter_step + phase + 0.5 * filter_step * (factor - 1) + 0.5


def _clipping_electrons(planned: Plan) -> float:
    """Photoelectrons per photosite above which every code is the white level."""
    dark, one = planned.moments(0.0), planned.moments(1.0)
    gain = max(one.mean - dark.mean, 1e-12)
    full_e = 2.0 * (planned.stage("adc").max_code + 1) / gain  # twice: errors of linearity bend the line
    sigma_e = math.sqrt(max(dark.variance, 0.0)) / gain + math.sqrt(full_e)
    return full_e + _REACH * sigma_e


def _variance(planned: Plan, electrons: np.ndarray) -> np.ndarray:
    """Variance of the code [DN^2] for mean photoelectrons per photosite (n,) float64."""
    well, adc = planned.stage("full_well"), planned.stage("adc")
    signal = Moments(electrons, np.zeros_like(electrons), np.zeros_like(electrons))
    for name, step in planned.moment_steps():
        if name == "full_well":
            signal = _held(signal, -math.inf, well.capacity_e)
            continue
        signal = step(signal)
        if name in ("adc", "digital_gain"):
            signal = _held(signal, 0.0, float(adc.max_code))
    return signal.variance


def _held(signal: Moments, low: float, high: float) -> Moments:
    """Moments of a normal number that is held between limits (censored; Greene, Econometric Analysis, theorem 19.3)."""
    from scipy.special import ndtr

    sigma = np.sqrt(np.maximum(signal.variance, 1e-30))
    a, b = (np.clip((limit - signal.mean) / sigma, -40.0, 40.0) for limit in (low, high))
    below, above = ndtr(a), ndtr(-b)
    between = np.maximum(1.0 - below - above, 0.0)
    density_a, density_b = (np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi) for z in (a, b))
    first = a * below + density_a - density_b + b * above  # E[z], z = (x - mean) / sigma
    second = a**2 * below + between + a * density_a - b * density_b + b**2 * above  # E[z^2]
    return Moments(signal.mean + sigma * first, signal.variance * np.maximum(second - first**2, 0.0), signal.fixed_variance)
