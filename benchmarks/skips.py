"""What is skipped, and what that saves: run time against error with each skip off and on.

"Off" is a plan of ours in which the skip is forced off by an argument, or the same scene with the least thing that prevents it;
the rows say which. Each is judged against the same shot with tolerance 0 in a window.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from defocus import depth_of
from measuring.light import exposing, light_of
from measuring.record import ERROR_COLUMNS, Z_ERROR, Record, z_errors
from measuring.run import Run
from motion import camera_of, frame_size, squares

from simulator import simulate, simulate_many
from simulator.device import Device
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.optics.defocus.defocus import plan_defocus
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.light_cache import LightCache
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Camera, Window
from simulator.sensor.stages.registry import STAGES

LENS = ThinLens(50.0, 1.4, focus_distance_m=2.0, cos4=False)
ELECTRONS, TIME_S, ISO = 2000.0, 1e-3, 100
BLURRED_PX, TILE_SHARE = 6.0, 0.05  # largest radius, and the share of the picture that is out of focus
TEXT = """\
{size} photosites. "Off" is a legal plan of ours: forced by an argument, or the same scene with the thing that prevents the
skip. The error is that of the light on the sensor in a window against `tolerance: 0` of the same shot, in units of the noise of
2,000 e⁻; a skip may move it by the tolerance of 0.1 at most. An error of 0 stands at the lower edge of the chart.
"""


@dataclass(frozen=True)
class Setting:
    """A skip off or on.

    how: what forces it. run: what is timed. shot, planned: whose light is judged; None: as the shot is planned.
    """

    name: str
    how: str
    run: Callable[[], object]
    shot: Shot
    planned: Plan | None = None


def scene_of(light: np.ndarray, depth_m: float | np.ndarray, bands: int = 3, *behind: Layer, **more: np.ndarray) -> Scene:
    """A scene of light (height, width) in so many equal bands, whose arrays cannot be written to."""
    wavelengths = np.arange(400.0, 701.0, 10.0)
    edges = np.linspace(400.0, 701.0, bands + 1)
    spectra = 1e-3 * np.stack(
        [(wavelengths >= low) & (wavelengths < high) for low, high in zip(edges, edges[1:], strict=False)]
    )
    planes = np.repeat(light[..., None], bands, axis=2).astype(np.float32)
    scene = Scene(planes, spectra, wavelengths, np.ones(31), depth_m, coverage=more.get("coverage"), behind=behind)
    for array in scene.arrays():
        array.setflags(write=False)
    return scene


def partly_blurred(width: int, height: int, share: float, pitch_um: float) -> np.ndarray:
    """Depth of a wall in focus that bends away evenly over so much of the picture, at its right, (height, width) float32 [m].

    A step in depth would take more time than either part, by what it hides.
    """
    right = np.clip((np.arange(width) + 0.5) / width - (1.0 - share), 0.0, None) / share
    depth_m = depth_of(BLURRED_PX * right, pitch_um).astype(np.float32)
    return np.broadcast_to(depth_m, (height, width)).copy()


def with_noises(camera: Camera, sigma: float) -> Camera:
    """A camera with three more noises of this strength in percent, electrons or DN."""
    numbers = {"prnu": {"sigma": 0.01 * sigma}, "dsnu": {"sigma_e": sigma}}
    stages = {stem: STAGES[stem](**values) for stem, values in numbers.items()}
    stages["column_offset"] = STAGES["column_offset"](sigma_dn=sigma)
    return replace(camera, stages={**camera.stages, **stages})


class Skips:
    """The pairs of settings, of frames of one size."""

    def __init__(self, device: Device, megapixels: float) -> None:
        self.device = device
        self.width, self.height = frame_size(megapixels)
        self.light = squares(self.width, self.height, 1)[0]
        self.camera = camera_of(self.width, self.height, 3)

    def shot(self, scene: Scene, **more: object) -> Shot:
        """A shot of a scene."""
        return replace(Shot(scene, LENS, Exposure(TIME_S, ISO), self.camera), **more)  # type: ignore[arg-type]

    def taken(self, name: str, how: str, shot: Shot) -> Setting:
        """A setting that takes the shot."""
        return Setting(name, how, lambda: simulate(shot), shot)

    def exposed(self, name: str, how: str, shot: Shot, planned: Plan) -> Setting:
        """A setting that makes the light of a plan on the sensor."""
        return Setting(name, how, exposing(self.device, planned, {}, name), shot, planned)

    def sharp(self) -> list[Setting]:
        """No blur in a sharp scene."""
        shot = self.shot(scene_of(self.light, LENS.focus_distance_m))
        on = plan(shot)
        pitch_um, optics = self.camera.pixel_pitch_um, on.optics
        forced = plan_defocus(
            LENS, pitch_um, optics.scene, optics.projection.scale, optics.accuracy, optics.sensor_px, keeps_sharp=True
        )
        off = replace(on, optics=replace(optics, defocus=forced))
        return [
            self.exposed("off", "plan_defocus(keeps_sharp=True)", shot, off),
            self.exposed("on", "as planned", shot, on),
        ]

    def tiles(self) -> list[Setting]:
        """5 % of the tiles out of focus."""
        pitch_um = self.camera.pixel_pitch_um
        most, some = (
            self.shot(scene_of(self.light, partly_blurred(self.width, self.height, share, pitch_um)))
            for share in (1.0 - TILE_SHARE, TILE_SHARE)
        )
        return [self.taken("off", "95 % of the picture out of focus", most), self.taken("on", "5 % of it", some)]

    def motion(self) -> list[Setting]:
        """No motion."""
        still = self.shot(scene_of(self.light, LENS.focus_distance_m))
        moves = replace(still, motion=Motion(layers={0: LayerMotion((Speed(1.0 / TIME_S, "px/s"), Speed(0.0, "px/s")))}))
        tripod = replace(still, motion=Motion(camera=SteadyMotion()))
        return [self.taken("off", "a path of 1 photosite", moves), self.taken("on", "motion of a camera at rest", tripod)]

    def grey(self) -> list[Setting]:
        """A grey scene."""
        three, one = (self.shot(scene_of(self.light, LENS.focus_distance_m, bands)) for bands in (3, 1))
        return [self.taken("off", "grey as three equal planes", three), self.taken("on", "one plane", one)]

    def mono(self) -> list[Setting]:
        """A sensor without colour filter, behind a lens out of focus."""
        scene = scene_of(self.light, depth_of(np.array([BLURRED_PX]), self.camera.pixel_pitch_um), 1)
        mono = self.shot(scene, camera=camera_of(self.width, self.height, 1))
        return [self.taken("off", "a Bayer filter", self.shot(scene)), self.taken("on", "no filter", mono)]

    def crop(self) -> list[Setting]:
        """A window of a sixteenth of the frame."""
        whole = self.shot(scene_of(self.light, depth_of(np.array([BLURRED_PX]), self.camera.pixel_pitch_um)))
        width, height = self.width // 64 * 16, self.height // 64 * 16
        window = Window(width, height, width, height)
        part = replace(whole, camera=replace(whole.camera, window=window))
        return [self.taken("off", "the whole frame", whole), self.taken("on", "a window of 1/16", part)]

    def noises(self) -> list[Setting]:
        """Noises of strength zero."""
        scene = scene_of(self.light, LENS.focus_distance_m)
        tiny, none = (self.shot(scene, camera=with_noises(self.camera, sigma)) for sigma in (1e-6, 0.0))
        return [self.taken("off", "three noises of 10⁻⁶", tiny), self.taken("on", "three noises of 0", none)]

    def iso(self) -> list[Setting]:
        """Shots that differ in their ISO alone."""
        shot = self.shot(scene_of(self.light, depth_of(np.array([BLURRED_PX]), self.camera.pixel_pitch_um)))
        isos = [replace(shot, exposure=replace(shot.exposure, iso=iso)) for iso in shot.camera.isos[:6]]

        def one_by_one() -> None:
            for one in isos:
                simulate(one, cache=LightCache(0))

        def together() -> None:
            for _ in simulate_many(isos):
                pass

        return [
            Setting("off", "6 ISOs, LightCache(memory_bytes=0)", one_by_one, isos[0]),
            Setting("on", "6 ISOs, simulate_many", together, isos[-1]),
        ]

    def hidden(self) -> list[Setting]:
        """A layer that another one hides."""
        near_m, far_m = (depth_of(np.array([px]), self.camera.pixel_pitch_um) for px in (-4.0, BLURRED_PX))
        back = np.ascontiguousarray(self.light[:, ::-1])
        far = Layer(np.repeat(back[..., None], 3, axis=2).astype(np.float32), far_m)
        hole = np.ones((self.height, self.width), np.float32)
        hole[: self.height // 2 : 64, ::64] = 0.0
        seen = scene_of(self.light * hole, near_m, 3, far, coverage=hole)
        covered = scene_of(self.light, near_m, 3, far)
        return [
            self.taken("off", "a pixel of 4096 lets through, in the upper half", self.shot(seen)),
            self.taken("on", "it covers all", self.shot(covered)),
        ]

    def pairs(self) -> dict[str, list[Setting]]:
        """Settings by what is skipped, off before on."""
        return {
            "no blur in a sharp scene": self.sharp(),
            "5 % of tiles out of focus": self.tiles(),
            "no motion": self.motion(),
            "grey scene": self.grey(),
            "mono sensor": self.mono(),
            "crop": self.crop(),
            "zero noises": self.noises(),
            "only ISO changed": self.iso(),
            "hidden layer": self.hidden(),
        }

    def error(self, setting: Setting, side: int) -> dict[str, float]:
        """Error of a setting's light in a window against tolerance 0 of its shot."""
        frame = setting.shot.camera.frame
        x, y = frame.x + frame.width // 2 - side // 2, frame.y + frame.height // 2 - side // 2
        part = replace(setting.shot, camera=replace(setting.shot.camera, window=Window(x, y, side, side)))
        planned = plan(part)
        if setting.planned is not None:
            planned = replace(planned, optics=replace(planned.optics, defocus=setting.planned.optics.defocus))
        found, truth = (light_of(self.device, one) for one in (planned, plan(replace(part, tolerance=0.0))))
        return z_errors(found, truth, ELECTRONS / float(truth.max()))


def measure_skips(run: Run) -> Record:
    """Run time and error of each skip off and on."""
    columns = ERROR_COLUMNS | {"how": ["how", ""], "error": [Z_ERROR, ".2g"], "saved": ["times faster", ".1f"]}
    record, device = Record("skips", "What is skipped", TEXT, Z_ERROR, columns, "error"), run.device()
    record.columns["case"], record.columns["name"] = ["what", ""], ["skip", ""]
    skips = Skips(device, run.pick(0.1, 1.0, 12.0))
    record.facts["size"] = f"{skips.width} x {skips.height}"
    for case, settings in skips.pairs().items():
        found = run.turns(case, {f"Photosite, {one.name}": one.run for one in settings})
        saved = found["Photosite, off"]["cpu_s"] / found["Photosite, on"]["cpu_s"]
        for one in settings:
            name, more = f"Photosite, {one.name}", {"saved": saved} if one.name == "on" else {}
            error = skips.error(one, run.pick(16, 48, 96))
            record.add(case, name, found[name], how=one.how, **error, **more)
        record.judge(case, f"{saved:.1f} x faster", "faster", saved > 1.0)
    return record
