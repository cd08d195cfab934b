"""Motion blur: run time against error beside accumulated frames in NumPy, and its price beside the same shot at rest.

Run time against error: a path of 20 photosites over hard-edged squares, before a sensor without colour filter, with as many
scene pixels as photosites. The error is against a sum in float64 over many instants, and points of the aperture where the lens
blurs, in a window, in units of the noise when the brightest light gives 2000 e-. NumPy shifts what it sees by bilinear reads,
in float32: with `scipy.ndimage.shift`, or by slices of arrays, which is faster. Behind the lens each of its frames is one
point of the aperture at one instant, or layers that were blurred before they move. Photosite's time is that of the light on
the sensor from the scene's planes on; that of NumPy begins with float32 planes on padded arrays.

Price: whole shots in colour, second call in one process, in turns: of squares, and of a photograph that is repeated in mirror
image, with a pixel for each photosite. The brightest light gives 2000 e-.
"""

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from unittest.mock import patch

import numpy as np
from measuring.record import ERROR_COLUMNS, Z_ERROR, Record, z_errors
from measuring.run import Run
from scipy.ndimage import shift
from scipy.signal import oaconvolve
from scipy.stats import qmc

from data_gen.sources.motorcycle import motorcycle_scene
from simulator import load_shot, simulate
from simulator.device import Device, Kernel
from simulator.exposure.camera_motion import SteadyMotion
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMotion, Speed
from simulator.exposure.settings import Exposure
from simulator.exposure.shutter import RollingShutter
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Camera, SpectralResponse, Window

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "grey_ramp.yaml"
LENS = ThinLens(50.0, 1.4, focus_distance_m=2.0, cos4=False)
DIFFRACTED = replace(LENS, f_number=16.0, diffraction=True)  # an Airy disk of 1.3 photosites in radius
WAY_PX = (19.0, 6.245)  # 20 photosites
BLUR_PX = (-5.0, 6.0)  # signed radii of the layers behind the lens
ELECTRONS, PROBE_S = 2000.0, 1e-3  # of the brightest light; exposure at which it is looked at
TOLERANCES = (1.0, 0.3, 0.1, 0.03)
FRAMES = (4, 8, 16, 32, 64)
MOST_SHIFTED = 16  # frames that SciPy shifts, whose light is that of slices, in twelve times their time
DENSE_SPOT = 1 << 22  # points of the reference of one picture that is blurred, whose blur and path are one kernel
DEFAULT = 0.1
MARGIN = 32  # photosites around the frame that peers see
ASKED_ONE, ASKED_LAYERS, ASKED_ROLLING = 3.0, 8.0, 1.2

METHODS = {"swept": "swept", "swept_first": "swept, then blurred", "joint": "joint samples", "instants": "sum of instants"}

Read = Callable[[np.ndarray, float, float], np.ndarray]


@dataclass(frozen=True)
class Surfaces:
    """Layers with a pixel for each photosite, nearest first; the last covers everything.

    light, coverage: (layers, height, width) float32, light multiplied by coverage. radius_px: signed blur radius of each layer.
    ways_px: (layers, 2), way to the right and down in the exposure.
    """

    light: np.ndarray
    coverage: np.ndarray
    radius_px: tuple[float, ...]
    ways_px: tuple[tuple[float, float], ...]

    @property
    def is_blurred(self) -> bool:
        """Whether the lens blurs a layer."""
        return any(self.radius_px)

    def padded(self, dtype: type) -> list[tuple[np.ndarray, np.ndarray]]:
        """Light and coverage of each layer with its edge continued by MARGIN."""
        border = ((0, 0), (MARGIN, MARGIN), (MARGIN, MARGIN))
        light, coverage = (np.pad(one, border, "edge").astype(dtype) for one in (self.light, self.coverage))
        return list(zip(light, coverage, strict=True))


def squares(width: int, height: int, layers: int) -> np.ndarray:
    """Squares of 5 photosites of random light from 0.05 to 0.95, (layers, height, width)."""
    coarse = np.random.default_rng(7).random((layers, height // 5 + 1, width // 5 + 1), dtype=np.float32)
    return 0.05 + 0.9 * np.kron(coarse, np.ones((1, 5, 5), np.float32))[:, :height, :width]


def photographs(width: int, height: int, layers: int) -> np.ndarray:
    """The picture of `make demo` in grey, in mirror images side by side, up to 0.95, (layers, height, width)."""
    with tempfile.TemporaryDirectory(prefix="photosite-") as folder:
        path = motorcycle_scene(Path(folder) / "motorcycle.exr")
        grey = (
            load_shot(SHOT.parent / "motorcycle_stopped_down.yaml", {"scene.image": str(path)}).scene.load().planes.mean(axis=2)
        )
    rows, columns = max(0, height - grey.shape[0]), max(0, width - grey.shape[1])
    light = np.pad(0.95 / grey.max() * grey, ((0, rows), (0, columns)), "symmetric")[:height, :width]
    return np.stack([light, light[:, ::-1]])[:layers].astype(np.float32)


def surfaces(light: np.ndarray, radius_px: tuple[float, ...], ways_px: tuple[tuple[float, float], ...]) -> Surfaces:
    """Layers of this light (layers, height, width); the nearer of two has the shape of disks and bars."""
    coverage = np.ones_like(light)
    if len(light) > 1:
        y, x = np.mgrid[: light.shape[1], : light.shape[2]]
        coverage[0] = ((x % 160 - 80) ** 2 + (y % 120 - 60) ** 2 < 30**2) | (x % 80 < 9)
    return Surfaces(light * coverage, coverage, radius_px, ways_px)


def scene_of(held: Surfaces, bands: int) -> Scene:
    """The layers before LENS; each band of their light is a part of the spectrum of its own."""
    wavelengths = np.arange(400.0, 701.0, 10.0)
    edges = np.linspace(400.0, 700.0, bands + 1)
    spectra = 1e-3 * np.stack(
        [(wavelengths >= low) & (wavelengths <= high) for low, high in zip(edges, edges[1:], strict=False)]
    )
    pitch_um = camera_of(64, 64, bands).pixel_pitch_um
    per_dioptre = float(LENS.blur_radius_um(np.inf) - LENS.blur_radius_um(1.0)) / pitch_um
    share = np.linspace(1.0, 0.4, bands, dtype=np.float32)
    layers = []
    for light, coverage, radius in zip(held.light, held.coverage, held.radius_px, strict=True):
        planes = light[..., None] * share
        planes.setflags(write=False)
        coverage.setflags(write=False)
        layers.append(Layer(planes, 1.0 / (0.5 - radius / per_dioptre), None if coverage.all() else coverage))
    first, *behind = layers
    light = np.ones(31)
    return Scene(first.planes, spectra, wavelengths, light, first.depth_m, coverage=first.coverage, behind=tuple(behind))


def camera_of(width: int, height: int, bands: int) -> Camera:
    """A Sony A7S II of this size; of one band: without its colour filter."""
    camera = replace(load_shot(SHOT, {"camera": "sony_a7s2"}).camera, width_px=width, height_px=height)
    if bands > 1:
        return camera
    wavelengths = np.arange(400.0, 701.0, 10.0)
    return replace(camera, cfa="MONO", color_matrix=None, response=SpectralResponse(wavelengths, np.ones((31, 1))))


def moving_shot(held: Surfaces, bands: int, tolerance: float, lens: ThinLens = LENS) -> Shot:
    """A shot in which the layers move, and the brightest light gives ELECTRONS."""
    height, width = held.light.shape[1:]
    probe = Shot(scene_of(held, bands), lens, Exposure(PROBE_S), camera_of(width, height, bands), tolerance=tolerance)
    time_s = PROBE_S * ELECTRONS / plan(probe).optics.accuracy.electrons
    speeds = ((Speed(x / time_s, "px/s"), Speed(y / time_s, "px/s")) for x, y in held.ways_px)
    moves = {number: LayerMotion(speed) for number, speed in enumerate(speeds) if any(held.ways_px[number])}
    return replace(probe, exposure=Exposure(time_s), motion=Motion(layers=moves))


def by_slices(plane: np.ndarray, x: float, y: float) -> np.ndarray:
    """Bilinear read of a padded plane, its frame shifted by a place; float arithmetic of the plane's type."""
    column, row = int(np.floor(x)), int(np.floor(y))
    right, down = plane.dtype.type(x - column), plane.dtype.type(y - row)
    top, left = MARGIN + row, MARGIN + column
    part = plane[top : top + plane.shape[0] - 2 * MARGIN + 1, left : left + plane.shape[1] - 2 * MARGIN + 1]
    across = part[:, :-1] + right * (part[:, 1:] - part[:, :-1])
    return across[:-1] + down * (across[1:] - across[:-1])


def by_shift(plane: np.ndarray, x: float, y: float) -> np.ndarray:
    """The same by SciPy."""
    return shift(plane[MARGIN:-MARGIN, MARGIN:-MARGIN], (-y, -x), order=1, mode="nearest")


def accumulate(
    planes: list[tuple[np.ndarray, np.ndarray]],
    radius_px: tuple[float, ...],
    ways_px: tuple[tuple[float, float], ...],
    points: np.ndarray,
    read: Read,
) -> np.ndarray:
    """Mean of frames of layers, each at a point of the aperture and a share of the time.

    planes: padded light and coverage of each layer. points: (frames, 3), place in the unit disk, and share.
    """
    total = 0.0
    for across, along, share in points:
        light, through = 0.0, 1.0
        for number, (own, coverage) in enumerate(planes):
            x = radius_px[number] * across - share * ways_px[number][0]
            y = radius_px[number] * along - share * ways_px[number][1]
            light = light + through * read(own, x, y) if number else read(own, x, y)
            if number + 1 < len(planes):
                through = through * (1 - read(coverage, x, y))
        total = total + light
    return total / own.dtype.type(len(points))


def points_of(count: int, is_blurred: bool, seed: int = 1) -> np.ndarray:
    """Points of aperture and time, (count, 3): middles of even intervals, and Sobol' points where the lens blurs."""
    if not is_blurred:
        share = (np.arange(count) + 0.5) / count
        return np.stack([0.0 * share, 0.0 * share, share], axis=-1)
    first, second, share = qmc.Sobol(3, seed=seed).random(count).T
    radius, angle = np.sqrt(first), 2.0 * np.pi * second
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), share], axis=-1)


def disk(radius_px: float) -> np.ndarray:
    """Even disk on photosites, by the area of each that it covers; its sum is 1."""
    reach, fine = int(np.ceil(abs(radius_px))) + 1, 16
    place = (np.arange((2 * reach + 1) * fine) + 0.5) / fine - reach - 0.5
    inside = (place[:, None] ** 2 + place**2 < radius_px**2).astype(np.float32)
    area = inside.reshape(2 * reach + 1, fine, 2 * reach + 1, fine).mean(axis=(1, 3))
    return area / area.sum()


def blurred_first(planes: list[tuple[np.ndarray, np.ndarray]], held: Surfaces, points: np.ndarray) -> np.ndarray:
    """Layers that are blurred by FFT, then moved and composited at each instant."""
    spots = [disk(radius) for radius in held.radius_px]
    blurred = [tuple(oaconvolve(one, spot, "same") for one in own) for own, spot in zip(planes, spots, strict=True)]
    return accumulate(blurred, (0.0,) * len(spots), held.ways_px, points, by_slices)


def error(found: np.ndarray, truth: np.ndarray) -> dict[str, float]:
    """`z_errors`, when the brightest light, 0.95, gives ELECTRONS."""
    return z_errors(found, truth, ELECTRONS / 0.95)


class Frames:
    """Every contestant of one moving scene: its run, which leaves in `made` what returns its frame."""

    def __init__(self, device: Device, held: Surfaces) -> None:
        self.device, self.held = device, held
        self.runs: dict[str, Callable[[], object]] = {}
        self.made: dict[str, Callable[[], np.ndarray]] = {}

    def photosite(self) -> None:
        """The planned method at each tolerance."""
        for tolerance in TOLERANCES:
            planned = plan(moving_shot(self.held, 1, tolerance))
            motion = planned.optics.motion
            assert motion is not None  # the path is long
            name = f"Photosite, {METHODS[motion.method]}, {tolerance:g} σ"
            self.runs[name] = lambda name=name, planned=planned: self._expose(name, planned)

    def _expose(self, name: str, planned: Plan) -> None:
        mosaic = expose(measure(planned, self.device), self.device)
        self.device.finish()
        shape, unit = self.held.light.shape[1:], planned.optics.weights.sum()
        self.made[name] = lambda: self.device.download(mosaic, shape, np.float32) / unit

    def numpy(self) -> None:
        """Frames that are accumulated."""
        held, planes = self.held, self.held.padded(np.float32)

        def keep(name: str, make: Callable[[], np.ndarray]) -> None:
            def run() -> None:
                frame = make()
                self.made[name] = lambda: frame

            self.runs[name] = run

        for count in FRAMES:
            points, still = points_of(count, held.is_blurred), points_of(count, False)
            shifted = [("SciPy shift", by_shift)] if count <= MOST_SHIFTED else []
            for name, read in (*shifted, ("NumPy slices", by_slices)):
                keep(
                    f"{name}, {count} frames",
                    lambda points=points, read=read: accumulate(planes, held.radius_px, held.ways_px, points, read),
                )
            if held.is_blurred:
                keep(f"NumPy, blurred before, {count} frames", lambda still=still: blurred_first(planes, held, still))


def middle_of(width: int, height: int) -> Window:
    """The window that is compared, up to 160 x 120 photosites."""
    columns, rows = min(160, width - 2 * MARGIN), min(120, height - 2 * MARGIN)
    return Window((width - columns) // 2, (height - rows) // 2, columns, rows)


def swept_spot(radius_px: float, way_px: tuple[float, float], points: np.ndarray) -> np.ndarray:
    """Weights (MARGIN * 2 + 1, alike) float64 of the pixels around a photosite in its light: blur and path of one picture.

    points: (n, 3) of `points_of`. Each reads the picture bilinearly.
    """
    places = radius_px * points[:, 1::-1] - points[:, 2:] * np.array(way_px[::-1]) + MARGIN
    corner, side = np.floor(places).astype(int), 2 * MARGIN + 1
    part, found = places - corner, np.zeros(side * side)
    for down in (0, 1):
        for right in (0, 1):
            weight = np.where(down, part[:, 0], 1.0 - part[:, 0]) * np.where(right, part[:, 1], 1.0 - part[:, 1])
            found += np.bincount((corner[:, 0] + down) * side + corner[:, 1] + right, weight, side * side)
    return found.reshape(side, side) / len(points)


def dense_truth(held: Surfaces, window: Window, points: int) -> np.ndarray:
    """Mean over so many points, float64, (rows, columns) of the window."""
    rows = slice(window.y, window.y + window.height + 2 * MARGIN)
    columns = slice(window.x, window.x + window.width + 2 * MARGIN)
    planes = [(light[rows, columns], coverage[rows, columns]) for light, coverage in held.padded(np.float64)]
    if held.is_blurred and len(planes) == 1:
        spot = swept_spot(held.radius_px[0], held.ways_px[0], points_of(DENSE_SPOT, True, seed=77))
        return np.asarray(oaconvolve(planes[0][0], spot[::-1, ::-1], "valid"))
    return accumulate(planes, held.radius_px, held.ways_px, points_of(points, held.is_blurred, seed=77), by_slices)


TEXT = """\
Paths of 20 photosites, {size} photosites without colour filter: squares of 5 photosites, dark to bright; a nearer layer of
disks and bars moves before one at rest. The error is against sums in float64 over {instants} instants, {points} points of
aperture and time where the lens blurs, in units of the noise of 2,000 e⁻. Peers accumulate frames in float32 on one core:
shifted by `scipy.ndimage.shift`, by slices of arrays, or blurred by FFT before they move. Behind the lens a frame is one point
of the aperture at one instant.
"""
PRICE_TEXT = """\
Whole shots in colour, paths of 20 photosites, beside the same shot at rest; tolerance 0.1 σ.
"""


def measure_motion(run: Run) -> Record:
    """Run time and error of every method on every moving scene."""
    columns = ERROR_COLUMNS | {"error": [Z_ERROR, ".2f"], "rms": ["rms", ".3f"]}
    record, device = Record("motion", "Motion blur", TEXT, Z_ERROR, columns, "error"), run.device()
    width, height = frame_size(run.pick(0.05, 0.25, 1.0))
    dense = {False: run.pick(256, 1024, 1024), True: run.pick(1 << 12, 1 << 14, 1 << 16)}
    record.facts |= {"size": f"{width} x {height}", "instants": f"{dense[False]:,}", "points": f"{dense[True]:,}"}
    window, rest = middle_of(width, height), (0.0, 0.0)
    one, two = (squares(width, height, layers) for layers in (1, 2))
    scenes = {
        "one picture": surfaces(one, (0.0,), (WAY_PX,)),
        "two layers": surfaces(two, (0.0, 0.0), (WAY_PX, rest)),
        "one picture out of focus": surfaces(one, BLUR_PX[:1], (WAY_PX,)),
        "two layers out of focus": surfaces(two, BLUR_PX, (WAY_PX, rest)),
    }
    here = np.s_[window.y : window.y + window.height, window.x : window.x + window.width]
    for scene, held in scenes.items():
        truth, frames = dense_truth(held, window, dense[held.is_blurred]), Frames(device, held)
        frames.photosite()
        frames.numpy()
        for name, timing in run.turns(scene, frames.runs).items():
            more = {"is_default": True} if name.endswith(f" {DEFAULT:g} σ") else {}
            more |= {"family": "Photosite"} if name.startswith("Photosite") else {"family": name.rsplit(", ", 1)[0]}
            record.add(scene, name, timing, **error(frames.made[name]()[here], truth), **more)
    record.mark_dominated()
    return record


def frame_size(megapixels: float) -> tuple[int, int]:
    """Width and height of a frame of 3:2 [photosites], multiples of 16."""
    width = 16 * round((1.5e6 * megapixels) ** 0.5 / 16)
    return width, 16 * round(width / 24)


@contextmanager
def counted_launches() -> Iterator[list[str]]:
    """Names of the kernels that are launched inside."""
    launched: list[str] = []
    run = Device.run

    def counting(device: Device, kernel: Kernel, *sizes: tuple[int, ...] | None, **arguments: object) -> None:
        launched.append(kernel.name)
        run(device, kernel, *sizes, **arguments)  # type: ignore[arg-type]

    with patch.object(Device, "run", counting):
        yield launched


def launches_of(shot: Shot) -> list[str]:
    """Names of the kernels that a shot launches."""
    with counted_launches() as launched:
        raw = simulate(shot)
        assert raw.mean_electrons is not None and raw.noise_free_dn is not None  # they are computed when they are read
    return launched


def rolling(shot: Shot) -> Shot:
    """The shot by a rolling shutter that is read in the exposure time, as 1/50 s is in 20 ms."""
    return replace(shot, exposure=replace(shot.exposure, shutter=RollingShutter(shot.exposure.time_s)))


def priced(megapixels: float, is_blurred: bool) -> Iterator[tuple[str, Surfaces, ThinLens, float]]:
    """Name, layers, lens and most time over rest of each scene whose price is measured."""
    size, rest = frame_size(megapixels), (0.0, 0.0)
    for what, make in (("photograph", photographs), ("squares", squares)):
        if is_blurred:
            one, two = make(*size, 1), make(*size, 2)
            yield f"{what}, one path out of focus", surfaces(one, BLUR_PX[:1], (WAY_PX,)), LENS, ASKED_ONE
            yield f"{what}, one path with diffraction", surfaces(one, (0.0,), (WAY_PX,)), DIFFRACTED, ASKED_ONE
            yield f"{what}, two layers out of focus", surfaces(two, BLUR_PX, (WAY_PX, rest)), LENS, ASKED_LAYERS
        else:
            yield f"{what}, one path", surfaces(make(*size, 1), (0.0,), (WAY_PX,)), LENS, ASKED_ONE
            yield f"{what}, two layers", surfaces(make(*size, 2), (0.0, 0.0), (WAY_PX, rest)), LENS, ASKED_LAYERS


def measure_moving(run: Run) -> Record:
    """Time of moving shots beside the same at rest, and verdicts on processor time."""
    columns = {"name": ["shot", ""], "megapixels": ["Mpixel", ".3g"], "best_s": ["time [s]", ".3g"]}
    columns |= {"cpu_s": ["processor time [s]", ".3g"], "cpu_ratio": ["over rest", ".1f"]}
    record = Record("moving", "The price of motion", PRICE_TEXT, columns=columns)
    for is_blurred, megapixels in ((False, run.pick(0.1, 1.5, 12.0)), (True, run.pick(0.05, 0.2, 1.0))):
        for name, held, lens, asked in priced(megapixels, is_blurred):
            _price(run, record, name, held, lens, asked)
    return record


def _price(run: Run, record: Record, name: str, held: Surfaces, lens: ThinLens, asked: float) -> None:
    """Add the rows and verdicts of one scene."""
    moving = moving_shot(held, 3, DEFAULT, lens)
    tripod = replace(moving, motion=Motion(camera=SteadyMotion()))
    shots = {"at rest": replace(moving, motion=None), "on a tripod": tripod, "moving": moving, "rolling": rolling(moving)}
    still, same = (launches_of(shots[key]) for key in ("at rest", "on a tripod"))
    told = f"{len(same)} launches, {len(still)} without motion"
    record.judge(f"{name}: on a tripod", told, "the same", same == still)
    found = run.turns(name, {key: lambda shot=shot: simulate(shot) for key, shot in shots.items()})
    for key, timing in found.items():
        more = {"megapixels": held.light[0].size / 1e6, "cpu_ratio": timing["cpu_s"] / found["at rest"]["cpu_s"]}
        record.add(name, f"{name}, {key}", timing, **more)
    for key, other, most in (("moving", "at rest", asked), ("rolling", "moving", ASKED_ROLLING)):
        ratio = found[key]["cpu_s"] / found[other]["cpu_s"]
        record.judge(f"{name}: {key} over {other}", f"{ratio:.2f} x", f"{most:g} x", ratio <= most)
