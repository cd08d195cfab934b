"""Velocity of each pixel of a scene, and where a search for the surface at a place begins.

At an instant t of the clock a place p shows the surface at the scene's place q with q + v(q) t = p. The kernel finds q by fixed
point, q = p - v(q) t, from several starts: q = p, and p less the way of the velocities that pass there and are extreme to the
right, left, below and above.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.motion import Motion
from simulator.scene.scene import Scene, is_depth_map

TILE = 16  # scene pixels on a side that share the starts of a search
DIRECTIONS = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
STARTS = 1 + len(DIRECTIONS)
ROWS = 256  # of a picture that are computed in double precision at once
SIDES = 8  # of the polygon that bounds all velocities
NEAR_PX = 0.5  # relative way of neighbouring pixels below which they are one surface; of all that pass a tile, for one start
FARTHEST = np.float32(3e38)  # distance at infinity, for the order of surfaces


@dataclass(frozen=True)
class PixelVectors:
    """Velocities of the pixels of a scene, and which surface covers which.

    velocity: (height, width, 2) float32, to the right and down [scene px/s].
    depth_m: (height, width) float32, by which nearer surfaces cover; None: by speed, the faster covers the slower.
    notes: of their file, for the log.
    """

    velocity: np.ndarray
    depth_m: np.ndarray | None
    notes: tuple[str, ...] = ()

    @cached_property
    def polygon(self) -> np.ndarray:
        """Corners of a polygon around all velocities, (corners, 2) float64 [scene px/s], at most 8 % beyond them."""
        angles = 2.0 * np.pi * np.arange(SIDES) / SIDES
        sides = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        blocks = (self.velocity[first : first + ROWS].astype(np.float64) for first in range(0, len(self.velocity), ROWS))
        reach = np.max([(block.reshape(-1, 2) @ sides.T).max(axis=0) for block in blocks], axis=0)
        pairs = np.stack([sides, np.roll(sides, -1, axis=0)], axis=1)
        corners = np.linalg.solve(pairs, np.stack([reach, np.roll(reach, -1)], axis=-1)[..., None])[..., 0]
        return np.unique(corners.round(9), axis=0)

    def tears(self, first_s: float, last_s: float) -> bool:
        """Whether neighbouring pixels come apart or cover each other while the clock is within these times [s]."""
        apart = max((float(np.abs(np.diff(self.velocity, axis=axis)).max(initial=0.0)) for axis in (0, 1)), default=0.0)
        return apart * max(abs(first_s), abs(last_s)) >= NEAR_PX

    def table(self) -> np.ndarray:
        """Return velocity and order, (height, width, 3) float32: the surface of the smaller order covers the other."""
        x, y = self.velocity[..., 0], self.velocity[..., 1]
        order = -np.hypot(x, y) if self.depth_m is None else np.minimum(self.depth_m, FARTHEST)
        return np.concatenate([self.velocity, order[..., None]], axis=-1, dtype=np.float32)

    def starts(self, first_s: float, last_s: float) -> np.ndarray:
        """Return where searches begin, (tile rows, tile columns, 2 STARTS) float32, while the clock is within these times [s].

        Of each tile: how many starts count, 0, then the velocities of those after the first [scene px/s].
        """
        times_s = min(first_s, 0.0), max(last_s, 0.0)
        own = _extremes(self.velocity)
        found = _passing(own, times_s)
        rows, columns = found.shape[:2]
        spread = np.stack([found[..., 0, 0] - found[..., 1, 0], found[..., 2, 1] - found[..., 3, 1]]).max(axis=0)
        is_plain = (spread * max(-times_s[0], times_s[1]) < NEAR_PX) | (not self.tears(first_s, last_s))
        is_new = np.asarray(found.any(axis=-1))  # a velocity of 0 begins where the first search does
        for number in range(1, len(DIRECTIONS)):
            is_new[..., number] &= (found[..., :number, :] != found[..., number, None, :]).any(axis=-1).all(axis=-1)
        found = np.take_along_axis(found, np.argsort(~is_new, axis=-1, kind="stable")[..., None], axis=-2)
        count = np.where(
            is_plain, 1, 1 + is_new.sum(axis=-1)
        )  # where nothing tears, each place has one pixel, which any start finds
        table = np.concatenate([count[..., None], np.zeros((rows, columns, 1)), found.reshape(rows, columns, -1)], axis=-1)
        return table.astype(np.float32)


def pixel_vectors(scene: Scene, motion: Motion, focal_px: float) -> PixelVectors | None:
    """Return the velocities of a scene's pixels; None without `Motion.vectors`.

    focal_px: pixels of the scene of one unit of the tangent of the field angle.
    Raises PhotositeError for a file that cannot be read or does not fit, and for metres in a scene without distances.
    """
    size = scene.planes.shape[0], scene.planes.shape[1]
    field = motion.vector_field(size, scene.window)
    if field is None or motion.vectors is None:
        return None
    if field.is_in_metres and not np.isfinite(scene.depth_m).any():
        rule = "is in metres, but the scene has no distance; give scene.depth, or vectors in px/s or px/frame"
        raise PhotositeError(rule, key="motion.vectors.unit", value=motion.vectors.unit)
    depth_m = np.asarray(scene.depth_m, np.float32) if is_depth_map(scene.depth_m) else None
    return PixelVectors(field.px_per_s(scene.depth_m, focal_px), depth_m, field.notes)


def _extremes(velocity: np.ndarray) -> np.ndarray:
    """Velocities of each tile that are extreme in each of `DIRECTIONS`, (tile rows, tile columns, directions, 2)."""
    height, width = velocity.shape[:2]
    rows, columns = math.ceil(height / TILE), math.ceil(width / TILE)
    padded = np.pad(velocity, ((0, rows * TILE - height), (0, columns * TILE - width), (0, 0)), mode="edge")
    tiles = padded.reshape(rows, TILE, columns, TILE, 2).swapaxes(1, 2).reshape(rows, columns, TILE * TILE, 2)
    found = [
        np.take_along_axis(tiles, (tiles @ way.astype(np.float32)).argmax(axis=2)[..., None, None], axis=2)
        for way in DIRECTIONS
    ]
    return np.concatenate(found, axis=2)


def _passing(own: np.ndarray, times_s: tuple[float, float]) -> np.ndarray:
    """Extremes of the velocities that pass each tile or one beside it, of tiles with these extremes, alike."""
    rows, columns = own.shape[:2]
    row, column = (np.repeat(place.ravel(), len(DIRECTIONS)) for place in np.mgrid[:rows, :columns])
    velocity = own.reshape(-1, 2)
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    way = velocity / np.where(speed > 0.0, speed, 1.0)[:, None]
    most = math.ceil(math.hypot(rows, columns))  # steps of a tile after which all have left the picture
    reach = [np.minimum(np.ceil(speed * abs(time_s) / TILE), most) for time_s in times_s]
    found, best = own.copy(), np.einsum("ijdk,dk->ijd", own, DIRECTIONS)
    for step in range(-int(reach[0].max()), int(reach[1].max()) + 1):
        there = np.rint(row + step * way[:, 1]).astype(np.intp), np.rint(column + step * way[:, 0]).astype(np.intp)
        inside = (there[0] >= 0) & (there[0] < rows) & (there[1] >= 0) & (there[1] < columns)
        passes = np.flatnonzero(inside & (reach[1 if step > 0 else 0] >= abs(step)))
        place = there[0][passes], there[1][passes]
        for number, direction in enumerate(DIRECTIONS):
            score = velocity[passes] @ direction
            np.maximum.at(best[..., number], place, score)
            wins = score == best[..., number][place]
            found[place[0][wins], place[1][wins], number] = velocity[passes[wins]]
    for axis in (0, 1):
        found = _with_neighbours(found, axis)
    return found


def _with_neighbours(found: np.ndarray, axis: int) -> np.ndarray:
    """Extremes of each tile and those before and after it along an axis."""
    border = [(0, 0)] * 4
    border[axis] = (1, 1)
    padded, count = np.pad(found, border, mode="edge"), found.shape[axis]
    beside = np.stack([padded.take(range(first, first + count), axis=axis) for first in range(3)])
    chosen = np.einsum("nijdk,dk->nijd", beside, DIRECTIONS).argmax(axis=0)
    return np.take_along_axis(beside, chosen[None, ..., None], axis=0)[0]
