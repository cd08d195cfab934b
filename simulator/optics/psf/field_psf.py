"""Kernels over the field, defocus and channels: diffraction, aberrations, low-pass filter and aperture of the photosites.

Two methods. By distance: the scene is divided into slabs of blur radius, each convolved with the kernel of wave optics at its
defocus. After the blur: the geometric blur comes first, then a convolution with the kernel in focus; exact for the low-pass
filter, the aperture and a PSF known in focus only.
"""

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from simulator.optics.geometry.footprint import Footprint, footprint_of
from simulator.optics.geometry.projection import Projection
from simulator.optics.lens.perspective import AIRY_ZERO
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.defocused_psf import DefocusedPsf
from simulator.optics.psf.fraunhofer import ROUND, odd
from simulator.optics.psf.kernel_split import Core, farthest_tail_px, tail_reach
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_table import PsfTable, rotate_kernel, skew_kernel
from simulator.optics.psf.rotated_kernels import lagrange_weights
from simulator.optics.psf.square_light import square_phases
from simulator.optics.psf.visibility import Visibility
from simulator.optics.psf.wavefront_psf import LARGEST_KERNEL_PX, WavefrontPsf, kernel_size_px
from simulator.optics.pupil.pupil import UPRIGHT, Pupil

FIELD_STEPS = 4  # from the axis to the corner, at which kernels that turn with the field are computed, where no plan says more
# Margin around the geometric rays [lambda N], and the largest kernel [photosites] that it is used for: the first that fits is
# taken. A fraction of 0.2 / margin of the light lies beyond it.
MARGINS = ((60.0, 65), (40.0, 97), (20.0, 129), (12.0, 255), (6.0, LARGEST_KERNEL_PX))
MOST_CELLS = 601  # across a kernel
ROUGH_PX = 5  # width of the geometric spot above which a kernel has no detail finer than a fifth of a photosite
FAR_AIRY = 16.0  # blur radius [Airy radii] from which kernels of several are the geometric spot convolved with the PSF in focus
FAR_CELLS_PX = 24.0  # blur radius from which kernels have one cell per light sample
CORRECTIONS_PX = (6, 8, 12, 20)  # reach of the kernels of corrections [photosites]
CORRECTION_MARGIN_PX = 4  # reach beyond small geometric spots [photosites]
CORRECTION_GROWTH, CORRECTION_LEAST_PX = 1.75, 1.0  # reach of large ones [radii of the spot], and what is added [photosites]
FARTHEST_CORRECTION_PX = 14.0  # blur radius
FADE = 1.25
RINGING = 1e-3  # fraction of a kernel's light that may be negative
SLAB_PX = 0.5  # blur radius between slabs; a sixteenth of the radius where that is more


@dataclass(frozen=True)
class FieldPsf:
    """Kernels by slab of blur radius, channel and place on the sensor.

    lens_psf: of the lens, a table of light 1; None: an ideal lens. pupil: shape of its aperture.
    sampling: aperture of the photosites and low-pass filter.
    over: light samples per photosite and axis. radii_px: signed blur radii of the slabs, ascending [photosites].
    by_distance: whether the kernels of the slabs include the blur of defocus; False: they follow the geometric blur.
    sensor_px: width and height of the sensor. nodes: rows and columns of kernels on it.
    highlight_limits: electron radiance of each channel above which light is convolved with kernels clipped to positive values,
        since the ringing of band-limited kernels shows around highlights only [e- s^-1 um^-2 sr^-1].
    core: how the device gathers light with the kernels; None: they are convolved by transforms on the host.
    corrected_px: signed blur radii at which the geometric blur and the kernel in focus are corrected to wave optics, ascending.
    seen: how an error of gathered kernels shows in the scene. even_squares: whether light samples are even squares of the
        scene, whose kernels nothing cuts at half a cycle and none is negative; else they are means of light that is smooth
        between them.
    skew: of the lens's spots, as of `Pupil.skew`.
    footprints: of samples of each channel, or of all, that hold filter and open area (`Sampling.phases`); none: each is its own
        square.
    field_steps: from the axis to the corner, at which kernels that turn with the field are computed.
    field_error: predicted error of the light between nodes, as a share of the brightest.
    """

    lens_psf: WavefrontPsf | PsfTable | None
    pupil: Pupil
    sampling: Sampling
    pitch_um: float
    over: int
    radii_px: tuple[float, ...]
    by_distance: bool
    sensor_px: tuple[int, int]
    nodes: tuple[int, int]
    highlight_limits: tuple[float, ...] = ()
    core: Core | None = None
    corrected_px: tuple[float, ...] = ()
    seen: Visibility | None = None
    even_squares: bool = False
    skew: tuple[float, float] = UPRIGHT
    footprints: tuple[Footprint, ...] = ()
    field_steps: int = FIELD_STEPS
    field_error: float = 0.0

    @property
    def key(self) -> tuple[object, ...]:
        """Numbers that the kernels depend on."""
        lens: object = repr(self.lens_psf)
        if isinstance(self.lens_psf, PsfTable):
            table = self.lens_psf
            digest = hashlib.blake2b(np.ascontiguousarray(table.kernels).tobytes()).digest()
            lens = digest, table.kernels.shape, tuple(table.blur_radii_px), tuple(table.fields), table.cells
        places = (
            self.pitch_um,
            self.over,
            self.radii_px,
            self.sensor_px,
            self.nodes,
            bool(self.highlight_limits),
            self.even_squares,
            self.skew,
            self.footprints,
            self.field_steps,
        )
        return lens, repr(self.pupil), self.sampling, *places

    def with_core(self, core: Core, seen: Visibility) -> Self:
        """Return the same PSF with this core, as exact as a scene shows, and with the kernels that are already computed."""
        found = replace(self, core=core, seen=seen)
        for cache in ("_kernels", "_points", "_tables", "_slab_psfs"):
            found.__dict__[cache] = getattr(self, cache)
        return found

    @property
    def is_gathered_by_distance(self) -> bool:
        """Whether the device gathers light with the kernels of several slabs."""
        return self.core is not None and self.by_distance and len(self.radii_px) > 1

    def of_one_radius(self, radius_px: float) -> Self:
        """Return the PSF of one blur radius alone, with whole kernels of their own [photosites]."""
        return replace(self, radii_px=(radius_px,), core=None, seen=None)

    def at_radius(self, radius_px: float, *, in_focus: bool = False) -> Self:
        """Return the PSF of one blur radius; in focus: that of radius 0 with kernels of the same size and cells."""
        key = 0.0 if in_focus else radius_px
        if key not in self._at_radius:
            found = replace(self, radii_px=(key,), by_distance=True, corrected_px=())
            if isinstance(self.lens_psf, WavefrontPsf):
                largest_px = max(abs(radius) for radius in self.corrected_px)
                found._slab_psfs[0] = _fit_kernel(self.lens_psf, largest_px, self.over)
            self._at_radius[key] = found
        return self._at_radius[key]

    def far_kernels(self, radius_px: float, channel: int) -> tuple[np.ndarray, np.ndarray]:
        """What a photosite sees of light at a blur radius, by wave optics and as of circles far larger than the Airy disk.

        Of a wavefront without aberrations. Both (size, size) float64.
        """
        assert isinstance(self.lens_psf, WavefrontPsf)  # others know no wave optics
        found = []
        for lens in (_fit_kernel(self.lens_psf, radius_px, 1), self._far_psf(self.lens_psf, radius_px)):
            one = replace(self.of_one_radius(radius_px), over=1, even_squares=False, footprints=())
            one._slab_psfs[0] = lens
            found.append(one.computed_kernel(0, channel, (0.0, 0.0)))
        size = max(map(len, found))
        wave, circle = (np.pad(kernel, (size - len(kernel)) // 2) for kernel in found)
        return wave, circle

    @property
    def gather_reach_px(self) -> int:
        """Margin that a gather with core, tail and corrections needs [photosites]; without a core that of corrections."""
        own = 0 if self.core is None else self.core.arm_px
        if self.core is not None and self.core.has_tail:
            cell_px, reach_px = self.core.cell_px, self.reach_px
            if self.is_gathered_by_distance:
                reach_px = self._with_margin(self.tail_kernel(cell_px).size_px)
            own = max(own, cell_px * (tail_reach(reach_px, cell_px) + 2))
        return max(own, *(correction_reach_px(radius) for radius in self.corrected_px), 0)

    @property
    def held_px(self) -> float:
        """Distance from the geometric rays up to which all kernels hold the light of a wavefront [photosites].

        The largest kernels may end nearer; they count as if they held the least of MARGINS.
        """
        if self.core is not None and self.is_gathered_by_distance:
            return 0.5 * self.tail_kernel(self.core.cell_px).size_px
        assert isinstance(self.lens_psf, WavefrontPsf)  # others have a size of their own
        lambda_n_px = 1e-3 * float(np.max(self.lens_psf.wavelengths_nm)) * self.lens_psf.f_number / self.pitch_um
        slabs = enumerate(np.abs(self.radii_px) * self.lens_psf.opening.reach)
        beyond = (0.5 * lens.size_px - radius for slab, radius in slabs if (lens := self._slab_psf(slab)) is not None)
        return max(min(beyond), MARGINS[-1][0] * lambda_n_px)

    def tail_kernel(self, cell_px: int) -> WavefrontPsf:
        """Return the PSF in focus of the tail that slabs share on cells of this size; light beyond its kernel is that of wings.

        The kernel is cut where such a tail ends.
        """
        focus = self.fit_kernel(0.0)
        most_px = farthest_tail_px(cell_px) - self.sampling.margin_px(self.pitch_um, footprint_of(self.footprints, 0))
        return replace(focus, size_px=min(focus.size_px, 2 * most_px + 1))

    @cached_property
    def x_px(self) -> np.ndarray:
        """Columns of the nodes [photosites], 0 at the centre of the sensor's first column."""
        return _node_positions(self.sensor_px[0], self.nodes[1])

    @cached_property
    def y_px(self) -> np.ndarray:
        """Rows of the nodes [photosites], 0 at the centre of the sensor's first row."""
        return _node_positions(self.sensor_px[1], self.nodes[0])

    @cached_property
    def reach_px(self) -> int:
        """Half width of the largest kernel [photosites]."""
        found = (self._slab_psf(slab) for slab in range(len(self.radii_px)))
        size = max(1 if lens is None else lens.size_px for lens in found)
        return self._with_margin(size)

    def _with_margin(self, size_px: int) -> int:
        """Half width of a kernel of so many photosites, with the margin of its samples [photosites]."""
        return size_px // 2 + self.sampling.margin_px(self.pitch_um, footprint_of(self.footprints, 0))

    @property
    def sample_reach_px(self) -> int:
        """Photosites to either side from which a sample has light."""
        return max((math.ceil(one.reach_px - 0.5 / self.over) for one in self.footprints), default=0)

    def sample_spread(self, channel: int) -> np.ndarray | None:
        """Shares of light along an axis that samples of a footprint have of what lies in the part of one; None: it has all."""
        footprint = footprint_of(self.footprints, channel)
        if footprint is None:
            return None
        reach = math.ceil(self.over * footprint.reach_px)
        return footprint.of_pixel(np.arange(-reach, reach + 1) / self.over, 1.0 / self.over, is_tent=False)

    def sampled(self, projection: Projection) -> Projection:
        """Return the resampling of a scene by the samples that kernels are applied to."""
        return replace(projection, footprints=self.footprints) if self.footprints else projection

    def is_continuous(self, slab: int) -> bool:
        """Whether a slab and the one before it are adjacent in blur radius, so that they may be one surface."""
        return slab > 0 and self.is_near(slab - 1, slab)

    def is_near(self, nearer: int, slab: int) -> bool:
        """Whether two slabs are at most one step apart in blur radius (`slab_radii_px`). nearer: of the lower number."""
        before, here = self.radii_px[nearer], self.radii_px[slab]
        return here - before <= 1.01 * max(_step_px(before), _step_px(here))

    def has_ringing(self, slab: int, channel: int) -> bool:
        """Whether the negative values of a kernel exceed RINGING of its light, where highlights have a limit.

        In smooth light those count that a scene pixel shows. Those for samples of a footprint give back what these have less.
        """
        if not self.highlight_limits or self.footprints:
            return False
        kernel = self.kernel(slab, channel, False, self.nodes[0] // 2, self.nodes[1] // 2)
        if self.seen is not None and self.seen.is_smooth:
            kernel = self.seen.spread(kernel.sum(axis=0))
        return -float(np.minimum(kernel, 0.0).sum()) > RINGING * float(kernel.sum())

    def kernel(self, slab: int, channel: int, positive: bool, row: int, column: int) -> np.ndarray:
        """Kernel at a node, (over^2, size, size) float64, phases as of `Sampling.phases`.

        positive: negative values are clipped and the rest scaled down to the same sum; even squares have none.
        """
        if positive and not self.even_squares:
            kernel = self.kernel(slab, channel, False, row, column)
            kept = np.maximum(kernel, 0.0)
            return kept * (kernel.sum() / kept.sum())
        key = slab, channel, row, column
        if key not in self._kernels:
            own = self._own_node(row, column)
            self._kernels[key] = self._make_kernel(slab, channel, own) if own == (row, column) else self._mirrored(key, own)
        return self._kernels[key]

    def _own_node(self, row: int, column: int) -> tuple[int, int]:
        """Node whose kernel mirrors that of this node: the one in the first quarter, if kernels turn with the field."""
        if not self.has_mirrored_nodes:
            return row, column
        return min(row, self.nodes[0] - 1 - row), min(column, self.nodes[1] - 1 - column)

    @property
    def has_mirrored_nodes(self) -> bool:
        """Whether kernels turn with the field, so that those of mirrored places are mirror images."""
        return isinstance(self.lens_psf, WavefrontPsf) and not has_fixed_orientation(self.lens_psf) and self.skew == UPRIGHT

    def _mirrored(self, key: tuple[int, int, int, int], own: tuple[int, int]) -> np.ndarray:
        """Kernel of a node, mirrored from its own in rows, columns or both, and in the places of the light samples."""
        slab, channel, row, column = key
        kernel = self.kernel(slab, channel, False, *own)
        by_place = kernel.reshape(self.over, self.over, *kernel.shape[1:])
        axes = [axis for axis, changed in enumerate((row != own[0], column != own[1])) if changed]
        return np.flip(by_place, (*axes, *(axis + 2 for axis in axes))).reshape(kernel.shape)

    def point_cells(self, channel: int, row: int, column: int) -> tuple[np.ndarray, int]:
        """Light of a point in each cell at a node of the first slab, (size, size) float64, and cells per photosite and axis."""
        own = self._own_node(row, column)
        key = channel, *own
        if key not in self._points:
            self._points[key] = self._node_cells(0, channel, own)
        cells, per_photosite = self._points[key]
        return cells[:: 1 if row == own[0] else -1, :: 1 if column == own[1] else -1], per_photosite

    def _node_cells(self, slab: int, channel: int, node: tuple[int, int]) -> tuple[np.ndarray, int]:
        """As `point_cells`, of any slab."""
        cells, per_photosite = self._cells(slab, channel, self.field_xy(*node))
        return (cells if self.skew == UPRIGHT else skew_kernel(cells, self.skew)), per_photosite

    def _make_kernel(self, slab: int, channel: int, node: tuple[int, int]) -> np.ndarray:
        if slab == 0 and self.nodes == (1, 1):
            cells, per_photosite = self.point_cells(channel, *node)
        else:
            cells, per_photosite = self._node_cells(slab, channel, node)
        return self._sampled(cells, per_photosite, channel)

    def _sampled(self, cells: np.ndarray, per_photosite: int, channel: int) -> np.ndarray:
        """`Sampling.phases` of the light of a point in cells, or the same of even squares."""
        if self.even_squares:
            return square_phases(self.sampling, self.pitch_um, cells, per_photosite, self.over)
        band_limited = isinstance(self.lens_psf, WavefrontPsf) or per_photosite > 1
        footprint = footprint_of(self.footprints, channel)
        return self.sampling.phases(cells, per_photosite, self.pitch_um, self.over, band_limited, footprint)

    def field_xy(self, row: int, column: int) -> tuple[float, float]:
        """Place of a node over the sensor's half diagonal, x to the right and y down from its middle."""
        width, height = self.sensor_px
        half = 0.5 * math.hypot(width, height)
        return (self.x_px[column] + 0.5 - 0.5 * width) / half, (self.y_px[row] + 0.5 - 0.5 * height) / half

    def fit_kernel(self, radius_px: float) -> WavefrontPsf:
        """Return the PSF of the wavefront with kernel size and cells of a blur radius."""
        assert isinstance(self.lens_psf, WavefrontPsf)  # others have a size of their own
        return _fit_kernel(self.lens_psf, radius_px, self.over)

    def computed_kernel(self, slab: int, channel: int, field_xy: tuple[float, float]) -> np.ndarray:
        """What a photosite at a place of the field sees of light, computed there: (size, size) float64."""
        lens = self._slab_psf(slab)
        assert lens is not None  # an ideal lens has the same kernel everywhere
        cells = lens.cell_kernel(channel, self.radii_px[slab], field_xy)
        cells = cells if isinstance(lens, PsfTable) else cells / cells.sum()
        cells = cells if self.skew == UPRIGHT else skew_kernel(cells, self.skew)
        return self._sampled(cells, lens.cells, channel).sum(axis=0)

    def _cells(self, slab: int, channel: int, field_xy: tuple[float, float]) -> tuple[np.ndarray, int]:
        """Light of a point in each cell, and cells per photosite."""
        lens, radius_px = self._slab_psf(slab), self.radii_px[slab]
        if lens is None:
            return np.ones((1, 1)), 1
        if isinstance(lens, WavefrontPsf) and self.nodes != (1, 1) and not has_fixed_orientation(lens):
            return self._turned_cells(lens, slab, channel, field_xy), lens.cells
        cells = lens.cell_kernel(channel, radius_px, field_xy)
        return (cells if isinstance(lens, PsfTable) else cells / cells.sum()), lens.cells

    def _turned_cells(self, lens: WavefrontPsf, slab: int, channel: int, field_xy: tuple[float, float]) -> np.ndarray:
        """Kernel at a place, of cubics through those computed at even field radii, turned to it; only these are computed."""
        steps, size = self.field_steps, lens.size_px * lens.cells
        place, found = min(math.hypot(*field_xy), 1.0) * steps, np.zeros((size, size))
        for number, weight in zip(*lagrange_weights(np.arange(-1.0, steps + 1.0), place), strict=True):
            if weight:
                kernel = self._at_step(lens, slab, channel, abs(int(number) - 1))
                found += weight * (kernel if number else kernel[:, ::-1])  # the other side of the axis has it mirrored
        return rotate_kernel(found, math.atan2(field_xy[1], field_xy[0]))

    def _at_step(self, lens: WavefrontPsf, slab: int, channel: int, step: int) -> np.ndarray:
        """Kernel at one of the `field_steps` on the x axis."""
        key = slab, channel, step
        if key not in self._tables:
            cells = lens.cell_kernel(channel, self.radii_px[slab], (step / self.field_steps, 0.0))
            self._tables[key] = (cells / cells.sum()).astype(np.float32)
        return self._tables[key]

    def _slab_psf(self, slab: int) -> WavefrontPsf | DefocusedPsf | PsfTable | None:
        """Point spread function of a slab; that of a wavefront has the kernel size and cells that its blur radius needs."""
        if not isinstance(self.lens_psf, WavefrontPsf):
            return self.lens_psf
        if slab not in self._slab_psfs:
            self._slab_psfs[slab] = self._fit_to_radius(self.lens_psf, self.radii_px[slab])
        return self._slab_psfs[slab]

    def _fit_to_radius(self, lens_psf: WavefrontPsf, radius_px: float) -> WavefrontPsf | DefocusedPsf:
        is_near = abs(radius_px) < FAR_AIRY * airy_radius_px(lens_psf)
        if lens_psf.aberrations != Aberrations() or is_near or len(self.radii_px) == 1:
            return _fit_kernel(lens_psf, radius_px, self.over)
        return self._far_psf(lens_psf, radius_px)

    def _far_psf(self, lens_psf: WavefrontPsf, radius_px: float) -> DefocusedPsf:
        focus = _fit_kernel(lens_psf, 0.0, self.over)
        coarse = odd(self.over) if abs(radius_px) > FAR_CELLS_PX else max(odd(self.over), 3)
        return DefocusedPsf(replace(focus, cells=min(focus.cells, coarse)), self.pupil, radius_px)

    @cached_property
    def _kernels(self) -> dict[tuple[int, int, int, int], np.ndarray]:
        return {}

    @cached_property
    def _points(self) -> dict[tuple[int, int, int], tuple[np.ndarray, int]]:
        return {}

    @cached_property
    def _at_radius(self) -> dict[float, Self]:
        return {}

    @cached_property
    def _tables(self) -> dict[tuple[int, int, int], np.ndarray]:
        return {}

    @cached_property
    def _slab_psfs(self) -> dict[int, WavefrontPsf | DefocusedPsf]:
        return {}


def correction_reach_px(radius_px: float) -> int:
    """Photosites to either side of a correction's kernel.

    What it leaves out grows with the spot: the errors are those of `docs/lens_aberrations.md`, *With depth*.
    """
    radius = abs(radius_px)
    wanted = max(math.ceil(radius) + CORRECTION_MARGIN_PX, CORRECTION_GROWTH * radius + CORRECTION_LEAST_PX)
    return next((size for size in CORRECTIONS_PX if size >= wanted), CORRECTIONS_PX[-1])


def farthest_correction_px(psf: WavefrontPsf) -> float:
    """Largest blur radius with a correction [photosites]; up to FADE times as much it fades."""
    return min(FARTHEST_CORRECTION_PX, FAR_AIRY * airy_radius_px(psf))


def airy_radius_px(psf: WavefrontPsf) -> float:
    """Radius of the first dark ring of a lens in focus at its shortest wavelength [photosites]."""
    return AIRY_ZERO * 1e-3 * float(np.min(psf.wavelengths_nm)) * psf.f_number / psf.pitch_um


def _node_positions(side_px: int, count: int) -> np.ndarray:
    return np.linspace(0.0, side_px, count) - 0.5 if count > 1 else np.array([0.5 * side_px - 0.5])


def _step_px(radius_px: float) -> float:
    return max(SLAB_PX, abs(radius_px) / 16.0)


def has_fixed_orientation(psf: WavefrontPsf) -> bool:
    """Whether a part of the wavefront is fixed to the picture's axes, so that kernels do not rotate with the field."""
    return psf.opening is not ROUND or psf.aberrations.has_fixed_orientation


def _fit_kernel(psf: WavefrontPsf, radius_px: float, over: int) -> WavefrontPsf:
    """Return the PSF with a kernel that holds all rays and as much of the diffracted light beyond as its size allows."""
    longest_um, shortest_um = 1e-3 * float(np.max(psf.wavelengths_nm)), 1e-3 * float(np.min(psf.wavelengths_nm))
    radii_px = (radius_px * psf.opening.reach,)
    rays = kernel_size_px(psf.aberrations, psf.f_number, psf.pitch_um, psf.wavelengths_nm, radii_px, airy_margin=0.0)
    per_margin = 2.0 * longest_um * psf.f_number / psf.pitch_um
    sizes = [odd(rays + margin * per_margin) for margin, _ in MARGINS]
    size = next((size for size, (_, most) in zip(sizes, MARGINS, strict=True) if size <= most), LARGEST_KERNEL_PX)
    wanted = odd(psf.pitch_um / (0.5 * shortest_um * psf.f_number))
    least = 1 if over == 1 and wanted == 1 else odd(over)
    most = max(((MOST_CELLS // size) - 1) // 2 * 2 + 1, least)
    return replace(psf, size_px=size, cells=min(max(wanted, least), 5 if rays > ROUGH_PX else wanted + 2, most))


def slab_radii_px(least_px: float, greatest_px: float) -> list[float]:
    """Signed blur radii from the least to the greatest, at the largest distance that slabs may have [photosites]."""
    radii = [least_px]
    while radii[-1] < greatest_px - 1e-6:
        radii.append(min(radii[-1] + _step_px(radii[-1]), greatest_px))
    return radii
