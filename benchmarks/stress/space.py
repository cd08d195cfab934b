"""What a search varies: numbers, choices and pictures, each drawn by hypothesis and mutated by the hill climb."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

Value = float | int | str | np.ndarray
Inputs = dict[str, Value]
TINY, LARGEST = 1.4e-45, 3.0e38  # least denormal of float32, and a number whose double overflows


def around(value: float) -> list[float]:
    """Return a number of float32 and its two neighbours: a switch point and one ulp to either side."""
    middle = np.float32(value)
    return [float(np.nextafter(middle, np.float32(-np.inf))), float(middle), float(np.nextafter(middle, np.float32(np.inf)))]


@dataclass(frozen=True)
class Real:
    """Real numbers from low to high, even in the logarithm where `log` is set; `switches` and their neighbours come often."""

    low: float
    high: float
    log: bool = False
    switches: tuple[float, ...] = ()

    def _special(self) -> list[float]:
        near = [value for switch in self.switches for value in around(switch)]
        return [self.low, self.high, *(value for value in near if self.low <= value <= self.high)]

    def strategy(self) -> st.SearchStrategy[Value]:
        """Draw a number."""
        if self.log:
            plain = st.floats(math.log(self.low), math.log(self.high)).map(
                lambda power: min(max(math.exp(power), self.low), self.high)
            )
        else:
            plain = st.floats(self.low, self.high)
        return st.one_of(plain, st.sampled_from(self._special()))

    def mutate(self, value: Value, rng: np.random.Generator) -> Value:
        """Return another number: near, anywhere, or a special one."""
        assert isinstance(value, float | int)
        kind, span = rng.integers(4), rng.choice([1e-6, 1e-3, 0.1, 1.0])
        if kind == 0:
            return float(rng.choice(self._special()))
        if kind == 1 and self.log:
            changed = float(value) * math.exp(span * rng.standard_normal())
        elif kind == 1:
            changed = float(value) + span * (self.high - self.low) * rng.standard_normal()
        elif kind == 2:
            changed = float(np.nextafter(np.float32(value), np.float32(rng.choice([-np.inf, np.inf]))))
        elif self.log:
            changed = math.exp(rng.uniform(math.log(self.low), math.log(self.high)))
        else:
            changed = rng.uniform(self.low, self.high)
        return min(max(changed, self.low), self.high)


@dataclass(frozen=True)
class Whole:
    """Whole numbers from low to high."""

    low: int
    high: int

    def strategy(self) -> st.SearchStrategy[Value]:
        """Draw a number."""
        return st.integers(self.low, self.high)

    def mutate(self, value: Value, rng: np.random.Generator) -> Value:
        """Return a neighbour or any other."""
        near = int(value) + int(rng.choice([-1, 1])) if rng.random() < 0.5 and not isinstance(value, np.ndarray) else None
        return min(max(near, self.low), self.high) if near is not None else int(rng.integers(self.low, self.high + 1))


@dataclass(frozen=True)
class Choice:
    """One of several values."""

    values: tuple[float | int | str, ...]

    def strategy(self) -> st.SearchStrategy[Value]:
        """Draw a value."""
        return st.sampled_from(self.values)

    def mutate(self, value: Value, rng: np.random.Generator) -> Value:
        """Return any value."""
        return self.values[int(rng.integers(len(self.values)))]


PATTERNS = ("flat", "ramp", "noise", "alternating", "lights", "darks", "denormals", "edge")


def paint(pattern: str, seed: int, shape: tuple[int, ...], low: float, high: float) -> np.ndarray:
    """Return a picture, float32, whose values lie between low and high, low > 0, or are 0."""
    rng = np.random.default_rng(seed)
    count = math.prod(shape)
    powers = rng.uniform(math.log(low), math.log(high), count)
    values = {
        "flat": np.full(count, high),
        "ramp": np.exp(np.linspace(math.log(low), math.log(high), count)),
        "noise": np.exp(powers),
        "alternating": np.where(np.arange(count) % 2, high, low),
        "lights": np.where(rng.random(count) < 0.02, high, 0.0),
        "darks": np.where(rng.random(count) < 0.02, low, high),
        "denormals": rng.choice([0.0, TINY, 1.0e-40, 1.1754942e-38, 1.1754944e-38, low], count),
        "edge": np.where(np.arange(count) % shape[-1] < shape[-1] // 2, low, high),
    }[pattern]
    return values.reshape(shape).astype(np.float32)


@dataclass(frozen=True)
class Picture:
    """Pictures of a shape whose values are 0 or lie between least and most: patterns of extremes."""

    shape: tuple[int, ...]
    least: float = TINY
    most: float = LARGEST

    def strategy(self) -> st.SearchStrategy[Value]:
        """Draw a pattern with its own least and greatest value."""
        powers = st.floats(math.log(self.least), math.log(self.most))

        def picture(pattern: str, seed: int, one: float, other: float) -> np.ndarray:
            low, high = (min(max(math.exp(power), self.least), self.most) for power in sorted((one, other)))
            return np.minimum(paint(pattern, seed, self.shape, low, high), np.float32(self.most))

        return st.builds(picture, st.sampled_from(PATTERNS), st.integers(0, 2**16), powers, powers)

    def mutate(self, value: Value, rng: np.random.Generator) -> Value:
        """Change a few pixels: to another size, by an ulp, to an extreme, or to a neighbour's value."""
        assert isinstance(value, np.ndarray)
        changed = value.copy().ravel()
        places = rng.integers(changed.size, size=int(rng.choice([1, 2, 8, changed.size])))
        kind = rng.integers(5)
        if kind == 0:
            changed[places] = np.exp(rng.uniform(math.log(self.least), math.log(self.most), places.size))
        elif kind == 1:
            changed[places] = np.nextafter(changed[places], np.float32(rng.choice([0.0, np.inf])))
        elif kind == 2:
            changed[places] = rng.choice([0.0, self.least, self.most, changed.max(), changed.min()], places.size)
        elif kind == 3:
            changed[places] = np.roll(changed, 1)[places]
        else:
            changed = changed.astype(np.float64)
            changed[places] *= np.exp(0.1 * rng.standard_normal(places.size))
        return np.clip(changed, 0.0, self.most).astype(np.float32).reshape(value.shape)


Domain = Real | Whole | Choice | Picture


def inputs_strategy(space: Mapping[str, Domain]) -> st.SearchStrategy[Inputs]:
    """Draw inputs of a space."""
    return st.fixed_dictionaries({name: domain.strategy() for name, domain in space.items()})


def mutated(space: Mapping[str, Domain], inputs: Inputs, rng: np.random.Generator) -> Inputs:
    """Return inputs of which one to three differ."""
    names = rng.choice(list(space), size=min(len(space), int(rng.integers(1, 4))), replace=False)
    return inputs | {str(name): space[str(name)].mutate(inputs[str(name)], rng) for name in names}
