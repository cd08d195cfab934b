"""What every stage of the fused kernel has in common."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import ClassVar, Protocol, Self, get_type_hints

import numpy as np

NORMAL_REACH = 6.8  # standard deviations: no normal number of kernels/normal.h lies farther out
Limits = tuple[float, float]  # least and greatest value
Means = float | np.ndarray


@dataclass(frozen=True)
class Moments:
    """Mean and variances of a signal, carried along the chain ([e-] before the gain, [DN] after it): numbers, or arrays.

    variance: from frame to frame, of one photosite (temporal noise).
    fixed_variance: from photosite to photosite, of the mean over many frames (the body's fixed pattern).
    """

    mean: float
    variance: float
    fixed_variance: float = 0.0

    def scaled(self, factor: float) -> Self:
        """Return the moments of factor * signal."""
        return Moments(factor * self.mean, factor**2 * self.variance, factor**2 * self.fixed_variance)

    def plus(self, mean: float = 0.0, variance: float = 0.0, fixed_variance: float = 0.0) -> Self:
        """Return the moments after something independent is added."""
        return Moments(self.mean + mean, self.variance + variance, self.fixed_variance + fixed_variance)


class Region(Protocol):
    """Rectangle of photosites of the sensor [px], such as a Window."""

    @property
    def x(self) -> int:
        """Leftmost column."""

    @property
    def y(self) -> int:
        """Uppermost row."""

    @property
    def width(self) -> int:
        """Columns."""

    @property
    def height(self) -> int:
        """Rows."""


def _lets_all_through(before: Limits) -> Limits | None:
    return None


@dataclass(frozen=True)
class SignalStep:
    """What a stage, or a pass in which neighbours share a signal, does to mean and variance.

    name: stem of the stage, or name of the pass. moments, unclipped_moments, clip_limits: as those of a Stage;
    unclipped_moments None: the same as moments.
    """

    name: str
    moments: Callable[[Moments], Moments]
    unclipped_moments: Callable[[Moments], Moments] | None = None
    clip_limits: Callable[[Limits], Limits | None] = _lets_all_through

    def unclipped(self, signal: Moments) -> Moments:
        """Mean and variance behind the step, without its clipping."""
        return (self.unclipped_moments or self.moments)(signal)


@dataclass(frozen=True)
class FromShot:
    """Annotation of a field that no file sets, because it follows from the shot.

    A stage that a camera file switches on gives such a field a default.

    quantity: what is filled in: exposure_time_s, black_level_dn or full_scale_dn (white level less black level).
    """

    quantity: str


@dataclass(frozen=True)
class Stage:
    """One step of the fused sensor kernel, and all that the other code asks of it.

    Each field is handed to the kernel as the macro STEM_FIELD (upper case), a tuple as an array with its length as
    STEM_FIELD_COUNT. Fields annotated with FromShot are filled in by `of_shot`. `moments` says what the stage does to mean
    and variance; the other declarations have defaults, which hold for a stage that adds noise alone.

    stem: names the kernel header, the module and the test.
    in_camera_stages: whether a camera file switches the stage on under `stages:`; otherwise its numbers follow from the
        camera's other keys or from the lens and the shutter.
    acts_on_light: whether it stands before the photoelectrons.
    neutral: fields and values at which the stage does nothing, any one of them; the planner skips it then.
    changes_mean: whether the mean behind it is another than before it, apart from the body's fixed pattern. The truth then
        passes through it, too: kernels/truth.cl has its line.
    is_required: whether a sensor gives no codes without it.
    counts_means: whether it counts electrons of a given mean with the code that POISSON_MEANS chooses. The launch takes the
        range of these means from `mean_range` of all stages before it.
    is_linear: whether the mean behind it is a straight line over the mean before it, below the clipping.
    is_defect: whether it changes few photosites only; `moments` are those of the others.
    is_common_to_rows: whether it moves all photosites of a row alike.
    rows_are_independent: whether what it adds to one row tells nothing of the next.
    """

    stem: ClassVar[str]
    in_camera_stages: ClassVar[bool] = True
    acts_on_light: ClassVar[bool] = False
    neutral: ClassVar[dict[str, float]] = {}
    changes_mean: ClassVar[bool] = False
    is_required: ClassVar[bool] = False
    counts_means: ClassVar[bool] = False
    is_linear: ClassVar[bool] = True
    is_defect: ClassVar[bool] = False
    is_common_to_rows: ClassVar[bool] = False
    rows_are_independent: ClassVar[bool] = True

    @property
    def has_effect(self) -> bool:
        """Whether the stage does anything."""
        return all(getattr(self, name) != value for name, value in self.neutral.items())

    def kernel_values(self) -> dict[str, float | tuple[float, ...]]:
        """Numbers the kernel reads, by what follows the stem in the macro's name; a tuple is an array."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def kernel_switches(self) -> dict[str, int]:
        """Whole numbers that choose code, by what follows the stem in the macro's name."""
        return {}

    def of_shot(self, **quantities: float) -> Self:
        """Return the stage with its FromShot fields taken from quantities of the shot, by name."""
        return replace(self, **{name: quantities[quantity] for name, quantity in fields_from_shot(type(self)).items()})

    def moments(self, signal: Moments) -> Moments:
        """Mean and variance behind this stage, given those before it; of numbers, or of arrays before electrons are counted."""
        raise NotImplementedError

    def unclipped_moments(self, signal: Moments) -> Moments:
        """Mean and variance behind this stage without its clipping, of numbers or of arrays."""
        return self.moments(signal)

    def clip_limits(self, before: Limits) -> Limits | None:
        """Least and greatest signal that leaves this stage, or None where it lets all through.

        before: limits of the last stage before it that clips.
        """
        return None

    def signal_step(self) -> SignalStep:
        """Return what the stage does to mean and variance."""
        return SignalStep(self.stem, self.moments, self.unclipped_moments, self.clip_limits)

    def mean_range(self, low: Means, high: Means, region: Region) -> tuple[Means, Means]:
        """Least and greatest mean electrons behind this stage, given those before it, of all photosites of a region.

        Only a stage before electrons are counted is asked. What is returned may be wider than the true range, which costs
        speed, but not narrower, which cuts off counts. The default asks `moments` at both ends and goes NORMAL_REACH standard
        deviations beyond them. That holds for a stage whose mean rises or falls steadily with the mean before it, by the
        same law at every photosite, and whose noise, temporal or fixed, is a multiple of a normal number. A stage whose law
        depends on the place or turns round, or whose noise has longer tails, overrides it. Of an `is_defect` stage, whose
        `moments` leave the defects out, the default is 0 to infinity.
        low, high: numbers, or arrays of one shape, >= 0 [e-, or the light's unit where the stage acts on light].
        """
        if self.is_defect:
            return 0.0 * low, high + np.inf
        ends = [self.moments(Moments(mean, 0.0)) for mean in (low, high)]
        reaches = [NORMAL_REACH * np.sqrt(end.variance + end.fixed_variance) for end in ends]
        least = np.minimum(*(end.mean - reach for end, reach in zip(ends, reaches, strict=True)))
        greatest = np.maximum(*(end.mean + reach for end, reach in zip(ends, reaches, strict=True)))
        return np.maximum(least, 0.0), greatest

    @property
    def gain(self) -> float:
        """Factor by which a stage behind the photoelectrons multiplies the signal."""
        return 1.0

    @property
    def black_offsets_dn(self) -> tuple[float, ...] | None:
        """What the stage adds at the four places of the sensor's upper left 2x2 block, row by row [DN]; None: nothing."""
        return None


@cache
def fields_from_shot(stage: type[Stage]) -> dict[str, str]:
    """Names of the fields that FromShot marks, each with its quantity."""
    hints = get_type_hints(stage, include_extras=True)
    marks = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {name: mark.quantity for name, parts in marks.items() for mark in parts if isinstance(mark, FromShot)}
