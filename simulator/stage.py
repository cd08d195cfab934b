"""What every stage of the fused kernel has in common."""

from dataclasses import dataclass, fields
from typing import ClassVar


@dataclass(frozen=True)
class Moments:
    """Mean and variance of a signal, carried along the chain ([e-] before the gain, [DN] after it)."""

    mean: float
    variance: float


@dataclass(frozen=True)
class Stage:
    """One step of the fused sensor kernel.

    `stem` names the kernel header, the module and the test. Each field is handed to the kernel
    as the macro STEM_FIELD (upper case). `moments` says what the stage does to mean and variance.
    """

    stem: ClassVar[str]

    def kernel_parameters(self) -> dict[str, float]:
        """Numbers the kernel reads, by macro name."""
        return {f"{self.stem}_{field.name}".upper(): float(getattr(self, field.name)) for field in fields(self)}

    def moments(self, signal: Moments) -> Moments:
        """Mean and variance behind this stage, given those before it."""
        raise NotImplementedError
