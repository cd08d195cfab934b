"""Plans how points of aperture and time read layers between their rows: at the nearest of some places.

The lens spreads the points over a circle, so that what each errs has any sign: it is that of a place that is off by up to half
of the way between places, evenly.
"""

import math

import numpy as np

PHASES = 16  # places between two rows, a power of two
STEEPEST = 1.0 / 3.0  # root mean square slope of random pixels from dark to bright, read between four [of the light per px]
TAIL = 3.29  # standard deviations that 99.9 % of normal numbers stay below
MOST_SHARE = 0.5  # of the allowed error up to which points read so


def rounded_rows(places_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the row and the phase of PHASES behind it that lie nearest to places down a layer [px], int32."""
    numbers = np.rint(PHASES * places_px).astype(np.int32)
    return numbers >> (PHASES.bit_length() - 1), numbers & (PHASES - 1)


def rows_error(points: int, radius_px: float) -> float:
    """Error of reading at the nearest place, for detail between zero and the brightest light, as its share.

    Of so many points that see a layer through a circle of this radius, at any instant. Places are off by the deviation
    1 / (sqrt(12) PHASES), which is divided by the root of the number of points. Their mean is off by the wave of the circle's
    profile whose period is the way between places, 1 / PHASES: 2 J1(a) / a of its amplitude, a = 2 pi radius PHASES.
    """
    a = 2.0 * math.pi * radius_px * PHASES
    even = min(2.0 * math.sqrt(2.0 / math.pi) * a**-1.5, 1.0) / (math.pi * PHASES) if a else 1.0 / (2.0 * PHASES)
    return TAIL * STEEPEST * math.hypot(1.0 / (math.sqrt(12.0) * PHASES * math.sqrt(points)), even)
