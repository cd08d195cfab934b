"""Executes a planned spread: light on the sensor in full colour, kernels over the field, each photosite its own colour.

Tiles lie along the whole sensor's grid and are computed whole, with real light around them, so that a crop has the bits of the
frame.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.defocused_mosaic import defocused_mosaic
from simulator.optics.passes.reference_mosaic import reference_mosaic
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.psf.tiled_convolution import Spectra, Tile, around, gathered, is_seen, source_of, tiles_of
from simulator.sensor.camera.camera import Window
from simulator.sensor.camera.cfa import Cfa

BLUR_SHARE = 0.7  # of the time, where the geometric blur comes first


@dataclass(frozen=True)
class Surface:
    """A layer of a scene on a tile and its margins, points of a photosite as phases (`Sampling.phases`).

    light: (channels, phases, rows, columns) float32, times coverage. coverage: (phases, rows, columns) float32; None: 1.
    radius_px: (phases, rows, columns) signed blur radius, or a float.
    """

    light: np.ndarray
    coverage: np.ndarray | None
    radius_px: np.ndarray | float


def spread_mosaic(
    optics: OpticsPlan, blur: TilePlan | None, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the lens.

    blur: methods of the geometric blur that comes first; None: none does.
    planes: for each layer a device buffer, as `defocused_mosaic` takes them.
    """
    frame, spread = optics.window, optics.spread
    block = optics.cfa.block(frame.x, frame.y)
    width, height = spread.sensor_px
    every = list(tiles_of(spread.x_px, spread.y_px, (height, width)))
    tiles = [tile for tile in every if is_seen(tile, frame)]
    spectra = Spectra(spread.kernel, spread.reach_px, every)
    surfaces, first = _projected, 0.0
    if optics.defocus is not None and not spread.by_distance:
        first = BLUR_SHARE
        surfaces = _Blurred(optics, blur, device, planes, lambda share: progress(BLUR_SHARE * share))
    result = np.empty((frame.height, frame.width), np.float32)
    for count, tile in enumerate(tiles):
        layers = surfaces(optics, device, planes, around(tile, spread.reach_px))
        for channel in optics.cfa.colors:
            light = _seen(optics, layers, tile, spectra, channel)
            _take(result, light, tile, frame, [(y, x) for y in (0, 1) for x in (0, 1) if block[y][x] == channel])
        progress(first + (1.0 - first) * (count + 1) / len(tiles))
    return device.upload(result)


def _take(result: np.ndarray, light: np.ndarray, tile: Tile, frame: Window, places: list[tuple[int, int]]) -> None:
    """Put a tile's light of one colour into the photosites that see it: places in the 2 x 2 block of the frame's corner."""
    top, left = max(tile.rows.start, frame.y), max(tile.columns.start, frame.x)
    bottom, right = min(tile.rows.stop, frame.y + frame.height), min(tile.columns.stop, frame.x + frame.width)
    for y, x in places:
        row, column = top + (y - (top - frame.y)) % 2, left + (x - (left - frame.x)) % 2
        into = result[row - frame.y : bottom - frame.y : 2, column - frame.x : right - frame.x : 2]
        own = light[row - tile.rows.start : bottom - tile.rows.start : 2, column - tile.columns.start :][
            :, : right - column : 2
        ]
        np.maximum(own, 0.0, out=into, casting="same_kind")


class _Blurred:
    """The frame behind the geometric blur, in full colour, with its margins."""

    def __init__(
        self,
        optics: OpticsPlan,
        blur: TilePlan | None,
        device: Device,
        planes: Sequence[Buffer],
        progress: Callable[[float], None],
    ):
        self.area = optics.blur_window()
        shape, self.light = (self.area.height, self.area.width), {}
        whole = replace(optics, window=self.area)
        for count, channel in enumerate(optics.cfa.colors):

            def told(share: float, count: int = count) -> None:
                progress((count + share) / len(optics.cfa.colors))

            if blur is None:
                buffer = reference_mosaic(whole.in_one_color(channel), device, list(planes), told)
            else:
                buffer = defocused_mosaic(blur, Cfa.uniform(channel), device, list(planes), told)
            self.light[channel] = device.download(buffer, shape, np.float32)

    def __call__(self, optics: OpticsPlan, device: Device, planes: Sequence, part: Window) -> list[Surface]:
        """Return one surface with the light of all."""
        top, left = part.y - self.area.y, part.x - self.area.x
        light = {
            channel: plane[None, top : top + part.height, left : left + part.width] for channel, plane in self.light.items()
        }
        return [Surface(light, None, 0.0)]


def _projected(optics: OpticsPlan, device: Device, planes: Sequence, part: Window) -> list[Surface]:
    """Layers of the scene on a part of the sensor and beyond, without blur."""
    over, channels = optics.spread.over, optics.channels
    radii = (0.0,) if optics.defocus is None else optics.defocus.radii_px
    layout = InterleavedColumns(over, part.height * over, -(-part.width // 2))
    covered = optics.defocus is not None and optics.has_coverage
    found, count, origin = [], channels + covered, (part.x, part.y)
    for buffer, radius in zip(planes, radii, strict=True):
        sampled = device.empty(layout.shape(count), np.float32)
        project_planes(device, optics.projection, buffer, count, sampled, 0, layout, origin)
        light = _phases(layout.decode(device.download(sampled, layout.shape(count), np.float32)), over, part)
        here = radius
        if np.ndim(radius):
            mapped, scene_radius = device.empty(layout.shape(1), np.float32), device.upload(radius)
            project_radius(device, optics.projection, scene_radius, mapped, 0, layout, origin)
            here = _phases(layout.decode(device.download(mapped, layout.shape(1), np.float32)), over, part)[0]
        found.append(Surface(light[:channels], light[channels] if covered else None, here))
    return found


def _phases(samples: np.ndarray, over: int, part: Window) -> np.ndarray:
    """Samples (planes, over * rows, over * columns) as phases (planes, over^2, rows, columns) of the part's photosites."""
    planes, rows, columns = samples.shape
    split = samples.reshape(planes, rows // over, over, columns // over, over).transpose(0, 2, 4, 1, 3)
    return np.ascontiguousarray(split.reshape(planes, over * over, rows // over, columns // over)[..., : part.width])


def _seen(optics: OpticsPlan, layers: list[Surface], tile: Tile, spectra: Spectra, channel: int) -> np.ndarray:
    """Light of a tile in one colour: layers over one another, front to back."""
    whole = len(layers) == 1 and layers[0].coverage is None
    if whole and np.ndim(layers[0].radius_px) == 0:
        slab = _slab_of(optics, layers[0].radius_px)
        return _light_seen(optics, layers[0].light[channel], 1.0, tile, spectra, (slab, channel))
    light, seen, through = 0.0, 0.0, 1.0
    for layer in layers:
        own_light, own_share = _layer_seen(optics, layer, tile, spectra, channel)
        light, seen = light + through * own_light, seen + through * own_share
        through = through * np.clip(1.0 - own_share, 0.0, 1.0)
    opaque = optics.defocus is not None and optics.defocus.opaque
    return light / seen if opaque else light


def _layer_seen(optics: OpticsPlan, layer: Surface, tile: Tile, spectra: Spectra, channel: int):
    """Light of a layer, and how much of the aperture it fills; neighbouring slabs are one surface, nearer ones hide.

    A slab is seen through what those before its neighbour leave open, and closes what it is seen of.
    """
    light, seen, before, open_ = 0.0, 0.0, 1.0, 1.0
    for slab, joined, share in _shares(optics, layer):
        if not joined:
            before = open_
        own_light = _light_seen(optics, layer.light[channel], share, tile, spectra, (slab, channel))
        covered = share if layer.coverage is None else layer.coverage * share
        own_share = gathered(source_of(covered, spectra), tile, spectra, slab, channel, False) / optics.spread.light
        light, seen = light + before * own_light, seen + before * own_share
        before, open_ = open_, np.maximum(open_ - before * own_share, 0.0)
    return light, seen


def _light_seen(
    optics: OpticsPlan, light: np.ndarray, share, tile: Tile, spectra: Spectra, name: tuple[int, int]
) -> np.ndarray:
    """Light of a slab on a tile; what is bright goes through a kernel that does not ring. name: slab and channel."""
    spread, rest = optics.spread, None
    if spread.rings(*name) and light.max() > spread.bright[name[1]]:
        limit = np.float32(spread.bright[name[1]])
        light, rest = np.minimum(light, limit), np.maximum(light - limit, np.float32(0.0))
    found = gathered(source_of(light * share, spectra), tile, spectra, *name, False)
    return found if rest is None else found + gathered(source_of(rest * share, spectra), tile, spectra, *name, True)


def _shares(optics: OpticsPlan, layer: Surface) -> Iterator[tuple[int, bool, np.ndarray]]:
    """Slabs in which a layer has light, nearest first: number, whether it may be one surface with the last, share of light."""
    spread = optics.spread
    if np.ndim(layer.radius_px) == 0:
        yield _slab_of(optics, layer.radius_px), False, np.ones(layer.light.shape[1:])
        return
    place, last = np.interp(layer.radius_px, spread.radii_px, np.arange(len(spread.radii_px))), None
    for slab in range(int(place.min()), int(np.ceil(place.max())) + 1):
        share = np.maximum(0.0, 1.0 - np.abs(place - slab))
        if share.any():
            yield slab, last == slab - 1 and spread.joined(slab), share
            last = slab


def _slab_of(optics: OpticsPlan, radius_px: float) -> int:
    """Slab of a layer at one distance; the only one where blur comes first."""
    return int(np.argmin(np.abs(np.asarray(optics.spread.radii_px) - radius_px)))
