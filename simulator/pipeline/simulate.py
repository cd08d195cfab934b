"""From a shot to a raw frame: plans it, asks whether the device can hold it, and executes it."""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, nullcontext

from simulator.device import Device, DeviceInfo, open_device
from simulator.errors import PhotositeError
from simulator.pipeline.execution import execute
from simulator.pipeline.frame_strips import MemoryStore, on_disk
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import STRIP_PX, Plan, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.stopwatch import Stopwatch
from simulator.progress import Progress, silent
from simulator.raw.dng.writer import check_size
from simulator.raw.raw_image import Raw
from simulator.raw.save import files_of

FRAME_BYTES = 10  # of a photosite's code and truth


def simulate(
    shot: Shot,
    *,
    device: str | None = None,
    progress: Progress | None = None,
    stopwatch: Stopwatch | None = None,
    strip_px: int = STRIP_PX,
    cache: LightCache | None = None,
) -> Raw:
    """Simulate the raw frame of a shot, with its truth.

    device: part of an OpenCL device's label; default: $PHOTOSITE_DEVICE, else a GPU before a CPU.
    progress: called with (current step, share done from 0 to 1). stopwatch: gets the time of each pass.
    strip_px: photosites that are computed at once; a larger frame is computed in strips, with the same bits.
    cache: light of earlier shots, which is used again where it is the same; the frame has the same bits without.
    Raises PhotositeError for every fault that the user can correct.
    """
    report = progress or silent
    planned, opened = _prepare(shot, device, report, strip_px, cache)
    if len(planned.strips) > 1:
        check_memory(planned, opened.info, FRAME_BYTES)
    return execute(planned, shot, opened, report, stopwatch or Stopwatch(), cache=cache)


def simulate_many(
    shots: Iterable[Shot], *, device: str | None = None, progress: Progress | None = None, memory_bytes: int | None = None
) -> Iterator[Raw]:
    """Simulate the raw frames of shots one after the other, as `simulate` does, each when it is asked for.

    Shots that differ only in ISO, seeds, gain, bit depth or noise share the light on the sensor and cost the sensor alone;
    those of a sharp scene share it over shutter times and apertures, too. The bits are those of each shot alone. Frames of
    several strips share scene and plan, but not their light.
    progress: of each shot. memory_bytes: of the light that is held, as `LightCache` takes it.
    Raises PhotositeError as `simulate` does.
    """
    cache = LightCache(memory_bytes)
    for shot in shots:
        yield simulate(shot, device=device, progress=progress, cache=cache)


@contextmanager
def simulate_on_disk(
    shot: Shot,
    directory: str | os.PathLike[str],
    *,
    device: str | None = None,
    progress: Progress | None = None,
    strip_px: int = STRIP_PX,
    cache: LightCache | None = None,
) -> Iterator[Raw]:
    """Simulate as `simulate` does, for files in a directory; arrays of a frame of several strips lie in files there.

    They are removed in the end. Raises PhotositeError as `simulate` does, and when the disk has no room.
    """
    report = progress or silent
    planned, opened = _prepare(shot, device, report, strip_px, cache)
    output = planned.sensor.readout.output
    is_large = len(planned.strips) > 1
    if is_large:
        check_size(planned.sensor.readout.rows, output.width, shot.name)
    with on_disk(files_of(shot.name, directory).dng) if is_large else nullcontext(MemoryStore) as allocate:
        yield execute(planned, shot, opened, report, Stopwatch(), allocate, cache)


def _prepare(shot: Shot, device: str | None, report: Progress, strip_px: int, cache: LightCache | None) -> tuple[Plan, Device]:
    """Return the plan of a shot and the device that it fits on. Raises PhotositeError."""
    report("scene", 0.0)
    if shot.time_budget_s is None:
        planned, opened = plan(shot, strip_px, cache), open_device(device)
    else:
        from simulator.pipeline.time_budget import plan_in_time  # only a time budget needs the rates of a device

        opened = open_device(device)
        planned = plan_in_time(shot, opened, strip_px, cache, report)
    check_memory(planned, opened.info)
    return planned, opened


def check_memory(planned: Plan, device: DeviceInfo, kept_bytes: int = 0) -> None:
    """Raise PhotositeError for a frame that does not fit into the device's memory.

    kept_bytes: of each photosite that are kept in memory when its strip is done.
    """
    there, frame = device.memory_bytes, planned.optics.window
    needed = planned.memory_bytes() + kept_bytes * frame.width * frame.height
    if needed > there:
        raise PhotositeError(
            f"out of memory: {frame.width} x {frame.height} photosites need about {needed / 1e9:.1f} GB, "
            f"but {device.label} has {there / 1e9:.1f} GB; read out a part of the sensor with camera.window"
        )
