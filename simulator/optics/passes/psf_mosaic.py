"""Executes a planned point spread function: convolves the light on the sensor in full colour, then samples the colour filter.

Tiles are aligned to the grid of the whole sensor and computed whole, with the light around them as margin, so that a crop has
the bits of the frame.
"""

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import project_planes, project_radius
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.defocused_mosaic import add_covariance, defocused_mosaics
from simulator.optics.passes.lamp_pass import add_lamps, take_lamps
from simulator.optics.passes.layer_rays import add_layer_rays
from simulator.optics.passes.psf_gather import gather_corrections, gather_psf
from simulator.optics.passes.psf_slabs import gather_slabs
from simulator.optics.passes.reference_mosaic import reference_mosaic
from simulator.optics.passes.tile_plan import TilePlan
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.tiled_convolution import (
    KernelSpectra,
    Tile,
    convolve_tile,
    is_in_window,
    pad_tile,
    split_into_tiles,
    transform_light,
)
from simulator.sensor.camera.camera import Window
from simulator.sensor.camera.cfa import Cfa

BLUR_SHARE = 0.7  # of the progress, where the geometric blur comes first
RAYS_SHARE = 0.9  # of the progress, of rays for layers that hide each other


@dataclass(frozen=True)
class Surface:
    """A layer of a scene on a tile and its margins, light samples of a photosite as phases (`Sampling.phases`).

    light: by channel, (phases, rows, columns) float32, premultiplied by coverage.
    coverage: (phases, rows, columns) float32; None: 1.
    radius_px: (phases, rows, columns) signed blur radius, or a float.
    """

    light: Mapping[int, np.ndarray]
    coverage: np.ndarray | None
    radius_px: np.ndarray | float


def psf_mosaic(
    optics: OpticsPlan, blur: TilePlan | None, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """Device buffer (height, width) float32: the mosaic of electron radiance behind the lens.

    blur: methods of the geometric blur that comes first; None: of the reference, by rays, or no blur. Of kernels by distance:
    blocks to which the covariance of layers is added; None: there are none.
    planes: a device buffer for each layer, as for `defocused_mosaics`.
    """
    if not _psf_of(optics).by_distance:
        return _spread_mosaic(optics, blur, device, planes, progress)
    if optics.lamps is not None:
        take_lamps(optics, device, planes[0])
        return add_lamps(optics, device, _spread_mosaic(optics, None, device, planes, progress))
    if optics.layer_rays:
        light = _spread_mosaic(optics, None, device, planes, lambda share: progress((1.0 - RAYS_SHARE) * share))
        return add_layer_rays(optics, device, planes, light, lambda share: progress(1.0 - RAYS_SHARE * (1.0 - share)))
    light = _spread_mosaic(optics, None, device, planes, progress)
    if blur is not None:
        add_covariance(blur, optics.cfa, device, list(planes), light)
    return light


def _spread_mosaic(
    optics: OpticsPlan, blur: TilePlan | None, device: Device, planes: Sequence[Buffer], progress: Callable[[float], None]
) -> Buffer:
    """`psf_mosaic` of which layers are composited by their means. blur: of the geometric blur that comes first, or None."""
    frame, psf = optics.window, _psf_of(optics)
    if psf.is_gathered_by_distance:
        return gather_slabs(optics, device, planes, progress)
    if psf.core is not None:
        return gather_psf(optics, blur, device, planes, progress)
    block = optics.cfa.block(frame.x, frame.y)
    width, height = psf.sensor_px
    every = list(split_into_tiles(psf.x_px, psf.y_px, (height, width)))
    tiles = [tile for tile in every if is_in_window(tile, frame)]
    spectra = KernelSpectra(psf.kernel, psf.reach_px, every)
    surfaces: Callable[[Window], list[Surface]] = partial(_project_layers, optics, device, planes)
    first = 0.0
    if optics.defocus is not None and not psf.by_distance:
        first = BLUR_SHARE
        surfaces = _BlurredFrame(optics, blur, device, planes, lambda share: progress(BLUR_SHARE * share)).crop
    corrections = None if blur is None else gather_corrections(optics, blur, device, planes)
    result = np.zeros((frame.height, frame.width), np.float32)
    if corrections is not None:
        result = device.download(corrections, result.shape, np.float32)
    for count, tile in enumerate(tiles):
        layers = surfaces(pad_tile(tile, psf.reach_px))
        for channel in optics.cfa.colors:
            light = _composite_layers(optics, layers, tile, spectra, channel)
            _add_to_photosites(result, light, tile, frame, [(y, x) for y in (0, 1) for x in (0, 1) if block[y][x] == channel])
        progress(first + (1.0 - first) * (count + 1) / len(tiles))
    return device.upload(result)


def _add_to_photosites(result: np.ndarray, light: np.ndarray, tile: Tile, frame: Window, places: list[tuple[int, int]]) -> None:
    """Add a tile's light of one colour to the photosites of that colour, at these places of the 2 x 2 block of the filter.

    Below 0 it is none.
    """
    top, left = max(tile.rows.start, frame.y), max(tile.columns.start, frame.x)
    bottom, right = min(tile.rows.stop, frame.y + frame.height), min(tile.columns.stop, frame.x + frame.width)
    for y, x in places:
        row, column = top + (y - (top - frame.y)) % 2, left + (x - (left - frame.x)) % 2
        into = result[row - frame.y : bottom - frame.y : 2, column - frame.x : right - frame.x : 2]
        own = light[row - tile.rows.start : bottom - tile.rows.start : 2, column - tile.columns.start :][
            :, : right - column : 2
        ]
        np.maximum(own + into, 0.0, out=into, casting="same_kind")


class _BlurredFrame:
    """The frame after the geometric blur, in full colour, with its margins."""

    def __init__(
        self,
        optics: OpticsPlan,
        blur: TilePlan | None,
        device: Device,
        planes: Sequence[Buffer],
        progress: Callable[[float], None],
    ) -> None:
        self.area = optics.blur_window()
        shape = self.area.height, self.area.width
        self.light: dict[int, np.ndarray] = {}
        whole = replace(optics, window=self.area)
        colors = optics.cfa.colors
        if blur is not None:
            mosaics = defocused_mosaics(blur, [Cfa.uniform(channel) for channel in colors], device, list(planes), progress)
            found = device.download(mosaics, (len(colors), *shape), np.float32)
            self.light.update(zip(colors, found, strict=True))
        else:
            for count, channel in enumerate(colors):

                def report(share: float, count: int = count) -> None:
                    progress((count + share) / len(colors))

                made = reference_mosaic(whole.in_one_color(channel), device, list(planes), report)
                self.light[channel] = device.download(made, shape, np.float32)

    def crop(self, part: Window) -> list[Surface]:
        """One opaque surface in focus with the blurred light of a window."""
        top, left = part.y - self.area.y, part.x - self.area.x
        light = {
            channel: plane[None, top : top + part.height, left : left + part.width] for channel, plane in self.light.items()
        }
        return [Surface(light, None, 0.0)]


def _project_layers(optics: OpticsPlan, device: Device, planes: Sequence[Buffer], part: Window) -> list[Surface]:
    """Project the layers of the scene, without blur, onto a window that may extend beyond the sensor."""
    over, channels = _psf_of(optics).over, optics.channels
    radii = (0.0,) if optics.defocus is None else optics.defocus.radii_px
    layout = InterleavedColumns(over, part.height * over, -(-part.width // 2))
    covered = optics.defocus is not None and optics.has_coverage
    found, count, origin = [], channels + covered, (part.x, part.y)
    sampled_by = _psf_of(optics).sampled(optics.projection)
    for buffer, radius in zip(planes, radii, strict=True):
        sampled = device.empty(layout.shape(count), np.float32)
        project_planes(device, sampled_by, buffer, count, sampled, 0, layout, origin)
        light = _split_phases(layout.decode(device.download(sampled, layout.shape(count), np.float32)), over, part)
        here = radius
        if isinstance(radius, np.ndarray):
            mapped, scene_radius = device.empty(layout.shape(1), np.float32), device.upload(radius)
            project_radius(device, optics.radius_projection, scene_radius, mapped, 0, layout, origin)
            here = _split_phases(layout.decode(device.download(mapped, layout.shape(1), np.float32)), over, part)[0]
        found.append(Surface(dict(enumerate(light[:channels])), light[channels] if covered else None, here))
    return found


def _split_phases(samples: np.ndarray, over: int, part: Window) -> np.ndarray:
    """Split samples (planes, over * rows, over * columns) into phases (planes, over^2, rows, columns) on the photosites."""
    planes, rows, columns = samples.shape
    split = samples.reshape(planes, rows // over, over, columns // over, over).transpose(0, 2, 4, 1, 3)
    return np.ascontiguousarray(split.reshape(planes, over * over, rows // over, columns // over)[..., : part.width])


def _composite_layers(
    optics: OpticsPlan, layers: list[Surface], tile: Tile, spectra: KernelSpectra, channel: int
) -> np.ndarray:
    """Convolve the layers of a tile in one colour and composite them front to back."""
    radius_px = layers[0].radius_px
    if len(layers) == 1 and layers[0].coverage is None and not isinstance(radius_px, np.ndarray):
        slab = _nearest_slab(optics, radius_px)
        return _convolve_slab(optics, layers[0].light[channel], 1.0, tile, spectra, (slab, channel))
    shape = tile.rows.stop - tile.rows.start, tile.columns.stop - tile.columns.start
    light, covered, transmitted = np.zeros(shape), np.zeros(shape), np.ones(shape)
    for layer in layers:
        own_light, own_coverage = _convolve_layer(optics, layer, tile, spectra, channel)
        light, covered = light + transmitted * own_light, covered + transmitted * own_coverage
        transmitted = transmitted * np.clip(1.0 - own_coverage, 0.0, 1.0)
    opaque = optics.defocus is not None and optics.defocus.opaque
    return light / covered if opaque else light


def _convolve_layer(
    optics: OpticsPlan, layer: Surface, tile: Tile, spectra: KernelSpectra, channel: int
) -> tuple[np.ndarray, np.ndarray]:
    """Light and coverage of a layer after its kernels, (rows, columns) float64; nearer slabs occlude farther ones.

    Slabs that are near each other are one surface and do not occlude each other: a slab is attenuated by all nearer slabs but
    those up to one step away (`FieldPsf.is_near`).
    """
    shape = tile.rows.stop - tile.rows.start, tile.columns.stop - tile.columns.start
    psf, surface = _psf_of(optics), deque[tuple[int, np.ndarray]]()  # near slabs, and what all up to each let through
    light, coverage, before, transmitted = np.zeros(shape), np.zeros(shape), np.ones(shape), np.ones(shape)
    for slab, share in _split_into_slabs(optics, layer):
        while surface and not psf.is_near(surface[0][0], slab):
            before = surface.popleft()[1]
        own_light = _convolve_slab(optics, layer.light[channel], share, tile, spectra, (slab, channel))
        covered = share if layer.coverage is None else layer.coverage * share
        own_coverage = convolve_tile(transform_light(covered, spectra), tile, spectra, slab, channel, False)
        light, coverage = light + before * own_light, coverage + before * own_coverage
        transmitted = np.maximum(transmitted - before * own_coverage, 0.0)
        surface.append((slab, transmitted))
    return light, coverage


def _convolve_slab(
    optics: OpticsPlan,
    light: np.ndarray,
    share: float | np.ndarray,
    tile: Tile,
    spectra: KernelSpectra,
    name: tuple[int, int],
) -> np.ndarray:
    """Convolve the light of a slab on a tile; light above the limit of highlights goes through a kernel without ringing.

    share: of the light that belongs to the slab. name: slab and channel.
    """
    psf, rest = _psf_of(optics), None
    if psf.has_ringing(*name) and light.max() > psf.highlight_limits[name[1]]:
        limit = np.float32(psf.highlight_limits[name[1]])
        light, rest = np.minimum(light, limit), np.maximum(light - limit, np.float32(0.0))
    found = convolve_tile(transform_light(light * share, spectra), tile, spectra, *name, False)
    return found if rest is None else found + convolve_tile(transform_light(rest * share, spectra), tile, spectra, *name, True)


def _split_into_slabs(optics: OpticsPlan, layer: Surface) -> Iterator[tuple[int, np.ndarray]]:
    """Slabs in which a layer has light, nearest first: number, and share of the light."""
    psf = _psf_of(optics)
    if not isinstance(layer.radius_px, np.ndarray):
        yield _nearest_slab(optics, layer.radius_px), np.ones(layer.light[0].shape)
        return
    place = np.interp(layer.radius_px, psf.radii_px, np.arange(len(psf.radii_px)))
    for slab in range(int(place.min()), int(np.ceil(place.max())) + 1):
        share = np.maximum(0.0, 1.0 - np.abs(place - slab))
        if share.any():
            yield slab, share


def _nearest_slab(optics: OpticsPlan, radius_px: float) -> int:
    """Number of the slab whose blur radius is nearest to that of a layer."""
    return int(np.argmin(np.abs(np.asarray(_psf_of(optics).radii_px) - radius_px)))


def _psf_of(optics: OpticsPlan) -> FieldPsf:
    """The planned PSF, without which this pass does not run."""
    assert optics.psf is not None
    return optics.psf
