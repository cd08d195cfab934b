"""From a shot to a raw frame: the passes of a plan on an OpenCL device, in the order of the light."""

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from simulator.device import Buffer, Device, DeviceInfo, open_device
from simulator.errors import PhotositeError
from simulator.optics.geometry.projection import project
from simulator.optics.lens.lens import Lens
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.defocused_mosaic import defocused_mosaic
from simulator.optics.passes.reference_mosaic import reference_mosaic
from simulator.optics.veiling_glare import add_veiling_glare
from simulator.pipeline.frame_metadata import assemble_raw
from simulator.pipeline.light_cache import Itself, LightCache
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.pipeline.truth_maps import blur_map, depth_map, variance_map
from simulator.progress import Progress, silent
from simulator.raw.raw_image import Raw
from simulator.sensor.readout import darken_optical_black, read_mean_electrons, read_noise_free, read_out, share_with_neighbors
from simulator.sensor.sensor_plan import SensorPlan


def simulate(
    shot: Shot,
    *,
    device: str | None = None,
    progress: Progress | None = None,
    stopwatch: Stopwatch | None = None,
    cache: LightCache | None = None,
) -> Raw:
    """Simulate the raw frame of a shot, with its truth.

    device: part of an OpenCL device's label; default: $PHOTOSITE_DEVICE, else a GPU before a CPU.
    progress: called with (current step, share done from 0 to 1). stopwatch: gets the time of each pass.
    cache: light of earlier shots, which is used again where it is the same; the frame has the same bits without.
    Raises PhotositeError for every fault that the user can correct.
    """
    report = progress or silent
    report("scene", 0.0)
    planned = plan(shot, cache)
    opened = open_device(device)
    check_memory(planned, opened.info)
    return execute(planned, shot, opened, report, stopwatch or Stopwatch(), cache)


def simulate_many(
    shots: Iterable[Shot], *, device: str | None = None, progress: Progress | None = None, memory_bytes: int | None = None
) -> Iterator[Raw]:
    """Simulate the raw frames of shots one after the other, as `simulate` does, each when it is asked for.

    Shots that differ only in ISO, seeds, gain, bit depth or noise share the light on the sensor and cost the sensor alone;
    those of a sharp scene share it over shutter times and apertures, too. The bits are those of each shot alone.
    progress: of each shot. memory_bytes: of the light that is held, as `LightCache` takes it.
    Raises PhotositeError as `simulate` does.
    """
    cache = LightCache(memory_bytes)
    for shot in shots:
        yield simulate(shot, device=device, progress=progress, cache=cache)


def execute(
    planned: Plan, shot: Shot, device: Device, report: Progress, timed: Stopwatch, cache: LightCache | None = None
) -> Raw:
    """Run the passes of a shot's plan on a device. report: as progress of `simulate`. timed: gets the time of each pass."""
    report("light", 0.1)
    if planned.key is None:
        planned = _measure(planned, device, timed)
    light = _light(planned, device, lambda share: report("light", 0.1 + 0.7 * share), timed, cache)
    report("sensor", 0.8)
    with timed("sensor", device):
        dn = read_out(device, planned.sensor, light, shot.seeds)
    report("truth", 0.9)
    late = LateTruth(device, planned.sensor, light, timed)
    electrons = late.mean_electrons() if "variance" in planned.truth else None
    maps = compute_truth_maps(planned, shot.lens, device, electrons, timed, cache)
    report("done", 1.0)
    mean_electrons = late.mean_electrons if electrons is None else electrons
    return assemble_raw(shot, planned, device.info, dn, mean_electrons, late.noise_free_dn, maps)


class LateTruth:
    """Truth of a frame that is computed when it is first asked for, from the light on the sensor, which is held until then.

    light: mosaic of electron radiance, as `expose` returns it; nothing changes it. timed: gets the time, as that of "truth".
    """

    def __init__(self, device: Device, sensor: SensorPlan, light: Buffer, timed: Stopwatch) -> None:
        self._device, self._sensor, self._light, self._timed = device, sensor, light, timed

    def mean_electrons(self) -> np.ndarray:
        """Return the mean electrons [e-] of the frame's pixels, (height, width) float32, a new array."""
        with self._timed("truth", self._device):
            return read_mean_electrons(self._device, self._sensor, self._light)

    def noise_free_dn(self) -> np.ndarray:
        """Return the codes without noise [DN] of the frame's pixels, (height, width) float32, a new array."""
        with self._timed("truth", self._device):
            return read_noise_free(self._device, self._sensor, self._light)


def check_memory(planned: Plan, device: DeviceInfo) -> None:
    """Raise PhotositeError for a frame that does not fit into the device's memory."""
    needed, there, frame = planned.memory_bytes(), device.memory_bytes, planned.optics.window
    if needed > there:
        raise PhotositeError(
            f"out of memory: {frame.width} x {frame.height} photosites need about {needed / 1e9:.1f} GB, "
            f"but {device.label} has {there / 1e9:.1f} GB; read out a part of the sensor with camera.window"
        )


def _measure(planned: Plan, device: Device, timed: Stopwatch) -> Plan:
    with timed("radius statistics", device):
        return measure(planned, device)


def _light(
    planned: Plan,
    device: Device,
    progress: Callable[[float], None],
    timed: Stopwatch,
    cache: LightCache | None,
) -> Buffer:
    """Return the mosaic of `expose`, from the cache where it is there. Nobody may change it."""
    if cache is None or planned.key is None:
        return expose(planned, device, progress, timed)
    key = Itself(device), planned.key.of_mosaic(planned.optics, planned.sensor)
    return cache.get(key, lambda: expose(_measure(planned, device, timed), device, progress, timed))


def expose(
    planned: Plan,
    device: Device,
    progress: Callable[[float], None] = lambda share: None,
    timed: Stopwatch | None = None,
) -> Buffer:
    """Return the light on the sensor: device buffer (height, width) float32, electron radiance in each photosite's colour.

    planned: with the methods of its tiles, as `measure` returns it. progress: called with the share of the blur that is done.
    """
    optics, layout, tiles, timed = planned.optics, planned.sensor.readout, planned.tiles, timed or Stopwatch()
    with timed("scene planes", device):
        planes = [camera_planes(device, layer, optics.weights, optics.has_coverage) for layer in optics.scene.layers]
    if optics.psf is not None:
        from simulator.optics.passes.psf_mosaic import psf_mosaic  # brings SciPy's transforms

        with timed("point spread function", device):
            mosaic = psf_mosaic(optics, tiles, device, planes, progress)
    elif tiles is not None:
        with timed("defocus", device):
            mosaic = defocused_mosaic(tiles, optics.cfa, device, planes, progress)
    elif optics.defocus is not None:
        with timed("defocus", device):
            mosaic = reference_mosaic(optics, device, planes, progress)
    else:
        with timed("projection", device):
            mosaic = project(device, optics.projection, optics.cfa, optics.window, planes[0])
    if (glare := optics.veiling_glare) is not None:
        with timed("veiling glare", device):
            add_veiling_glare(device, mosaic, glare, planned.sensor.irradiance, optics.cfa_macros(), optics.window)
    if any(shares := layout.crosstalk.optical_shares):
        with timed("crosstalk of light", device):
            mosaic = share_with_neighbors(device, mosaic, optics.window, shares)
    if layout.reaches_optical_black:
        with timed("optical black", device):
            darken_optical_black(device, mosaic, optics.window, layout.active)
    return mosaic


def noise_free_frame(device: Device, sensor: SensorPlan, light: Buffer) -> tuple[np.ndarray, np.ndarray]:
    """Return mean electrons [e-] and noise-free codes [DN] of the frame's pixels, (height, width) float32 each.

    light: mosaic of electron radiance, as `expose` returns it.
    """
    return read_mean_electrons(device, sensor, light), read_noise_free(device, sensor, light)


def compute_truth_maps(
    planned: Plan,
    lens: Lens,
    device: Device,
    mean_electrons: np.ndarray | None,
    timed: Stopwatch | None = None,
    cache: LightCache | None = None,
) -> dict[str, np.ndarray]:
    """Return the maps that the plan's truth asks for, by name; see `Raw.truth`.

    mean_electrons: of the frame's pixels [e-], for the map of the variance; None: it is not asked for.
    """
    optics, sensor, wanted, timed = planned.optics, planned.sensor, planned.truth, timed or Stopwatch()
    maps: dict[str, np.ndarray] = {}
    if mean_electrons is not None and "variance" in wanted:
        with timed("truth: variance", device):
            maps["variance"] = variance_map(sensor, mean_electrons)
    if "depth" in wanted:
        with timed("truth: depth", device):
            maps["depth"] = depth_map(optics.scene, optics.projection, sensor.readout)
    if "blur" in wanted:
        with timed("truth: blur", device):
            depth_m = maps["depth"] if "depth" in maps else depth_map(optics.scene, optics.projection, sensor.readout)
            maps["blur"] = blur_map(sensor, lens, depth_m)
    if "rgb" in wanted:
        with timed("truth: rgb", device):
            maps["rgb"] = clean_rgb(planned, device, cache)
    return maps


def clean_rgb(planned: Plan, device: Device, cache: LightCache | None = None) -> np.ndarray:
    """Return the noise-free signal in every colour at every pixel, (height, width, channels) float32, 0 at black, 1 at white.

    Camera colours, linear, not white-balanced: the result of a demosaicing without error. A channel is the noise-free code
    of a sensor that has this channel's filter on all photosites. In a pixel's own colour it is
    (noise-free code - black) / (white - black), unless crosstalk mixes colours.
    """
    sensor = planned.sensor
    black_dn, span_dn = np.float32(sensor.black_level_dn), np.float32(sensor.full_scale_dn())
    planes = []
    for channel in range(planned.optics.channels):
        light = _light(planned.in_one_color(channel), device, lambda share: None, Stopwatch(), cache)
        # Unnamed, so that the frame's memory is free before the next colour is computed.
        planes.append((read_noise_free(device, sensor, light) - black_dn) / span_dn)
    return np.stack(planes, axis=-1)
