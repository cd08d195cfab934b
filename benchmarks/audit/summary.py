"""Statistics over the records of an audit: whether the promise is kept, how tight it is, and how well costs are ranked."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from audit.measured_shot import Record

ASKED_COVERAGE, ASKED_TIGHTNESS, ASKED_RANKED, ASKED_FACTOR = 0.99, 0.1, 0.9, 1.5
MOST_UNJUDGED = 0.05  # share of shots whose truth may be too unsure to judge them
ZERO = 1e-6  # error below which a prediction says nothing: rounding of single precision
ROUNDINGS = 10.0 * 2.0**-24  # of single precision, in a sum of light: two methods differ by as much of it


@dataclass(frozen=True)
class Summary:
    """What an audit found.

    shots: judged records. unjudged: records whose truth is not exact enough (`Record.is_judged`). refused: shots that have no
    record. broken: judged ones whose error exceeds what is allowed. coverage: share of the others. random: judged records with
    a random plan. random_broken: those whose random plan exceeds what is allowed.
    tightness: median of error over predicted error, where anything is predicted. ranked: share of pairs of shots whose
    predicted times are in the order of the measured ones. factor: median factor between measured and predicted time, 1 or more.
    looser: records whose error is larger at the tighter tolerance.
    """

    shots: int
    unjudged: tuple[Record, ...]
    refused: int
    broken: tuple[Record, ...]
    coverage: float
    random: int
    random_broken: tuple[Record, ...]
    tightness: float
    ranked: float
    factor: float
    looser: tuple[Record, ...]


def summarise(records: Sequence[Record], refused: int = 0) -> Summary:
    """Return the statistics of records of which at least one is judged, and of shots without record.

    Costs are those of all records.
    """
    judged = [one for one in records if one.is_judged]
    broken = tuple(sorted((one for one in judged if one.excess > 1.0), key=lambda one: -one.excess))
    random = [one for one in judged if one.random_p99_9 is not None]
    return Summary(
        len(judged),
        tuple(one for one in records if not one.is_judged),
        refused,
        broken,
        1.0 - len(broken) / len(judged),
        len(random),
        tuple(one for one in random if one.random_excess > 1.0),
        tightness(judged),
        ranked_share([one.cost_ms for one in records], [one.cpu_ms for one in records]),
        median_factor([one.cost_ms for one in records], [one.cpu_ms for one in records]),
        tuple(one for one in judged if is_looser(one)),
    )


def tightness(records: Iterable[Record]) -> float:
    """Median of error over predicted error; NaN where nothing is predicted."""
    ratios = [one.p99_9 / one.predicted for one in records if one.predicted > ZERO]
    return float(np.median(ratios)) if ratios else math.nan


def is_looser(record: Record) -> bool:
    """Whether the tighter tolerance has the larger error, beyond what the truth may be off by, and roundings of its light.

    What the scene does not hold, the reference path assumes, too: no method is nearer to it than what the plan states of that.
    """
    rounded = ROUNDINGS * math.sqrt(max(record.electrons, 1.0))
    return record.tighter_p99_9 > max(record.p99_9 + 3.3 * record.truth_sigma + rounded, record.input_sigma)


def ranked_share(predicted: Sequence[float], measured: Sequence[float]) -> float:
    """Share of pairs in the same order in both; pairs that are equal in either count half. NaN of fewer than two."""
    signs = [
        np.sign(predicted[b] - predicted[a]) * np.sign(measured[b] - measured[a])
        for a, b in itertools.combinations(range(len(predicted)), 2)
    ]
    return float(np.mean([0.5 * (1.0 + sign) for sign in signs])) if signs else math.nan


def median_factor(predicted: Sequence[float], measured: Sequence[float]) -> float:
    """Median of the factor between measured and predicted, whichever is larger over the other."""
    return float(np.exp(np.median(np.abs(np.log(measured) - np.log(predicted)))))


def verdicts(found: Summary) -> list[dict]:
    """What is asked beside what was found, as other benchmarks report it."""

    def judge(what: str, figure: str, asked: str, reached: bool) -> dict:
        return {"what": what, "figure": figure, "asked": asked, "reached": bool(reached)}

    coverage, least = f"{100 * found.coverage:.1f} %", f"{100 * ASKED_COVERAGE:g} %"
    tight, ranked, worse = f"{found.tightness:.2g}", f"{100 * found.ranked:.0f} %", len(found.looser)
    missing = len(found.unjudged) + found.refused
    unjudged = missing / (found.shots + missing)
    random = 1.0 - len(found.random_broken) / max(found.random, 1)
    return [
        judge("shots that keep the promise", coverage, least, found.coverage >= ASKED_COVERAGE),
        judge("random plans that keep it", f"{100 * random:.1f} % of {found.random}", least, random >= ASKED_COVERAGE),
        judge("shots that are not judged", f"{100 * unjudged:.1f} %", f"{100 * MOST_UNJUDGED:g} %", unjudged <= MOST_UNJUDGED),
        judge("median of error / prediction", tight, f"{ASKED_TIGHTNESS:g}", found.tightness >= ASKED_TIGHTNESS),
        judge("pairs ranked by cost", ranked, f"{100 * ASKED_RANKED:g} %", found.ranked >= ASKED_RANKED),
        judge("median factor of cost", f"{found.factor:.2f}", f"{ASKED_FACTOR:g}", found.factor <= ASKED_FACTOR),
        judge("shots worse at a tighter tolerance", str(worse), "0", worse == 0),
    ]
