"""The quantities that a study can ask for, by their word in YAML."""

from simulator.measurement.quantities.clipped_share import ClippedShare
from simulator.measurement.quantities.patch import Patch

QUANTITIES: dict[str, type] = {
    "patch": Patch,
    "clipped_share": ClippedShare,
}
