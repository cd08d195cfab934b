"""Frames of a camera that moves: a clean picture through the same projection as shots, with flow, poses and sharp twins."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from data_gen.recipe.moving_camera import MovingCamera
from simulator.color.reproducible import nine_digits
from simulator.device import Device
from simulator.exposure.motion import Motion
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.optics.geometry.surface_flow import SurfaceFlow
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera, IsoSetting, SpectralResponse, Window
from simulator.sensor.camera.cfa import CfaName
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

TOLERANCE = 0.1  # error of a moving picture, in standard deviations of the noise
INSTANT_S = 1e-9  # exposure time of a sharp twin, in which nothing moves
PITCH_UM, HALF_CODES = 4.0, 30000.0  # any: side of a photosite; code of a signal of 1, about half of 16 bits
# Three colours that see a third of the spectrum each and are blind between, so that each plane reaches one colour alone.
WAVELENGTHS_NM = np.arange(400.0, 701.0, 10.0)
RESPONSE = SpectralResponse(
    WAVELENGTHS_NM,
    np.stack([WAVELENGTHS_NM > 600, (WAVELENGTHS_NM > 500) & (WAVELENGTHS_NM < 600), WAVELENGTHS_NM < 500], axis=-1) * 1.0,
)
# Grid on which flow is computed. Between, it is linear: a turn by 2 deg bends it by 10^-4 px within 8 px, and a hand of
# 1000 px/s^2 by 10^-4 px within 1 ms.
FLOW_STEP_PX, FLOW_STEP_S = 8, 1e-3
FLOW_DIGITS = 12  # binary places of flow, so that the last bits of a processor's sines do not show


@dataclass(frozen=True)
class Light:
    """Light of a frame and the noise that it is told from, by which motion is computed as exactly as it can be seen.

    electrons: mean photoelectrons where the signal is 1. read_noise_e: standard deviation in the dark [e-].
    """

    electrons: float
    read_noise_e: float


@dataclass(frozen=True)
class MovingFrames:
    """Clean frames of a camera that moves; all as the fields of `Sample` of these names.

    signal, sharp: (frames, height, width) float32 mosaics, 1 where the reference exposure saturates.
    """

    signal: np.ndarray
    sharp: np.ndarray
    flow_px: np.ndarray
    offsets_px: tuple[tuple[float, float], ...]
    mid_exposure_s: tuple[float, ...]
    poses_deg: tuple[tuple[float, ...], ...]


def expose_moving(
    device: Device,
    planes: np.ndarray,
    reach: int,
    camera: MovingCamera,
    sensor: tuple[int, int],
    cfa: CfaName,
    light: Sequence[Light],
) -> MovingFrames:
    """Expose the frames of a moving camera, each as a shot of its own on the path's clock.

    planes: (height + 2 reach, width + 2 reach, 3) float32 picture with its border on all sides, an even number of pixels.
    sensor: row of the crop's first, and rows. light: of each frame.
    """
    first_row, sensor_rows = sensor
    rows, columns = (side - 2 * reach for side in planes.shape[:2])
    all_rows = planes.shape[0]
    lead_s = camera.readout_s * (first_row - reach) / sensor_rows  # when the picture's first row is released
    shutter = RollingShutter(camera.readout_s * all_rows / sensor_rows) if camera.readout_s > 0.0 else None
    around = camera.line_times(first_row - reach, all_rows, sensor_rows)
    middles_s = [camera.middle_s(around, frame) for frame in range(len(camera.starts_s))]
    mid_exposure_s = [float(middle_s[reach : reach + rows].mean()) for middle_s in middles_s]
    picture = np.ascontiguousarray(planes, np.float32)
    picture.setflags(write=False)
    view = _View(device, picture, reach, camera, cfa)
    signal, sharp = [], []
    for start_s, middle_s, lit in zip(camera.starts_s, mid_exposure_s, light, strict=True):
        signal.append(view.expose(Exposure(camera.exposure_s, start_s=start_s + lead_s, shutter=shutter), lit))
        sharp.append(view.expose(Exposure(INSTANT_S, start_s=middle_s - 0.5 * INSTANT_S), lit))
    flow = find_flow(camera, rows, columns, middles_s)
    turned_deg = np.degrees(camera.path.poses(np.array(mid_exposure_s)).rotation_rad)
    return MovingFrames(
        np.stack(signal),
        np.stack(sharp),
        flow,
        tuple((float(y), float(x)) for y, x in flow[:, :, rows // 2, columns // 2]),
        tuple(map(nine_digits, mid_exposure_s)),
        tuple(tuple(map(nine_digits, pose)) for pose in turned_deg),
    )


@dataclass(frozen=True)
class _View:
    """A picture of one pixel per photosite before a camera whose colours are the picture's own.

    scenes: the picture at each radiance that a frame needs, with what was planned for it.
    """

    device: Device
    planes: np.ndarray
    reach: int
    camera: MovingCamera
    cfa: CfaName
    scenes: dict[float, Scene] = field(default_factory=dict)

    def expose(self, exposure: Exposure, light: Light) -> np.ndarray:
        """Return the signal of a frame without noise, (height, width) float32, through the passes of a shot."""
        lens = ThinLens(1e-3 * PITCH_UM * self.camera.focal_px, 8.0, cos4=False)
        per_radiance = lens.irradiance_per_radiance_sr() * exposure.time_s * PITCH_UM**2
        radiance = light.electrons / per_radiance  # electron radiance where the signal is 1
        if radiance not in self.scenes:
            spectra = radiance * _unit_spectra()
            self.scenes[radiance] = Scene(self.planes, spectra, WAVELENGTHS_NM, np.ones(len(WAVELENGTHS_NM)))
        scene = self.scenes[radiance]
        (height, width), reach = self.planes.shape[:2], self.reach
        window = Window(reach, reach, width - 2 * reach, height - 2 * reach)
        gain = HALF_CODES / light.electrons
        camera = Camera(
            make="Photosite",
            model="view",
            width_px=width,
            height_px=height,
            pixel_pitch_um=PITCH_UM,
            cfa=self.cfa,
            bit_depth=16,
            black_level_dn=0.0,
            response=RESPONSE,
            iso_table={100: IsoSetting(gain, gain * light.read_noise_e)},
            stages={"photon_shot_noise": PhotonShotNoise()},
            window=window,
        )
        shot = Shot(scene, lens, exposure, camera, motion=Motion(self.camera.path), tolerance=TOLERANCE)
        planned = measure(plan(shot), self.device)
        mosaic = self.device.download(expose(planned, self.device), (window.height, window.width), np.float32)
        return mosaic / np.float32(radiance)


@cache
def _unit_spectra() -> np.ndarray:
    """Return spectra (3, wavelengths) whose electron radiance is 1 in one colour each, in which alone it is seen."""
    own = RESPONSE.quantum_efficiency.T
    none = np.zeros((1, 1, 3), np.float32)
    scene = Scene(none, own, WAVELENGTHS_NM, np.ones(len(WAVELENGTHS_NM)))
    weights = electron_radiance_weights(scene, WAVELENGTHS_NM, RESPONSE.quantum_efficiency)
    return own / np.diag(weights)[:, None]


def find_flow(camera: MovingCamera, rows: int, columns: int, middles_s: Sequence[np.ndarray]) -> np.ndarray:
    """Return the way from the first frame, (frames, 2, rows, columns) float32 [px], y and x, of what stands there in it.

    middles_s: for each frame, the middle of the exposure of each row on the clock [s], and of as many rows above as below.
    """
    beside = (len(middles_s[0]) - rows) // 2
    none = np.zeros(1)
    scene = Scene(np.zeros((rows, columns, 1), np.float32), np.zeros((1, 1)), none, none)
    flow = SurfaceFlow(scene, Motion(camera.path), camera.image_motion(rows + 2 * beside, columns).geometry)
    first, *others = [flow.poses("rows", middle_s) for middle_s in middles_s]
    row_s = float(np.ptp(middles_s[0])) / max(len(middles_s[0]) - 1, 1)
    steps = min(max(int(FLOW_STEP_S / max(row_s, 1e-9)), 1), FLOW_STEP_PX), FLOW_STEP_PX
    down, across = (
        np.append(np.arange(0.5, side - 0.5, step), side - 0.5) for side, step in zip((rows, columns), steps, strict=True)
    )
    x, y = np.meshgrid(across, down)
    places, found = np.column_stack([x.ravel(), beside + y.ravel()]), np.zeros((len(middles_s), 2, rows, columns), np.float32)
    for frame, poses in enumerate(others, 1):
        grid = flow.displacements(first, poses, places).reshape(*x.shape, 2)
        for axis in (0, 1):
            fine = _between(_between(grid[..., 1 - axis], down, rows).T, across, columns).T
            found[frame, axis] = np.rint(np.ldexp(fine, FLOW_DIGITS)) / (1 << FLOW_DIGITS)
    return found


def _between(values: np.ndarray, places: np.ndarray, count: int) -> np.ndarray:
    """Return values (places, n) at the centres of so many pixels along the first axis, linear between places [px]."""
    centres = np.arange(count) + 0.5
    first = np.clip(np.searchsorted(places, centres, side="right") - 1, 0, max(len(places) - 2, 0))
    second = np.minimum(first + 1, len(places) - 1)
    gap = np.maximum(places[second] - places[first], 1e-9)
    share = ((centres - places[first]) / gap)[:, None]
    return values[first] * (1.0 - share) + values[second] * share
