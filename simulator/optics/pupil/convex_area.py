"""Area of an intersection of disks and half planes in closed form.

Green's theorem: twice the area is the integral of x . n along the outline, n the outward normal. The outline consists of the
pieces of each part's border that lie inside all other parts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


def disk_span(x: float | np.ndarray, y: float | np.ndarray, radius: float, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends of the rows inside disks of one radius; an empty row has its left end beyond its right one."""
    square = radius**2 - (rows - y) ** 2
    half = np.where(square >= 0, np.sqrt(np.abs(square)), -np.inf)
    return x - half, x + half


@dataclass(frozen=True)
class Disk:
    """Points within a distance `radius` of (x, y)."""

    x: float
    y: float
    radius: float

    def contains(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Whether points lie inside."""
        return (x - self.x) ** 2 + (y - self.y) ** 2 <= self.radius**2

    def depth(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Distance of points from the border, negative outside."""
        return self.radius - np.hypot(x - self.x, y - self.y)

    def span(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the rows y inside; an empty row has its left end beyond its right one."""
        return disk_span(self.x, self.y, self.radius, rows)

    def border(self, others: "Sequence[Disk | HalfPlane]") -> float:
        """Integral of x . n along the arcs of the circle inside all others."""
        crossings = [angle for other in others for angle in _crossings(self, other)]
        cuts = np.sort(np.mod(crossings, 2.0 * math.pi)) if crossings else np.zeros(1)
        ends = np.append(cuts[1:], cuts[0] + 2.0 * math.pi)
        middle = 0.5 * (cuts + ends)
        x, y = self.x + self.radius * np.cos(middle), self.y + self.radius * np.sin(middle)
        inside = np.logical_and.reduce([other.contains(x, y) for other in others]) if others else True
        arcs = self.radius * (ends - cuts)
        arcs += self.x * (np.sin(ends) - np.sin(cuts)) - self.y * (np.cos(ends) - np.cos(cuts))
        return float(self.radius * np.sum(arcs * inside))


@dataclass(frozen=True)
class HalfPlane:
    """Points with nx x + ny y <= offset; (nx, ny) has length one."""

    nx: float
    ny: float
    offset: float

    def contains(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Whether points lie inside."""
        return self.nx * x + self.ny * y <= self.offset

    def depth(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Distance of points from the border, negative outside."""
        return self.offset - self.nx * x - self.ny * y

    def span(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends of the rows y inside; an empty row has its left end beyond its right one."""
        rest = self.offset - self.ny * rows
        endless = np.full_like(rows, np.inf)
        if abs(self.nx) < 1e-12:
            return np.where(rest >= 0, -endless, endless), endless
        return (-endless, rest / self.nx) if self.nx > 0 else (rest / self.nx, endless)

    def border(self, others: "Sequence[Disk | HalfPlane]") -> float:
        """Integral of x . n along the piece of the line inside all others."""
        low, high = -math.inf, math.inf
        for other in others:
            first, last = _piece(self, other)
            low, high = max(low, first), min(high, last)
        return self.offset * (high - low) if high > low else 0.0


def intersection_area(shapes: Sequence[Disk | HalfPlane]) -> float:
    """Area of the intersection of shapes, which must be bounded; equal shapes count once."""
    parts = list(dict.fromkeys(shapes))
    if any(isinstance(a, Disk) and isinstance(b, Disk) and _are_disjoint(a, b) for a in parts for b in parts):
        return 0.0
    return max(0.0, 0.5 * sum(part.border([other for other in parts if other is not part]) for part in parts))


def _are_disjoint(a: Disk, b: Disk) -> bool:
    """Whether two disks do not overlap."""
    return math.hypot(a.x - b.x, a.y - b.y) >= a.radius + b.radius


def _crossings(disk: Disk, other: Disk | HalfPlane) -> list[float]:
    """Angles at which another border crosses the circle [rad]."""
    if isinstance(other, HalfPlane):
        share = (other.offset - other.nx * disk.x - other.ny * disk.y) / disk.radius
        towards = math.atan2(other.ny, other.nx)
    else:
        distance = math.hypot(other.x - disk.x, other.y - disk.y)
        if distance == 0.0:
            return []
        share = (distance**2 + disk.radius**2 - other.radius**2) / (2.0 * distance * disk.radius)
        towards = math.atan2(other.y - disk.y, other.x - disk.x)
    if not -1.0 < share < 1.0:
        return []
    return [towards - math.acos(share), towards + math.acos(share)]


def _piece(line: HalfPlane, other: Disk | HalfPlane) -> tuple[float, float]:
    """Ends of the piece of a line inside another shape, along its direction (-ny, nx) from its point nearest to the origin."""
    if isinstance(other, Disk):
        along = -line.ny * other.x + line.nx * other.y
        square = other.radius**2 - (line.nx * other.x + line.ny * other.y - line.offset) ** 2
        return (along - math.sqrt(square), along + math.sqrt(square)) if square > 0 else (math.inf, -math.inf)
    slope = line.nx * other.ny - line.ny * other.nx
    rest = other.offset - line.offset * (line.nx * other.nx + line.ny * other.ny)
    if abs(slope) < 1e-12:
        return (-math.inf, math.inf) if rest >= 0 else (math.inf, -math.inf)
    return (-math.inf, rest / slope) if slope > 0 else (rest / slope, math.inf)
