"""The wide smooth tail of a point spread function, gathered on cells of a band (kernels/psf_tail.cl)."""

from collections.abc import Mapping
from dataclasses import dataclass

from simulator.device import Buffer, Device
from simulator.optics.passes.psf_bands import PsfBand
from simulator.optics.psf.kernel_split import TAIL_MARGIN_PX

SPAN_CELLS = 32  # cells of a tail that a work-item computes on a CPU


@dataclass(frozen=True)
class TailKernels:
    """Weights of a tail's cells. weights: on the device. taps: cells across. cell_px: photosites across one."""

    weights: Buffer
    taps: int
    cell_px: int


def gather_tail(
    device: Device,
    defines: Mapping[str, object],
    band: PsfBand,
    channels: int,
    kernels: TailKernels,
    light: tuple[Buffer, Buffer, Buffer],
    limits: Buffer,
) -> None:
    """Gather the tail of a band's light on its cells.

    defines: macros of the kernel that are the band's and the nodes'. light: samples of the band, cells and tail, of which the
    last two are written. limits: weights of the nodes, as of the kernel.
    """
    planes, cells, tail = light
    cell_px = kernels.cell_px
    rows, columns = band.rows // cell_px, 2 * band.layout.set_columns // cell_px
    span, margin = min(device.span, SPAN_CELLS), TAIL_MARGIN_PX // cell_px
    own = {**defines, "SPAN": span, "TAIL_TAPS": kernels.taps, "CELL": cell_px, "MARGIN": margin}
    size = columns // span, rows, channels
    device.run(device.kernel("psf_cells", own, file="psf_tail.cl"), size, (size[0], 1, 1), planes=planes, cells=cells)
    first = band.margin_rows // cell_px - 1
    size = ((columns - 2 * margin) // span, rows - 2 * first, channels)
    device.run(
        device.kernel("psf_tail", own, file="psf_tail.cl"),
        size,
        (size[0], 1, 1),
        cells=cells,
        tail=tail,
        kernels=kernels.weights,
        limits=limits,
        first_row=first,
        cell_rows=rows,
        cell_columns=columns,
    )
