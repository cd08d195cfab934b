"""The points of a study that deserve a look: failed ones, and for each figure the one that is worst."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from simulator.studies.report.study_data import DONE, Row, StudyFolder, is_number

# Figures of each quantity of which less (-1) or more (1) is worse; others, and those of one's own functions, have no worst.
WORSE = {
    "patch": {"snr": -1, "noise_dn": 1, "noise_e": 1},
    "clipped_share": {"white": 1, "black": 1},
    "dynamic_range": {"range_ev": -1},
    "photons_to_photos": {"range_ev": -1},
    "mtf": {"mtf50": -1, "mtf50_lw_ph": -1, "mtf50_cy_mm": -1, "rise_px": 1},
    "blur_length": {"length_px": 1, "residual": 1},
    "color_error": {"mean": 1, "largest": 1, "grey": 1},
}
RUN = {"seconds": "run time", "predicted_error_sigma": "predicted error"}


@dataclass(frozen=True)
class WorstPoint:
    """A point, and why it is named. column: of the value; None: a point without a value."""

    row: Row
    reason: str
    column: str | None = None


def worst_points(study: StudyFolder) -> list[WorstPoint]:
    """Return the points that are not done, then the worst point of each figure, then the slowest and the least exact."""
    found = [
        WorstPoint(row, f"{row['state']}: {row.get('error') or 'no message'}")
        for row in study.table.rows
        if row["state"] != DONE
    ]
    for column in study.columns_of("measured"):
        sign = worse_sign(str(study.table.columns[column].get("quantity") or ""), column)
        if sign and (row := _extreme(study.done(), column, sign)) is not None:
            found.append(WorstPoint(row, f"{'most' if sign > 0 else 'least'} {study.title(column)}", column))
    for column, name in RUN.items():
        if column in study.table.columns and (row := _extreme(study.done(), column, 1)) is not None:
            found.append(WorstPoint(row, f"most {name}", column))
    return found


def worse_sign(quantity: str, column: str) -> int:
    """Return 1 where a larger figure of a quantity is worse, -1 where a smaller one is, 0 where neither is."""
    return WORSE.get(quantity, {}).get(column.rpartition(".")[2], 0)


def _extreme(rows: Sequence[Row], column: str, sign: int) -> Row | None:
    """Return the row with the largest (sign 1) or smallest (-1) finite number; None where all are equal or none is finite."""
    known = [row for row in rows if is_number(row.get(column)) and math.isfinite(row[column])]
    if len({row[column] for row in known}) < 2:
        return None
    return max(known, key=lambda row: sign * row[column])
