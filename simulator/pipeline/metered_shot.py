"""The camera's choice of time, aperture and ISO: a shot whose exposure is metered becomes one with a manual exposure."""

import math
from dataclasses import asdict, dataclass, replace

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.exposure.dials import HAND_HELD_S, AutoIso, Body, Dials, ExposureSolver, Settings, Solution
from simulator.exposure.metering import Metering, MeterReading, read_meter
from simulator.exposure.settings import Exposure
from simulator.optics.geometry.projection import plan_projection
from simulator.optics.lens.bare_sensor import integrate_hemisphere
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.relative_illumination import plan_irradiance
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.scene_loading import load_seen
from simulator.pipeline.shot import Shot
from simulator.scene.compositing import flatten_layers
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.sensor_plan import plan_sensor
from simulator.sensor.stages.exposure import Integration

MOST_CELLS = 2**17  # that a meter has
SHORT_S = 1e-9  # time in which dark current is nothing
ROUNDS = 3  # more of metering at the aperture that was chosen, whose rims shade the corners differently


@dataclass(frozen=True)
class Metered:
    """How a metered shot is taken.

    exposure: manual. lens: with the f-number that was chosen. mode, compensation: as stated.
    metering: how the scene was metered. bound: bound of the metering that decided; None: none did.
    deviation_stops: how far the exposure is above the wanted one. limits: of the dials, which kept it away.
    """

    exposure: Exposure
    lens: Lens
    mode: str
    compensation: float
    metering: Metering
    bound: str | None
    deviation_stops: float
    limits: tuple[str, ...]

    def settle(self, shot: Shot) -> Shot:
        """Return the shot with the settings that were chosen."""
        return replace(shot, exposure=self.exposure, lens=self.lens)

    def describe(self) -> dict[str, object]:
        """Return plain data for the JSON beside the file."""
        found = self.deviation_stops
        return {
            "mode": self.mode,
            "compensation": self.compensation,
            "metering": asdict(self.metering) | {"bounds": [asdict(bound) for bound in self.metering.bounds]},
            "time_s": self.exposure.time_s,
            "f_number": self.lens.f_number if math.isfinite(self.lens.f_number) else None,
            "iso": self.exposure.iso,
            "deviation_stops": found if math.isfinite(found) else None,
            "bound": self.bound,
            "limits": list(self.limits),
        }


def meter_shot(shot: Shot) -> Metered | None:
    """Return how a shot is taken whose exposure is metered; None for one that is not.

    The meter sees what a sharp frame without noise would show on the whole active area of the sensor, whatever window is read:
    in green, or in the one colour, with the light falling off as behind this lens. It does not see blur, distortion, glare,
    dark current, motion and flicker. Raises PhotositeError where there is nothing to meter or choose from.
    """
    stated = shot.exposure
    if not stated.is_metered:
        return None
    scene, metering = load_seen(shot), stated.metering or Metering()
    lens = _adjustable(shot) if stated.mode in ("shutter_priority", "programme", "auto") else shot.lens
    body = _body_of(lens, shot.camera, stated.dials or Dials())
    reading = _read(scene, lens, shot.camera, metering)
    solution = _solve(stated, reading, lens, shot.camera, body)
    for _ in range(ROUNDS):
        f_number = solution.settings.f_number
        if f_number == lens.f_number or math.isnan(f_number):
            break
        lens = _at_f_number(lens, f_number)
        reading = _read(scene, lens, shot.camera, metering)
        solution = _solve(stated, reading, lens, shot.camera, body)
    chosen = solution.settings
    if math.isfinite(chosen.f_number) and chosen.f_number != lens.f_number:
        lens = _at_f_number(lens, chosen.f_number)
    by_hand = replace(stated, mode="manual", time_s=chosen.time_s, compensation=0.0, metering=None, auto_iso=None, dials=None)
    exposure = replace(by_hand, iso=chosen.iso)
    deviation, limits = solution.deviation_stops, solution.limits
    return Metered(exposure, lens, stated.mode, stated.compensation, metering, reading.bound, deviation, limits)


def _read(scene: Scene, lens: Lens, camera: Camera, metering: Metering) -> MeterReading:
    light = cell_light(scene, lens, camera)
    return read_meter(light[..., 1 if camera.channels > 1 else 0], light.max(axis=2), metering)


def _solve(stated: Exposure, reading: MeterReading, lens: Lens, camera: Camera, body: Body) -> Solution:
    """Return the settings for a reading."""
    auto_iso = AutoIso() if stated.mode == "auto" and stated.auto_iso is None else stated.auto_iso
    if auto_iso is not None:
        _check_highest(auto_iso, stated.iso, camera)
    wanted = reading.exposure * 2.0**stated.compensation
    start = Settings(stated.time_s, lens.f_number, stated.iso)
    return ExposureSolver(stated.mode, wanted, start, stated.dials or Dials(), auto_iso, body).solve()


def _check_highest(auto_iso: AutoIso, lowest: int, camera: Camera) -> None:
    """Raise PhotositeError for a highest ISO that the camera lacks, or that is below the lowest."""
    highest = auto_iso.highest
    if highest is None:
        return
    rule = f"is below exposure.iso = {lowest}, from which auto_iso rises; give a higher one"
    require(highest >= lowest, "exposure.auto_iso.highest", highest, rule)
    try:
        camera.iso_setting(highest)
    except PhotositeError as error:
        raise error.replace(key="exposure.auto_iso.highest") from None


def _adjustable(shot: Shot) -> ThinLens:
    """Return the shot's lens. Raises PhotositeError for one whose aperture cannot be chosen."""
    mode, lens = shot.exposure.mode, shot.lens
    rule = "chooses the aperture, but {}; write mode: aperture_priority, which chooses the time"
    if not isinstance(lens, ThinLens):
        raise PhotositeError(rule.format(f"{lens.model!r} has none to choose"), key="exposure.mode", value=mode)
    file = "lens.psf holds the light of one f-number"
    require(lens.psf is None, "exposure.mode", mode, rule.format(file))
    return lens


def _at_f_number(lens: Lens, f_number: float) -> Lens:
    """Return the lens at another f-number; its glass stays the same: transmittance and wavefront, but not the T-stop."""
    assert isinstance(lens, ThinLens)  # `_adjustable`
    wavefront = lens.aberrations
    if wavefront is not None and wavefront.at_f_number is None:
        wavefront = replace(wavefront, at_f_number=lens.f_number)
    share = lens.effective_transmittance
    return replace(lens, f_number=f_number, t_stop=None, transmittance=share, aberrations=wavefront)


def _body_of(lens: Lens, camera: Camera, dials: Dials) -> Body:
    """Return what the solver needs of lens and camera."""
    whites: dict[int, float] = {}

    def white_e(iso: int) -> float:
        if iso not in whites:
            whites[iso] = _white_electrons(camera, iso)
        return whites[iso]

    def has_iso(iso: int) -> bool:
        try:
            camera.iso_setting(iso)
        except PhotositeError:  # between the two sides of a conversion-gain switch nothing was measured
            return False
        return True

    widest = lens.f_number if dials.widest is None else dials.widest
    own_sr = lens.irradiance_per_radiance_sr()
    if isinstance(lens, ThinLens):
        # 1 / solid angle is linear in N^2 in both formulas of ThinLens.
        near, far = lens.f_number, 2.0 * lens.f_number
        inverse = 1.0 / own_sr
        slope = (1.0 / _at_f_number(lens, far).irradiance_per_radiance_sr() - inverse) / (far**2 - near**2)
        rest = inverse - slope * near**2

        def solid_angle_sr(f_number: float) -> float:
            return own_sr if f_number == near else 1.0 / (slope * f_number**2 + rest)

        def f_number_for(wanted_sr: float) -> float:
            return math.sqrt(max(1.0 / wanted_sr - rest, 0.0) / slope)

    else:

        def solid_angle_sr(f_number: float) -> float:
            return own_sr

        def f_number_for(wanted_sr: float) -> float:
            return lens.f_number

    equivalent_mm = lens.focal_length_35mm_mm(float(np.hypot(*camera.sensor_mm)))
    hand_held_s = 1.0 / equivalent_mm if equivalent_mm > 0 else HAND_HELD_S
    return Body(solid_angle_sr, white_e, f_number_for, camera.isos, has_iso, widest, hand_held_s)


def _white_electrons(camera: Camera, iso: int) -> float:
    """Return the electrons that reach the white level at an ISO without dark current [e-]."""
    sensor = plan_sensor(camera, (Integration(SHORT_S, 1.0),), iso, SHORT_S)
    rule = "gives no code to light, so that nothing can be metered; set exposure.mode: manual"
    require(sensor.gain_dn_per_e() > 0, "exposure.iso", iso, rule)
    return sensor.electrons_at_white()


def cell_light(scene: Scene, lens: Lens, camera: Camera) -> np.ndarray:
    """Return the light on the cells of the meter, (rows, columns, channels) float64.

    It is in electrons of a photosite per second and steradian of the lens [e- s^-1 sr^-1]: times the solid angle on the axis
    and the time it is the mean number of electrons. Cells are square blocks of photosites of the active area, at most
    MOST_CELLS; a lamp smaller than a cell counts with the cell's mean.
    """
    seen = flatten_layers(scene) if lens.forms_image else integrate_hemisphere(scene)
    weights = electron_radiance_weights(seen, camera.response.wavelengths_nm, camera.response.quantum_efficiency)
    require(weights.shape[1] == camera.channels, "camera.response", weights.shape[1], f"needs {camera.channels} curves")
    projection, active = plan_projection(seen, lens, camera), camera.active
    across_px, down_px = _cell_edges(active)
    is_box = projection.has_squares
    down = _pixel_shares(projection.offset_y + projection.scale * down_px, projection.scene_height, is_box)
    across = _pixel_shares(projection.offset_x + projection.scale * across_px, projection.scene_width, is_box)
    rows = np.stack([np.tensordot(share, seen.planes[first : first + len(share)], axes=1) for first, share in down])
    cells = np.stack([np.tensordot(share, rows[:, first : first + len(share)], axes=(0, 1)) for first, share in across], axis=1)
    x, y = 0.5 * (across_px[1:] + across_px[:-1]), 0.5 * (down_px[1:] + down_px[:-1])
    stage = plan_irradiance(lens, camera.pixel_pitch_um, camera.width_px, camera.height_px)
    radius_px = np.hypot(y[:, None] - stage.centre_y_px, x - stage.centre_x_px)
    fall_off = np.asarray(stage.relative_illumination(radius_px))
    return np.maximum(cells @ weights, 0.0) * (fall_off * camera.pixel_pitch_um**2 * camera.fill_factor)[..., None]


def _cell_edges(active: Window) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges of the cells across and down, from the sensor's upper left corner on [photosites]."""
    side = max(1, math.ceil(math.sqrt(active.width * active.height / MOST_CELLS)))
    columns, rows = max(1, round(active.width / side)), max(1, round(active.height / side))
    return np.linspace(active.x, active.x + active.width, columns + 1), np.linspace(
        active.y, active.y + active.height, rows + 1
    )


def _pixel_shares(edges_px: np.ndarray, size: int, is_box: bool) -> list[tuple[int, np.ndarray]]:
    """Return for each cell the first scene pixel that it takes, and the shares (pixels,) of the pixels from there on.

    edges_px: of the cells on the scene's axis [scene pixels]. is_box: pixels are even squares; else what lies between
    their centres is linear, and constant beyond the outermost.
    """
    found = []
    for start, end in zip(edges_px[:-1], edges_px[1:], strict=True):
        first, last = math.floor(start) - 1, math.ceil(end) + 1
        pixels = np.arange(first, last + 1)
        share = (_area(end - pixels, is_box) - _area(start - pixels, is_box)) / (end - start)
        inside = np.clip(pixels, 0, size - 1)
        low = int(inside[0])
        found.append((low, np.bincount(inside - low, share)))
    return found


def _area(to_px: np.ndarray, is_box: bool) -> np.ndarray:
    """Return the integral of a pixel's weight up to a place, counted from the pixel's near edge [scene pixels]."""
    if is_box:
        return np.clip(to_px, 0.0, 1.0)
    from_centre = np.clip(to_px - 0.5, -1.0, 1.0)
    return np.where(from_centre < 0, 0.5 * (from_centre + 1.0) ** 2, 1.0 - 0.5 * (1.0 - from_centre) ** 2)
