"""What every stage of the fused kernel has in common."""

from dataclasses import dataclass, fields, replace
from functools import cache
from typing import ClassVar, Self, get_type_hints


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


@dataclass(frozen=True)
class FromShot:
    """Annotation of a field that no file sets, because it follows from the shot; it needs a default.

    quantity: what is filled in: exposure_time_s, black_level_dn or full_scale_dn (white level less black level).
    """

    quantity: str


@dataclass(frozen=True)
class Stage:
    """One step of the fused sensor kernel.

    `stem` names the kernel header, the module and the test. Each field is handed to the kernel as the macro STEM_FIELD
    (upper case), a tuple as an array with its length as STEM_FIELD_COUNT. `moments` says what the stage does to mean and
    variance. `in_camera_stages`: whether a camera file switches the stage on under `stages:`; otherwise its numbers
    follow from the camera's other keys or from the lens and the shutter. `acts_on_light`: whether it stands before the
    photoelectrons. `neutral`: fields and values at which the stage does nothing, any one of them;
    the planner skips it then. Fields annotated with FromShot are filled in by `of_shot`.
    """

    stem: ClassVar[str]
    in_camera_stages: ClassVar[bool] = True
    acts_on_light: ClassVar[bool] = False
    neutral: ClassVar[dict[str, float]] = {}

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
        """Mean and variance behind this stage, given those before it."""
        raise NotImplementedError


@cache
def fields_from_shot(stage: type[Stage]) -> dict[str, str]:
    """Names of the fields that FromShot marks, each with its quantity."""
    hints = get_type_hints(stage, include_extras=True)
    marks = {name: getattr(hint, "__metadata__", ()) for name, hint in hints.items()}
    return {name: mark.quantity for name, parts in marks.items() for mark in parts if isinstance(mark, FromShot)}
