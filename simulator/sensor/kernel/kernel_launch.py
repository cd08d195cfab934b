"""Launch the fused kernel for a stack of frames: one launch for all tiles of one kind, across frames."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from simulator.device import Buffer, Device
from simulator.errors import require
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.kernel import tiles
from simulator.sensor.kernel.kernel_program import CHARGE_STAGES, READOUT_STAGES, in_order, sensor_defines, stage_order
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.poisson_variants import PoissonVariant, choose_poisson_variants
from simulator.sensor.stages.registry import FUSED
from simulator.sensor.stages.stage import Means, Stage

LARGEST_PLACE_PX = 2**24  # x and y lie below it: float32 represents integers exactly up to there
TILE_PX = 512  # most columns of a tile on a CPU: means differ more in a wider one, and more tiles need the code for all means
FEW_PX = 2**16  # photosites below which one build for all means, without vectors, pays: it takes 0.5 s, a frame 2 ms at most
LAUNCH_PX = 2**15  # photosites for which the code for all means takes as much longer as a launch costs: 0.15 ms
VECTOR_PX = 32  # columns that a CPU computes at once: several registers, so that few instructions wait for the one before
REQUIRED = tuple(stem for stem in stage_order() if FUSED[stem].is_required)


class KernelPart(IntEnum):
    """Part of the fused kernel that a launch runs, as the macro PART of kernels/sensor.cl numbers them."""

    WHOLE = 0
    CHARGE = 1
    READOUT = 2

    @property
    def stems(self) -> tuple[str, ...]:
        """Stems of the stages that it runs."""
        return (stage_order(), CHARGE_STAGES, READOUT_STAGES)[self]


@dataclass(frozen=True)
class FrameSetting:
    """Stages, seeds and position of one frame of a stack.

    stages: of the fused kernel, in any order; kept in physical order, without those that have no effect.
    x, y: position on the sensor of the frame's upper left photosite, to which fixed patterns belong.
    Raises PhotositeError for stages without an ADC or gain, and for a position that is not a whole number in range.
    """

    stages: tuple[Stage, ...]
    seeds: Seeds = Seeds()
    x: int = 0
    y: int = 0

    def __post_init__(self) -> None:
        object.__setattr__(self, "stages", in_order(self.stages))
        for key, place in (("x", self.x), ("y", self.y)):
            good = 0 <= place < LARGEST_PLACE_PX and place == int(place)
            require(good, f"frame.{key}", place, f"give a whole number from 0 to {LARGEST_PLACE_PX - 1}")
        for stem in REQUIRED:
            require(self.stage(stem) is not None, f"frame.stages.{stem}", "missing", "a sensor gives codes only with it")

    def stage(self, stem: str) -> Stage | None:
        """Return the stage of this stem, or None."""
        return next((stage for stage in self.stages if stage.stem == stem), None)

    @property
    def counts_means(self) -> bool:
        """Whether a stage draws Poisson numbers with the code that POISSON_VARIANT chooses."""
        return any(stage.counts_means for stage in self.stages)


@dataclass(frozen=True)
class LaunchGroup:
    """Frames of a stack that run with the same build of the fused kernel.

    places: indices of the frames in the stack. numbers: (frames, NUMBERS) float32, their parameters. defines: the macros of
        the build.
    """

    places: np.ndarray
    numbers: np.ndarray
    defines: dict[str, object]


def form_launch_groups(settings: Sequence[FrameSetting], stems: Sequence[str], constant_bytes: int) -> Iterator[LaunchGroup]:
    """Yield the frames grouped by the macros that they need, so few at a time that constant memory holds their parameters.

    stems: of the stages that the kernel runs; others need no build of their own.
    """
    found: dict[tuple, tuple[dict, list[int], list[np.ndarray]]] = {}
    known = dict[tuple[int, ...], tuple[dict[str, object], np.ndarray]]()  # of the same stages, which frames of a stack share
    for place, setting in enumerate(settings):
        same = tuple(map(id, setting.stages))
        if same not in known:
            known[same] = sensor_defines(tuple(stage for stage in setting.stages if stage.stem in stems))
        defines, numbers = known[same]
        _, places, rows = found.setdefault(tuple(defines.items()), (defines, [], []))
        places.append(place)
        rows.append(numbers)
    for defines, places, rows in found.values():
        most = max(1, constant_bytes // max(rows[0].nbytes, 1))
        for first in range(0, len(places), most):
            part = slice(first, first + most)
            yield LaunchGroup(np.array(places[part]), np.array(rows[part]), defines)


def launch_sensor(
    device: Device,
    source: Buffer,
    result: Buffer,
    shape: tuple[int, int],
    settings: Sequence[FrameSetting],
    part: KernelPart,
    tile_height: int = tiles.TILE_HEIGHT,
    few_px: int = FEW_PX,
) -> None:
    """Enqueue the fused kernel for a stack of frames, each tile of a large one with the fastest Poisson code for its means.

    The variant of a tile and the other frames of the stack change the speed, never the codes.
    source, result: device buffers (frames, *shape), as kernels/sensor.cl says for this part. shape: (height, width).
    tile_height: rows of the largest tile, 2 or more. few_px: photosites of all frames below which few and small builds count.
    """
    height, width = shape
    is_small = len(settings) * height * width < few_px
    work_items = 1 if device.span > 1 else device.row_px
    vector = VECTOR_PX if device.span > 1 and width >= VECTOR_PX and not is_small else 1
    columns = tiles.column_edges(width, min(device.row_px, TILE_PX), vector)
    rows, pairs = tiles.stack_edges([setting.y for setting in settings], height, tile_height)
    frame_of_row = rows[:-1] // height
    means = np.full((len(pairs), len(columns) - 1), PoissonVariant.LARGE)
    counts = np.array([part is not KernelPart.READOUT and setting.counts_means for setting in settings])
    if counts.any() and is_small:
        means = np.where(counts[frame_of_row, np.newaxis], PoissonVariant.ALL, means)
    elif counts.any():
        found = _poisson_variants(device, source, shape, settings, columns, rows, tile_height)
        means = np.where(counts[frame_of_row, np.newaxis], found, means)
    sizes = np.outer(np.diff(rows), np.diff(columns))
    for group in form_launch_groups(settings, part.stems, device.constant_bytes):
        numbers = device.upload(group.numbers)
        seeds = device.upload(_seeds([settings[place] for place in group.places]))
        inside = np.isin(frame_of_row, group.places)[:, np.newaxis]
        variants = np.where(inside, join_rare_variants(means, sizes * inside), means)
        for variant in np.unique(variants[inside[:, 0]]):
            macros = {**group.defines, "POISSON_VARIANT": int(variant), "PART": int(part)}
            macros |= {"AT_ONCE": vector, "WORK_ITEMS": work_items}
            found = tiles.join_pairs(columns, rows, (variants == variant) & inside)
            tiles_of = _tiles(found, pairs, rows, height, settings, group.places)
            widest, highest = found[:, 2:].max(axis=0).tolist()
            device.run(
                device.kernel("sensor", macros),
                (min(work_items, widest), -(-highest // 2), len(found)),
                (min(work_items, widest), 1, 1),
                input=source,
                output=result,
                spare=result if (tiles_of[:, -1] == tiles.BOTH_ROWS).all() else device.empty((len(found), widest), np.float32),
                tiles=device.upload(tiles_of),
                seeds=seeds,
                numbers=numbers,
                width=width,
                widest=widest,
            )


def join_rare_variants(variants: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return the PoissonVariant of each tile, ALL for the tiles of rare variants, where the launches that this saves cost more.

    variants: PoissonVariant of each tile. sizes: photosites of each tile, same shape; 0 where it is not of this launch.
    """
    photosites = np.bincount(variants.ravel(), sizes.ravel(), len(PoissonVariant))
    is_all = np.arange(len(PoissonVariant)) == PoissonVariant.ALL
    rarest = [variant for variant in np.argsort(photosites, kind="stable") if photosites[variant] and not is_all[variant]]
    saved = np.arange(len(rarest)) + (photosites[PoissonVariant.ALL] > 0)  # launches, where the rarest up to each are joined
    worth = np.flatnonzero(np.cumsum(photosites[rarest]) <= LAUNCH_PX * saved)
    joined = rarest[: worth[-1] + 1] if len(worth) else []
    return np.where(np.isin(variants, joined), PoissonVariant.ALL, variants)


def _seeds(settings: Sequence[FrameSetting]) -> np.ndarray:
    """Return the argument `seeds` of kernels/sensor.cl, (frames, 2) uint32."""
    return np.array([(setting.seeds.frame, setting.seeds.body) for setting in settings], np.uint32)


def _tiles(
    found: np.ndarray, pairs: np.ndarray, rows: np.ndarray, height: int, settings: Sequence[FrameSetting], places: np.ndarray
) -> np.ndarray:
    """Return the argument `tiles` of kernels/sensor.cl, (tiles, 8) uint32.

    found: tiles of `tiles.join_pairs`. pairs, rows: of `tiles.stack_edges`. height: of a frame. places: in the stack, of the
        frames of this launch.
    """
    windows = np.array([(setting.x, setting.y) for setting in settings], np.int64)
    column, row, columns, high = found.T
    place, mask = row // height, pairs[np.searchsorted(rows, row)]
    x, y = column + windows[place, 0], row - place * height + windows[place, 1]
    return np.stack([column, row, x, y, np.searchsorted(places, place), columns, high, mask], axis=-1).astype(np.uint32)


def _poisson_variants(
    device: Device,
    source: Buffer,
    shape: tuple[int, int],
    settings: Sequence[FrameSetting],
    columns: np.ndarray,
    rows: np.ndarray,
    tile_height: int,
) -> np.ndarray:
    """Return the PoissonVariant of each tile of the stack, (tile rows, tile columns)."""
    least, greatest = tile_extremes(device, source, shape[1], rows, tile_height)
    least_e = np.minimum.reduceat(least, columns[:-1], axis=1).astype(np.float64)
    greatest_e = np.maximum.reduceat(greatest, columns[:-1], axis=1).astype(np.float64)
    first = np.searchsorted(rows[:-1] // shape[0], np.arange(len(settings) + 1))  # first tile row of each frame
    for setting, part in zip(settings, map(slice, first[:-1], first[1:]), strict=True):
        window = Window(setting.x, setting.y, shape[1], shape[0])
        least_e[part], greatest_e[part] = mean_range(setting.stages, least_e[part], greatest_e[part], window)
    return choose_poisson_variants(0.9999 * least_e, 1.0001 * greatest_e)  # a margin for rounding in float32


def tile_extremes(
    device: Device, image: Buffer, width: int, rows: np.ndarray, tile_height: int = tiles.TILE_HEIGHT
) -> np.ndarray:
    """Return least and greatest value in each column of each tile row: (2, tile rows, width) float32.

    image: device buffer (rows, width) float32. rows: borders of the tile rows, at most `tile_height` apart.
    """
    shape = (2, len(rows) - 1, width)
    extremes, edges = device.empty(shape, np.float32), device.upload(rows.astype(np.uint32))
    segment, work_items = (TILE_PX, 1) if device.span > 1 else (device.row_px, device.row_px)
    kernel = device.kernel("tile_range", {"TILE_HEIGHT": tile_height, "SEGMENT": segment, "WORK_ITEMS": work_items})
    size = (-(-width // segment) * work_items, shape[1])
    device.run(kernel, size, (work_items, 1), image=image, range=extremes, edges=edges, width=width)
    return device.download(extremes, shape, np.float32)


def mean_range(stages: Sequence[Stage], low: Means, high: Means, window: Window) -> tuple[Means, Means]:
    """Return the least and the greatest mean of the Poisson numbers that are drawn in a window of the sensor.

    stages: in physical order; those before the Poisson stage are applied. low, high: range of the kernel's input.
    """
    for stage in stages:
        if stage.counts_means:
            break
        low, high = stage.mean_range(low, high, window)
    return low, high
