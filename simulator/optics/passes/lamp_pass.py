"""Takes lamps out of a scene's planes (kernels/lamps.cl), and draws each behind the lens, to where its light reaches.

Every photosite adds up the lamps in the order of the scene, so that a crop has the bits of the frame.
"""

import itertools
import math
from dataclasses import dataclass

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.defocus.lamp_images import DefocusedSpots, drawn_spots
from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.lamp_spots import LampSpots
from simulator.optics.psf.lamps import Lamps
from simulator.sensor.camera.camera_sections import Window

PLACES = 1 << 24  # parts of a photosite in which places are told apart


def take_lamps(optics: OpticsPlan, device: Device, planes: Buffer) -> None:
    """Take the light of lamps out of the planes of the only layer of a scene, in place."""
    lamps, (height, width, _) = optics.lamps, optics.scene.planes.shape
    assert lamps is not None  # without them this pass does not run
    left, _ = lamps.split(optics.scene.planes, optics.weights)
    device.run(
        device.kernel("lamps", {"CHANNELS": optics.channels}),
        left.shape,
        None,
        planes=planes,
        places=device.upload((lamps.rows * width + lamps.columns).astype(np.uint32)),
        left=device.upload(left),
        pixels=height * width,
    )


def add_lamps(optics: OpticsPlan, device: Device, light: Buffer) -> Buffer:
    """Device buffer (height, width) float32: the mosaic `light` with the image of each lamp."""
    lamps, frame = optics.lamps, optics.window
    assert lamps is not None  # without them this pass does not run
    _, excess = lamps.split(optics.scene.planes, optics.weights)
    drawn, spots = np.zeros((frame.height, frame.width)), _spots(optics)
    of_filter = optics.at_spots() if optics.projection.low_pass_px else [optics]  # of rays, which start where it lets them
    for spot in of_filter:
        for lamp in _placed(lamps, spot.projection, frame, spots.reach_px):
            _draw(drawn, lamp, excess[lamp.number] / len(of_filter), optics, spots)
    found = device.download(light, drawn.shape, np.float32)
    return device.upload((drawn + found).astype(np.float32))


def _spots(optics: OpticsPlan) -> LampSpots | DefocusedSpots:
    """Images of lamps: behind the point spread function, or out of focus behind an ideal lens."""
    projection = optics.projection
    if optics.psf is None:
        assert optics.defocus is not None  # lamps in focus are drawn behind a point spread function alone
        return drawn_spots(optics.defocus, projection)
    every = [
        _on_sensor(np.arange(count), offset, projection.scale)[1]
        for count, offset in ((projection.scene_height, projection.offset_y), (projection.scene_width, projection.offset_x))
    ]
    return LampSpots(optics.psf, 1.0 / projection.scale, np.concatenate(every), is_tent=projection.is_bilinear)


@dataclass(frozen=True)
class _Placed:
    """A lamp on the sensor. number: of the lamp. photosite: row and column of its own. place: down and right in it."""

    number: int
    photosite: tuple[int, int]
    place: tuple[float, float]


def _placed(lamps: Lamps, projection: Projection, frame: Window, reach_px: int) -> list[_Placed]:
    """Lamps that reach a window; those in the border of a scene also where the border goes on beyond it."""
    axes = []
    for pixels, count, offset, first, size in (
        (lamps.rows, projection.scene_height, projection.offset_y, frame.y, frame.height),
        (lamps.columns, projection.scene_width, projection.offset_x, frame.x, frame.width),
    ):
        low = math.floor((first - reach_px) * projection.scale + offset)
        high = math.ceil((first + size + reach_px) * projection.scale + offset)
        shown = np.arange(low, high + 1)
        photosites, places = _on_sensor(shown, offset, projection.scale)
        of_pixel: dict[int, list[tuple[int, float]]] = {}
        for pixel, *where in zip(np.clip(shown, 0, count - 1).tolist(), photosites.tolist(), places.tolist(), strict=True):
            of_pixel.setdefault(pixel, []).append((where[0], where[1]))
        axes.append([of_pixel.get(pixel, []) for pixel in pixels.tolist()])
    return [
        _Placed(number, (row, column), (down, right))
        for number, (rows, columns) in enumerate(zip(*axes, strict=True))
        for (row, down), (column, right) in itertools.product(rows, columns)
    ]


def _on_sensor(pixels: np.ndarray, offset: float, scale: float) -> tuple[np.ndarray, np.ndarray]:
    """Photosites in which pixels of the scene have their middle, and their places in them, in whole 1 / PLACES."""
    middle = np.rint((pixels + 0.5 - offset) / scale * PLACES).astype(np.int64)
    return middle // PLACES, (middle % PLACES) / PLACES


def _draw(drawn: np.ndarray, lamp: _Placed, excess: np.ndarray, optics: OpticsPlan, spots: LampSpots | DefocusedSpots) -> None:
    """Add a lamp to the light of a window, in place. excess: (channels,) its electron radiance."""
    frame, reach = optics.window, spots.reach_px
    top, left = (own - reach for own in lamp.photosite)
    rows = range(max(top, frame.y), min(top + 2 * reach + 1, frame.y + frame.height))
    columns = range(max(left, frame.x), min(left + 2 * reach + 1, frame.x + frame.width))
    if not rows or not columns:
        return
    period, planes = optics.cfa.period, optics.cfa.planes
    for node, down, across in _node_shares(spots.psf, rows, columns):
        for y, x in itertools.product(range(min(period[0], len(rows))), range(min(period[1], len(columns)))):
            channel = planes[(rows[0] + y) % period[0]][(columns[0] + x) % period[1]]
            own = (
                slice(rows[y] - top, rows[-1] - top + 1, period[0]),
                slice(columns[x] - left, columns[-1] - left + 1, period[1]),
            )
            image = excess[channel] * spots.image(channel, node, lamp.place)[own]
            into = drawn[rows[y] - frame.y : rows[-1] - frame.y + 1 : period[0]]
            into = into[:, columns[x] - frame.x : columns[-1] - frame.x + 1 : period[1]]
            into += image if down is None or across is None else image * down[y :: period[0], None] * across[x :: period[1]]


def _node_shares(
    psf: FieldPsf | None, rows: range, columns: range
) -> list[tuple[tuple[int, int], np.ndarray | None, np.ndarray | None]]:
    """Nodes whose kernels photosites see, with the share of each row and of each column; None: 1."""
    if psf is None or psf.nodes == (1, 1):
        return [((0, 0), None, None)]
    down, across = (
        [(node, np.interp(places, nodes, one)) for node, one in enumerate(np.eye(len(nodes)))]
        for places, nodes in ((rows, psf.y_px), (columns, psf.x_px))
    )
    return [((row, column), y, x) for row, y in down if y.any() for column, x in across if x.any()]
