"""One step of a plan, as `explain` prints it and the JSON beside a raw file holds it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """One effect on the light or the signal. kept: whether it is simulated. why: its numbers, or the reason to skip it."""

    stage: str
    kept: bool
    why: str
