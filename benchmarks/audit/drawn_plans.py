"""Random legal plans: each decision on the blur is taken for a tolerance of its own, at most that of the shot."""

from dataclasses import dataclass, fields, replace

import numpy as np

from simulator.device import Device
from simulator.optics.blur_planning import part_of_sensor
from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.scene_contrast import SceneContrast, scene_contrast
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.allotment import is_at_rest
from simulator.pipeline.planner import Plan, measure

STRICTEST = 0.02  # smallest tolerance of a decision, in that of the shot


@dataclass(frozen=True)
class DrawnAccuracy(Accuracy):
    """An accuracy whose decisions are those of smaller tolerances: shares of its own, by decision."""

    sharp_share: float = 1.0
    same_share: float = 1.0
    slope_share: float = 1.0
    points_share: float = 1.0
    slabs_share: float = 1.0
    samples_share: float = 1.0

    def _at(self, share: float) -> Accuracy:
        own = {one.name: getattr(self, one.name) for one in fields(Accuracy)}
        return Accuracy(**own | {"tolerance": share * self.tolerance})

    @property
    def sharp_px(self) -> float:
        """As of a smaller tolerance."""
        return self._at(self.sharp_share).sharp_px

    @property
    def same_px(self) -> float:
        """As of a smaller tolerance."""
        return self._at(self.same_share).same_px

    @property
    def slope_step(self) -> float:
        """As of a smaller tolerance."""
        return self._at(self.slope_share).slope_step

    @property
    def points_factor(self) -> float:
        """As of a smaller tolerance."""
        return self._at(self.points_share).points_factor

    @property
    def coarser(self) -> float:
        """As of a smaller tolerance."""
        return self._at(self.slabs_share).coarser

    def samples_per_axis(self, least_px: np.ndarray, largest_px: np.ndarray, scale: float) -> np.ndarray:
        """As of a smaller tolerance."""
        return self._at(self.samples_share).samples_per_axis(least_px, largest_px, scale)


def draw_plan(planned: Plan, rng: np.random.Generator, device: Device) -> Plan | None:
    """Return a random legal plan of a shot; None where nothing of its blur is decided by the tolerance.

    Half of the decisions are the planner's own, the others those of tolerances down to STRICTEST of the shot's.
    """
    optics = planned.optics
    if optics.defocus is None or optics.tolerance == 0.0:
        return None
    names = [one.name for one in fields(DrawnAccuracy) if one.name.endswith("_share")]
    drawn = {name: 1.0 if rng.random() < 0.5 else float(STRICTEST ** rng.random()) for name in names}
    if optics.motion is not None and optics.motion.method == "swept_first":
        drawn["samples_share"] = 1.0  # what is swept lies on samples of the motion's plan
    own = {one.name: getattr(optics.defocus.accuracy, one.name) for one in fields(Accuracy)}
    defocus = replace(optics.defocus, accuracy=DrawnAccuracy(**own, **drawn))
    contrast = replace(_measure_contrast(optics, defocus), edges=optics.contrast.edges, crossed=optics.contrast.crossed)
    return measure(replace(planned, optics=replace(optics, defocus=defocus, contrast=contrast)), device)


def _measure_contrast(optics: OpticsPlan, defocus: Defocus) -> SceneContrast:
    """Contrasts of the plan's scene behind the circles that these decisions blur."""
    loaded = replace(optics.scene, behind=()) if defocus.guessed else optics.scene
    per_share = optics.accuracy.electrons_per_radiance / optics.accuracy.electrons
    seen = part_of_sensor(optics)
    return scene_contrast(loaded, optics.weights, per_share, defocus.of_scene(), seen, is_at_rest=is_at_rest(optics))
