"""The interface of the stages of the fused kernel, and the mean and variances that they pass on."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import Any, ClassVar, Protocol, Self, get_type_hints

import numpy as np

NORMAL_REACH = 6.8  # standard deviations: no normal number of kernels/normal.h lies farther out
Limits = tuple[float, float]  # least and greatest value
Means = float | np.ndarray
Value = Any  # a float, or an array of floats; no annotation says that all fields are of the same of these two kinds


@dataclass(frozen=True)
class Moments:
    """Mean and variances of a signal ([e-] before the gain, [DN] after it): floats, or arrays of one shape.

    mean: of the signal over frames and photosites.
    variance: of one photosite from frame to frame (temporal noise).
    fixed_variance: from photosite to photosite, of the mean over many frames (fixed-pattern noise of the body).
    shared_variance: of noise that the `count` photosites share which a camera bins: their mean has the temporal variance
        (variance + shared_variance) / count; 0 where they are independent, or nothing is binned.
    """

    mean: Value
    variance: Value
    fixed_variance: Value = 0.0
    shared_variance: Value = 0.0

    def scaled(self, factor: float) -> "Moments":
        """Return the moments of factor * signal."""
        return self.widened(factor**2, factor * self.mean)

    def widened(self, share: Value, mean: Value) -> "Moments":
        """Return moments with this mean whose variances are `share` times these."""
        return Moments(mean, share * self.variance, share * self.fixed_variance, share * self.shared_variance)

    def plus(
        self, mean: Value = 0.0, variance: Value = 0.0, fixed_variance: Value = 0.0, shared_variance: Value = 0.0
    ) -> "Moments":
        """Return the moments of the signal plus an independent term that has these moments."""
        return Moments(
            self.mean + mean,
            self.variance + variance,
            self.fixed_variance + fixed_variance,
            self.shared_variance + shared_variance,
        )


class Region(Protocol):
    """Rectangle of photosites of the sensor [px], such as a Window."""

    @property
    def x(self) -> int:
        """Leftmost column."""
        ...

    @property
    def y(self) -> int:
        """Uppermost row."""
        ...

    @property
    def width(self) -> int:
        """Number of columns."""
        ...

    @property
    def height(self) -> int:
        """Number of rows."""
        ...


def _do_not_clip(before: Limits) -> Limits | None:
    """Clipping limits of a step that does not clip: none."""
    return None


@dataclass(frozen=True)
class SignalStep:
    """Effect on mean and variance of a stage, or of a pass between photosites such as crosstalk or binning.

    name: stem of the stage, or name of the pass. moments, unclipped_moments, clip_limits: as those of a Stage;
    unclipped_moments None: the same as moments.
    """

    name: str
    moments: Callable[[Moments], Moments]
    unclipped_moments: Callable[[Moments], Moments] | None = None
    clip_limits: Callable[[Limits], Limits | None] = _do_not_clip

    def unclipped(self, signal: Moments) -> Moments:
        """Return mean and variance after the step, without its clipping."""
        return (self.unclipped_moments or self.moments)(signal)


@dataclass(frozen=True)
class FromShot:
    """Annotation of a field whose value follows from the shot and is therefore not set in a file.

    In a stage that a camera file switches on, such a field needs a default.

    quantity: name of the value that is filled in: exposure_time_s, black_level_dn or full_scale_dn (white level minus black
        level).
    """

    quantity: str


@dataclass(frozen=True)
class Photodiode:
    """One of several photodiodes of a photosite, in numbers relative to those of the first.

    light: electrons that it collects in the same light. full_well: electrons that it holds. dark_current: its dark electrons.
    """

    light: float = 1.0
    full_well: float = 1.0
    dark_current: float = 1.0


@dataclass(frozen=True)
class Stage:
    """One step of the fused sensor kernel: its parameters, and the properties by which all other code knows it.

    The kernel reads each field as the macro STEM_FIELD (upper case), and a tuple as an array whose length is
    STEM_FIELD_COUNT. `of_shot` fills in the fields annotated with FromShot. `moments` gives the effect of the stage on mean
    and variance. The class variables have defaults that are right for a stage that only adds noise of mean 0.

    stem: name shared by the kernel header, the Python module, the test and the random stream.
    in_camera_stages: whether a camera file switches the stage on under `stages:`; otherwise its parameters follow from the
        camera's other keys, or from the lens and the shutter.
    acts_on_light: whether it comes before the conversion of light to photoelectrons.
    neutral: value of a field at which the stage has no effect, by field; one such value suffices for the planner to skip it.
    changes_mean: whether it changes the mean signal, apart from the body's fixed pattern. kernels/truth.cl then applies it to
        the noise-free signal, too.
    is_required: whether a sensor cannot give codes without it.
    counts_means: whether it draws Poisson numbers with the code that POISSON_VARIANT chooses. The launch gets the range of
        their means from `mean_range` of all stages before it.
    is_linear: whether the mean after it is a linear function of the mean before it, below the clipping.
    is_defect: whether it changes a few defective photosites only; `moments` are those of the others.
    is_common_to_rows: whether it adds the same value to all photosites of a row.
    rows_are_independent: whether the values that it adds to different rows are independent.
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
        """Whether the stage changes the signal at all."""
        return all(getattr(self, name) != value for name, value in self.neutral.items())

    def kernel_values(self) -> Mapping[str, float | tuple[float, ...]]:
        """Return the parameters that the kernel reads, by the part of the macro's name after the stem; a tuple is an array."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    def kernel_switches(self) -> dict[str, int]:
        """Return the integers that choose code when the kernel is compiled, by the part of the macro's name after the stem."""
        return {}

    def combined(self, side: int, codes: float) -> "Stage | None":
        """Return the stage of photosites that stand for side x side of this body's each; None where nothing of it is left.

        Such a photosite holds the sum of their electrons, and its code is `codes` times the mean of theirs. The default suits a
        stage whose parameters are ratios or temperatures.
        """
        return self

    def of_photodiode(self, diode: Photodiode) -> Self:
        """Return the stage of another photodiode of the photosites. The default suits a stage that is common to all."""
        return self

    def of_shot(self, **quantities: float) -> Self:
        """Return the stage with its FromShot fields set to the quantities of the shot that they name."""
        marked = fields_from_shot(type(self))  # type: ignore[arg-type]  # mypy does not know that a class can be hashed
        return replace(self, **{name: quantities[quantity] for name, quantity in marked.items()})

    def moments(self, signal: Moments) -> Moments:
        """Return mean and variance after this stage, given those before it; before the shot noise they may be arrays."""
        raise NotImplementedError

    def unclipped_moments(self, signal: Moments) -> Moments:
        """Return mean and variance after this stage without its clipping, of floats or of arrays."""
        return self.moments(signal)

    def clip_limits(self, before: Limits) -> Limits | None:
        """Return the least and the greatest signal after this stage, or None where it does not clip.

        before: clipping limits of the last stage before it that clips.
        """
        return None

    def signal_step(self) -> SignalStep:
        """Return the effect of the stage on mean and variance."""
        return SignalStep(self.stem, self.moments, self.unclipped_moments, self.clip_limits)

    def mean_range(self, low: Means, high: Means, region: Region) -> tuple[Means, Means]:
        """Return the least and the greatest mean electrons after this stage of all photosites of a region.

        It is called only for stages before the shot noise. A range wider than the true one costs speed; a narrower one gives
        wrong counts. The default extends `moments` at both ends by NORMAL_REACH standard deviations. This is right for a stage
        whose mean is a monotonic function of the mean before it, the same at every photosite, and whose noise, temporal or
        fixed, is a multiple of a normal number. A stage that depends on the position, is not monotonic or has noise with
        longer tails overrides it. For an `is_defect` stage, whose `moments` omit the defects, the default is 0 to infinity.
        low, high: range before the stage: floats, or arrays of one shape, >= 0 [e-, or the light's unit where the stage acts
            on light].
        """
        if self.is_defect:
            return 0.0 * low, high + np.inf
        ends = [self.moments(Moments(mean, 0.0)) for mean in (low, high)]
        reaches = [NORMAL_REACH * np.sqrt(end.variance + end.fixed_variance) for end in ends]
        least = np.minimum(*(end.mean - reach for end, reach in zip(ends, reaches, strict=True)))
        greatest = np.maximum(*(end.mean + reach for end, reach in zip(ends, reaches, strict=True)))
        return np.maximum(least, 0.0), greatest

    def row_correlation(self, rows: Value) -> Value:
        """Return the correlation of what an `is_common_to_rows` stage adds to two rows, so many rows apart.

        The default suits a stage whose `rows_are_independent`.
        """
        return np.where(np.equal(rows, 0), 1.0, 0.0)

    @property
    def gain(self) -> float:
        """Factor by which a stage after the photoelectrons multiplies the signal."""
        return 1.0

    @property
    def black_offsets_dn(self) -> tuple[float, ...] | None:
        """Offsets [DN] that the stage adds in the sensor's upper left 2x2 block, row by row; None: it adds none."""
        return None


@cache
def fields_from_shot(stage: type[Stage]) -> dict[str, str]:
    """Return the fields of a stage that FromShot marks, each with the name of its quantity."""
    hints = get_type_hints(stage, include_extras=True)
    marks = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {name: mark.quantity for name, parts in marks.items() for mark in parts if isinstance(mark, FromShot)}
