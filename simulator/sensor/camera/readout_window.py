"""The areas of the sensor that are computed, read and given out, given crosstalk, binning and optical black."""

import itertools
import math
from dataclasses import dataclass, replace

import numpy as np

from simulator.errors import require
from simulator.sensor.camera.binning import Binning
from simulator.sensor.camera.blooming import Blooming
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.camera.crosstalk import Crosstalk
from simulator.sensor.stages.stage import Moments


@dataclass(frozen=True)
class ReadoutGeometry:
    """Areas of the sensor that the passes work on.

    output: readout window that the camera gives out, before binning.
    computed: that window and a margin of photosites that affect it by crosstalk.
    active: active area of the sensor, which light reaches.
    filter_step: distance of photosites of one colour that are binned [px]: 2 of a Bayer pattern, 1 of groups and without a
        filter.
    blooming: where charge above the full well goes; None: it is drained.
    pattern: of groups of one colour, which a remosaic turns into a Bayer pattern; None: there is none.
    """

    output: Window
    computed: Window
    active: Window
    filter_step: int
    crosstalk: Crosstalk
    binning: Binning | None
    pattern: Cfa | None = None
    blooming: Blooming | None = None

    @property
    def adds_charge(self) -> bool:
        """Whether the charge of binned photosites is summed before readout."""
        return self.binning is not None and self.binning.mode == "charge"

    @property
    def summed(self) -> int:
        """Number of photosites whose charge a pixel of the frame holds."""
        return self.binning.count if self.binning is not None and self.adds_charge else 1

    @property
    def averages(self) -> bool:
        """Whether the codes of binned photosites are averaged."""
        return self.binning is not None and self.binning.mode == "average"

    @property
    def shares_charge(self) -> bool:
        """Whether photosites exchange or sum charge, so that the fused kernel runs in two parts."""
        return self.adds_charge or self.blooming is not None or self.mixes_charge

    @property
    def charge_reach_px(self) -> tuple[int, int]:
        """Photosites that charge may move on, in a row and in a column: one by electrical crosstalk, the rest by blooming."""
        beside, above = (0, 0) if self.blooming is None else self.blooming.reach_px
        return beside + 1, above + 1

    def shared_moments(self, charge: Moments) -> Moments:
        """Return the moments after electrical crosstalk between equally illuminated photosites, and what binned ones share."""
        mixed = self.crosstalk.of_charge(charge)
        if self.binning is None:
            return mixed
        shared = self.crosstalk.correlation(self.binning.factor, self.filter_step) - 1.0
        return mixed.plus(shared_variance=shared * mixed.variance)

    @property
    def mixes_charge(self) -> bool:
        """Whether electrical crosstalk mixes the charges of neighbours."""
        return any(self.crosstalk.electrical_shares)

    @property
    def is_plain(self) -> bool:
        """Whether a photosite's code is given out as it is read, without its neighbours."""
        return not self.shares_charge and not self.averages and self.pattern is None

    @property
    def of_photosites(self) -> "ReadoutGeometry":
        """The same area without remosaic, given out with its margin."""
        return replace(self, output=self.computed, pattern=None)

    @property
    def reaches_optical_black(self) -> bool:
        """Whether some of the computed photosites lie outside the active area."""
        frame, active = self.computed, self.active
        begins = active.x <= frame.x and active.y <= frame.y
        ends = frame.x + frame.width <= active.x + active.width and frame.y + frame.height <= active.y + active.height
        return not (begins and ends)

    @property
    def binned(self) -> Window:
        """The computed area after binning."""
        if self.binning is None:
            return self.computed
        factor = self.binning.factor
        width, height = (self._binned_side(side) for side in (self.computed.width, self.computed.height))
        return Window(self.computed.x // factor, self.computed.y // factor, width, height)

    def binned_places(self) -> tuple[np.ndarray, np.ndarray]:
        """Return row and column of the binned frame that each computed row and column belongs to; the last one beyond it."""
        factor, step, frame = 1 if self.binning is None else self.binning.factor, self.filter_step, self.binned
        rows, columns = np.arange(self.computed.height), np.arange(self.computed.width)
        down, across = (side // (factor * step) * step + side % step for side in (rows, columns))
        return np.minimum(down, frame.height - 1), np.minimum(across, frame.width - 1)

    @property
    def read(self) -> Window:
        """Area that the readout part of the fused kernel computes."""
        return self.binned if self.adds_charge else self.computed

    @property
    def kept(self) -> tuple[slice, slice]:
        """Rows and columns of the binned frame that the camera gives out."""
        rows = self._binned_slice(self.output.y - self.computed.y, self.output.height)
        return rows, self._binned_slice(self.output.x - self.computed.x, self.output.width)

    @property
    def rows(self) -> int:
        """Rows of the frame that the camera gives out [px]."""
        return self._binned_side(self.output.height)

    @property
    def active_area(self) -> tuple[int, int, int, int] | None:
        """Top, left, bottom and right of the active area in the output frame [px]; None: the whole frame is active."""
        output, active = self.output, self.active
        top, left = max(active.y - output.y, 0), max(active.x - output.x, 0)
        bottom = min(active.y + active.height - output.y, output.height)
        right = min(active.x + active.width - output.x, output.width)
        area = (top, left, bottom, right)
        return None if area == (0, 0, output.height, output.width) else area

    def _binned_slice(self, first: int, side: int) -> slice:
        """Range, after binning, of `side` photosites from photosite `first` on."""
        begin = first if self.binning is None else first // self.binning.factor
        return slice(begin, begin + self._binned_side(side))

    def _binned_side(self, side: int) -> int:
        """Length, after binning, of so many photosites in a row or column."""
        if self.binning is None:
            return side
        return side // (self.binning.factor * self.filter_step) * self.filter_step


def plan_readout(camera: Camera) -> ReadoutGeometry:
    """Return the ReadoutGeometry of a camera's frame. Raises PhotositeError for a window that cuts through binned blocks."""
    output, block = camera.frame, block_px(camera)
    for key, first, side in (("x", output.x, output.width), ("y", output.y, output.height)):
        rule = f"give a multiple of {block}: blocks of that many photosites are binned"
        require(first % block == 0, f"camera.window.{key}", first, rule)
        require(side >= block, f"camera.window.{'width' if key == 'x' else 'height'}", side, rule)
    _check_active_area(camera)
    return _readout_of(camera, output)


def split_readout(camera: Camera, most_px: int, step_px: int) -> list[ReadoutGeometry]:
    """Split the ReadoutGeometry of a camera's frame into strips of whole rows, from top to bottom; a small frame is one.

    most_px: photosites of a strip, at most, unless step_px rows hold more.
    step_px: strips end at multiples of it on the sensor, and at whole binned blocks.
    """
    frame = camera.frame
    if frame.width * frame.height <= most_px:
        return [_readout_of(camera, frame)]
    step_px = math.lcm(step_px, block_px(camera))
    rows = max(most_px // (frame.width * step_px), 1) * step_px
    bottom = frame.y + frame.height
    edges = [frame.y, *range((frame.y // step_px + 1) * step_px + rows - step_px, bottom, rows), bottom]
    # Rows at the end that do not fill a binned block are not given out, so a strip must not consist of them.
    if len(edges) > 2 and edges[-1] - edges[-2] < block_px(camera):
        del edges[-2]
    return [_readout_of(camera, Window(frame.x, first, frame.width, last - first)) for first, last in itertools.pairwise(edges)]


def block_px(camera: Camera) -> int:
    """Return the side of the blocks of photosites that are binned, of all colours [px]; 1 without binning."""
    return 1 if camera.binning is None else camera.binning.factor * _filter_step(camera)


def _filter_step(camera: Camera) -> int:
    """Return the distance of photosites of one colour that are binned [px]."""
    return 1 if camera.cfa == "MONO" or camera.filter.group > 1 else 2


def _readout_of(camera: Camera, output: Window) -> ReadoutGeometry:
    """Return the ReadoutGeometry of a window of whole binned blocks."""
    crosstalk, block = camera.crosstalk or Crosstalk(), block_px(camera)
    reach = sum(any(pair) for pair in (crosstalk.optical_shares, crosstalk.electrical_shares))
    pattern = None if camera.remosaic is None else camera.filter
    reach += 0 if pattern is None else pattern.group
    blooming = (0, 0) if camera.blooming is None else camera.blooming.reach_px
    beside, above = (-(-(reach + more) // block) * block for more in blooming)
    left, top = min(beside, output.x), min(above, output.y)
    right = min(beside, camera.width_px - output.x - output.width)
    bottom = min(above, camera.height_px - output.y - output.height)
    computed = Window(output.x - left, output.y - top, left + output.width + right, top + output.height + bottom)
    return ReadoutGeometry(
        output, computed, camera.active, _filter_step(camera), crosstalk, camera.binning, pattern, camera.blooming
    )


def _check_active_area(camera: Camera) -> None:
    """Raise PhotositeError for a window without active area, or that cuts a filter pattern in the optical black."""
    output, active = camera.frame, camera.active
    rows, columns = camera.filter.period
    sides = (
        ("x", output.x, output.width, active.x, active.width, columns),
        ("y", output.y, output.height, active.y, active.height, rows),
    )
    for key, first, size, active_first, active_size, period in sides:
        seen = first < active_first + active_size and active_first < first + size
        require(seen, f"camera.window.{key}", first, "the window lies in the optical black; choose one that sees light")
        whole = first >= active_first or first % period == 0
        number = "an even number" if period == 2 else f"a multiple of {period}"
        require(whole, f"camera.window.{key}", first, f"give {number}: part of the window is optical black")
