"""From a shot to a raw frame: the passes of a plan on an OpenCL device, in the order of the light."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext

import numpy as np

from simulator.device import Buffer, Device, DeviceInfo, open_device
from simulator.errors import PhotositeError
from simulator.optics.geometry.projection import project
from simulator.optics.geometry.scene_part import ScenePart, find_scene_part
from simulator.optics.lens.lens import Lens
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.veiling_glare import add_veiling_glare
from simulator.pipeline.frame_metadata import assemble_raw
from simulator.pipeline.frame_strips import Allocate, FrameArrays, MemoryStore, on_disk
from simulator.pipeline.planner import STRIP_PX, Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.pipeline.truth_maps import blur_map, depth_map, variance_map
from simulator.progress import Progress, silent
from simulator.raw.raw_image import Raw
from simulator.raw.save import files_of
from simulator.sensor.kernel.kernel_launch import FrameSetting
from simulator.sensor.kernel.noise_free import mean_charge, noise_free
from simulator.sensor.readout import darken_optical_black, download_averaged, read_out, share_charge, share_with_neighbors
from simulator.sensor.sensor_plan import SensorPlan


def simulate(
    shot: Shot,
    *,
    device: str | None = None,
    progress: Progress | None = None,
    stopwatch: Stopwatch | None = None,
    strip_px: int = STRIP_PX,
) -> Raw:
    """Simulate the raw frame of a shot, with its truth.

    device: part of an OpenCL device's label; default: $PHOTOSITE_DEVICE, else a GPU before a CPU.
    progress: called with (current step, share done from 0 to 1). stopwatch: gets the time of each pass.
    strip_px: photosites that are computed at once; a larger frame is computed in strips, with the same bits.
    Raises PhotositeError for every fault that the user can correct.
    """
    report = progress or silent
    planned, opened = _prepare(shot, device, report, strip_px)
    return execute(planned, shot, opened, report, stopwatch or Stopwatch())


@contextmanager
def simulate_on_disk(
    shot: Shot,
    directory: str | os.PathLike[str],
    *,
    device: str | None = None,
    progress: Progress | None = None,
    strip_px: int = STRIP_PX,
) -> Iterator[Raw]:
    """Simulate as `simulate` does, for files in a directory; arrays of a frame of several strips lie in files there.

    They are removed in the end. Raises PhotositeError as `simulate` does, and when the disk has no room.
    """
    report = progress or silent
    planned, opened = _prepare(shot, device, report, strip_px)
    is_large = len(planned.strips) > 1
    with on_disk(files_of(shot.name, directory).dng) if is_large else nullcontext(MemoryStore) as allocate:
        yield execute(planned, shot, opened, report, Stopwatch(), allocate)


def _prepare(shot: Shot, device: str | None, report: Progress, strip_px: int) -> tuple[Plan, Device]:
    """Return the plan of a shot and the device that it fits on. Raises PhotositeError."""
    report("scene", 0.0)
    planned, opened = plan(shot, strip_px), open_device(device)
    check_memory(planned, opened.info)
    return planned, opened


def execute(
    planned: Plan, shot: Shot, device: Device, report: Progress, timed: Stopwatch, allocate: Allocate = MemoryStore
) -> Raw:
    """Run the passes of a shot's plan on a device.

    report: as progress of `simulate`. timed: gets the time of each pass.
    allocate: makes the arrays of a frame of several strips.
    """
    parts = planned.by_strip()
    if len(parts) == 1:
        arrays = _execute_strip(planned, shot, device, report, timed)
    else:
        arrays = _execute_strips(parts, shot, device, report, timed, allocate)
    report("done", 1.0)
    return assemble_raw(shot, planned, device.info, arrays)


def _execute_strips(
    parts: list[Plan], shot: Shot, device: Device, report: Progress, timed: Stopwatch, allocate: Allocate
) -> dict[str, np.ndarray]:
    """Run the passes of all strips, one after the other; returns the arrays of the whole frame, named as those of a strip."""
    frame = FrameArrays(sum(part.sensor.readout.rows for part in parts), allocate)
    for count, part in enumerate(parts):

        def report_strip(what: str, share: float, count: int = count) -> None:
            report(what, (count + share) / len(parts))

        strip = _execute_strip(part, shot, device, report_strip, timed)
        with timed("strips", device):
            frame.append(strip)
        del strip  # its memory is for the next one
    return frame.arrays()


def _execute_strip(planned: Plan, shot: Shot, device: Device, report: Progress, timed: Stopwatch) -> dict[str, np.ndarray]:
    """Run the passes of a strip; returns its arrays: codes "dn", "mean_electrons", "noise_free_dn", and maps of the truth."""
    report("light", 0.1)
    with timed("radius statistics", device):
        planned = measure(planned, device)
    light = expose(planned, device, lambda share: report("light", 0.1 + 0.7 * share), timed)
    report("sensor", 0.8)
    with timed("sensor", device):
        dn = read_out(device, planned.sensor, light, shot.seeds)
    report("truth", 0.9)
    with timed("truth", device):
        mean_electrons, noise_free_dn = noise_free_frame(device, planned.sensor, light)
    maps = compute_truth_maps(planned, shot.lens, device, mean_electrons, timed)
    return {"dn": dn, "mean_electrons": mean_electrons, "noise_free_dn": noise_free_dn, **maps}


def check_memory(planned: Plan, device: DeviceInfo) -> None:
    """Raise PhotositeError for a frame that does not fit into the device's memory."""
    needed, there, frame = planned.memory_bytes(), device.memory_bytes, planned.optics.window
    if needed > there:
        raise PhotositeError(
            f"out of memory: {frame.width} x {frame.height} photosites need about {needed / 1e9:.1f} GB, "
            f"but {device.label} has {there / 1e9:.1f} GB; read out a part of the sensor with camera.window"
        )


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
        part = _scene_part(planned)
        planes = [camera_planes(device, layer, optics.weights, optics.has_coverage, part) for layer in optics.scene.layers]
    if optics.psf is not None:
        from simulator.optics.passes.psf_mosaic import psf_mosaic  # brings SciPy's transforms

        with timed("point spread function", device):
            mosaic = psf_mosaic(optics, tiles, device, planes, progress)
    elif tiles is not None:
        from simulator.optics.passes.defocused_mosaic import defocused_mosaic

        with timed("defocus", device):
            mosaic = defocused_mosaic(tiles, optics.cfa, device, planes, progress)
    elif optics.defocus is not None:
        from simulator.optics.passes.reference_mosaic import reference_mosaic

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


def _scene_part(planned: Plan) -> ScenePart | None:
    """Part of the scene that the frame sees; None: all of it, since a point spread function or rays reach far."""
    optics, tiles = planned.optics, planned.tiles
    if optics.psf is not None or (tiles is None and optics.defocus is not None):
        return None
    return find_scene_part([(optics.projection, optics.window)] if tiles is None else tiles.areas())


def noise_free_frame(device: Device, sensor: SensorPlan, light: Buffer) -> tuple[np.ndarray, np.ndarray]:
    """Return mean electrons [e-] and noise-free codes [DN] of the frame's pixels, (height, width) float32 each.

    light: mosaic of electron radiance, as `expose` returns it.
    """
    frame, read = sensor.readout.computed, sensor.readout.read
    settings = [FrameSetting(sensor.stages, x=frame.x, y=frame.y)]
    buffers = mean_charge(device, light, (frame.height, frame.width), settings)
    mean_electrons, signal = (share_charge(device, sensor.readout, buffer) for buffer in buffers)
    noise_free(device, signal, (read.height, read.width), settings)
    electrons, codes = (download_averaged(device, sensor.readout, buffer) for buffer in (mean_electrons, signal))
    return electrons[sensor.readout.kept], codes[sensor.readout.kept]


def compute_truth_maps(
    planned: Plan, lens: Lens, device: Device, mean_electrons: np.ndarray, timed: Stopwatch | None = None
) -> dict[str, np.ndarray]:
    """Return the maps that the plan's truth asks for, by name; see `Raw.truth`."""
    optics, sensor, wanted, timed = planned.optics, planned.sensor, planned.truth, timed or Stopwatch()
    maps: dict[str, np.ndarray] = {}
    if "variance" in wanted:
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
            maps["rgb"] = clean_rgb(planned, device)
    return maps


def clean_rgb(planned: Plan, device: Device) -> np.ndarray:
    """Return the noise-free signal in every colour at every pixel, (height, width, channels) float32, 0 at black, 1 at white.

    Camera colours, linear, not white-balanced: the result of a demosaicing without error. A channel is the noise-free code
    of a sensor that has this channel's filter on all photosites. In a pixel's own colour it is
    (noise-free code - black) / (white - black), unless crosstalk mixes colours.
    """
    sensor = planned.sensor
    black_dn, span_dn = np.float32(sensor.black_level_dn), np.float32(sensor.full_scale_dn())
    planes = []
    for channel in range(planned.optics.channels):
        light = expose(planned.in_one_color(channel), device)
        # Unnamed, so that the frame's memory is free before the next colour is computed.
        planes.append((noise_free_frame(device, sensor, light)[1] - black_dn) / span_dn)
    return np.stack(planes, axis=-1)
