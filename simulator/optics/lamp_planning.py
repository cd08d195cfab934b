"""Plans lamps out of focus: pixels of a fine scene that are drawn by themselves, and the blur of what is left.

Samples of a fine scene that do not divide its pixels mix them, and rectangles of the aperture have its moments, not its rim. Of
the light around it that is little, of a lamp far above the noise of the dark. Its image in closed form is exact.
"""

import math
from dataclasses import replace

import numpy as np

from simulator.optics.blur_planning import plan_accuracy, with_defocus
from simulator.optics.defocus.accuracy import LAMP_PEAK
from simulator.optics.defocus.lamp_images import drawn_spots
from simulator.optics.defocus.predicted_error import divides_squares
from simulator.optics.defocus.scene_light import brighter_pixels
from simulator.optics.lens.lens import Lens
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.psf.lamps import Lamps
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import NoiseFloor, SensorPlan

MOST_LAMPS, MOST_SHARE, FEW = 1024, 1 / 64, 8  # of them, and of the scene's pixels; that may be more in a scene of few
MOST_ROWS = 50_000  # of photosites in the images of all lamps
SEARCHED = 1 << 20  # pixels up to which the brightest light beside lamps is looked for; in larger scenes no quantile holds them


def with_drawn_lamps(planned: OpticsPlan, loaded: Scene, lens: Lens, sensor: SensorPlan, floor: NoiseFloor) -> OpticsPlan:
    """Return a plan with the blur of a scene, whose lamps are drawn by themselves where no other method is exact.

    planned: with its blur. loaded: the scene as it is loaded.
    """
    if not (_misses_lamps(planned) or _mixes_coarse_lamps(planned, lens, sensor.camera)):
        return planned
    lamps = _find_lamps(planned)
    if lamps is None:
        return planned
    rest = lamps.without(loaded, planned.weights)
    bare, tolerance = replace(planned, scene=rest, defocus=None), planned.accuracy.tolerance
    accuracy = plan_accuracy(bare, rest, lens, sensor, floor, tolerance, is_at_rest=True)
    accuracy = replace(accuracy, lamp_sharp_px=planned.accuracy.lamp_sharp_px)  # what is drawn is blurred
    blurred = with_defocus(replace(planned, scene=rest, accuracy=accuracy, defocus=None), rest, lens, sensor)
    if blurred.defocus is None:
        return planned
    return replace(blurred, scene=planned.scene, lamps=lamps)


def _misses_lamps(planned: OpticsPlan) -> bool:
    """Whether the blur of one even surface would mix the pixels of a fine scene behind a round aperture.

    It does where no samples divide them, or those that do are not taken, since all but the lamps is even.
    """
    defocus, accuracy = planned.defocus, planned.accuracy
    if defocus is None or not _has_one_image(planned) or not accuracy.tolerance or not planned.is_direct:
        return False
    return not accuracy.whole_pixels or not divides_squares(defocus.of_scene(), np.abs(np.array(defocus.radii_px)))


def _mixes_coarse_lamps(planned: OpticsPlan, lens: Lens, camera: Camera) -> bool:
    """Whether light between the pixels of a coarse scene would be that of whole photosites or parts, or met by few rays.

    No kernel comes after it then. A filter may: each of its spots has an image of its own.
    """
    is_ideal = lens.psf is None and not lens.has_diffraction and lens.aberrations is None
    is_open = camera.fill_factor == 1.0 or planned.accuracy.tolerance == 0.0
    return is_ideal and is_open and planned.projection.is_bilinear and _has_one_image(planned)


def _has_one_image(planned: OpticsPlan) -> bool:
    """Whether the blur of one surface is the same round circle everywhere."""
    defocus, projection = planned.defocus, planned.projection
    if defocus is None or len(defocus.radii_px) > 1 or planned.scene.coverage is not None or planned.scene.deep is not None:
        return False
    is_round = defocus.eyes is None and defocus.pupil.is_round
    return is_round and not projection.is_displaced and not defocus.maps


def _find_lamps(planned: OpticsPlan) -> Lamps | None:
    """Pixels that are LAMP_PEAK times as bright as the brightest light without them; None: there are none, or too many."""
    scene, weights, per_radiance = planned.scene, planned.weights, planned.accuracy.electrons_per_radiance
    assert planned.defocus is not None  # else nothing is blurred
    pixels = scene.planes.shape[0] * scene.planes.shape[1]
    if pixels > SEARCHED and not planned.accuracy.has_lamps:
        return None
    side = 2 * drawn_spots(planned.defocus, planned.projection).reach_px + 1
    most = math.ceil(min(MOST_LAMPS, max(MOST_SHARE * pixels, FEW), MOST_ROWS / side))
    brightest = planned.accuracy.brightest
    if pixels <= SEARCHED:
        light = (scene.planes.reshape(pixels, -1) @ weights).max(axis=1)
        brightest = min(float(np.partition(light, -most - 1)[-most - 1]), brightest) if pixels > most else brightest
    brightest = max(brightest, 1.0 / per_radiance)
    limits = np.full(planned.channels, LAMP_PEAK * brightest, np.float32)
    rows, columns, _ = brighter_pixels(scene.planes, weights, limits)
    if not 0 < len(rows) <= most:
        return None
    return Lamps(rows, columns, (brightest,) * planned.channels)
