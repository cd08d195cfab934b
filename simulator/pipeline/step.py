"""A line of a plan for people."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Step:
    """What happens to the light or the signal in one place. kept: whether it does. why: with which numbers, or why not."""

    stage: str
    kept: bool
    why: str
