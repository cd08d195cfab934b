"""Cases of the kernels behind a lens at rest: projection, lens blur, rays and point spread functions."""

import math
from dataclasses import replace

import numpy as np
from helpers.aberrated_walls import SPHERICAL, depth_map, thin_lens
from helpers.area_truth import photosite_means
from helpers.camera_builders import green_camera
from helpers.fine_frame import fine_shot, frame_radiance
from helpers.green_frames import EXPOSURE
from helpers.lens_frame import blurred_case
from helpers.lens_truths import COLUMNS as TRUTH_COLUMNS
from helpers.lens_truths import Case, penumbra, point, stripes, uniform_layers
from helpers.psf_frames import shot_of
from helpers.scene_builders import band_scene
from helpers.textured_planes import one_picture
from scipy.ndimage import map_coordinates, maximum_filter
from scipy.signal import fftconvolve

from simulator.device import Device, declared_struct, kernel_source
from simulator.optics.defocus.defocus import PATCH_COLUMNS, PATCH_ROWS, Defocus
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection, project
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.passes.patch_windows import WINDOW_COLUMNS, WINDOW_ROWS, PatchWindows
from simulator.optics.passes.radius_statistics import measure_patches
from simulator.optics.ray_reference.deep_rays import DeepBlur, DeepPicture
from simulator.optics.ray_reference.height_field_rays import sample_height_field
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import measure, plan
from simulator.pipeline.shot import Shot
from simulator.scene.deep_pixels import DeepPixels
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

from .inputs import number, picture
from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real, Whole

TOLERANCE = 0.1  # of the shots [sigma]
SCENE_SHAPE = {1.0: (30, 40), 2.0: (60, 80), 2.7: (81, 108), 4.0: (120, 160)}  # pixels of 30 x 40 photosites
MARGIN = 8  # photosites that see past the scene
FINE_RADII = (0.0, 0.1, 0.25, 0.5, 1.0)  # steps of `scene_gather.RADIUS_STEP_PX`


def area_outcome(inputs: Inputs, scale: float, radius_px: float, margin: int, shape: tuple[int, int] = (30, 40)) -> Outcome:
    """Electrons of photosites whose scene has `scale` pixels per photosite, behind blur circles of this radius."""
    height, width = (round(scale * side) for side in shape)
    pixels = picture(inputs)[:height, :width].astype(np.float64)
    electrons = number(inputs, "electrons")
    found, planned = frame_radiance(fine_shot(pixels, shape, radius_px, electrons))
    truth = photosite_means(pixels.astype(np.float32).astype(np.float64), shape, radius_px, chords=512)
    inner = (slice(margin, -margin), slice(margin, -margin)) if margin else (slice(None), slice(None))
    return Outcome(electrons * found[inner].astype(np.float64), electrons * truth[inner])


def run_projection(device: Device, inputs: Inputs) -> Outcome:
    frame = area_outcome(inputs, number(inputs, "scale"), 0.0, 0)
    return replace(frame, scale=maximum_filter(frame.exact, 3))


def run_projection_places(device: Device, inputs: Inputs) -> Outcome:
    """Photosites far to the right on a large sensor: a place in the scene is one number of float32."""
    scale, first = float(np.float32(number(inputs, "scale"))), int(number(inputs, "column"))
    count = math.ceil((first + 36) * scale) + 66
    line = np.zeros(count, np.float32)
    light = picture(inputs)[0]
    begin = int(first * scale)
    line[begin : begin + len(light)] = light
    projection = Projection(scale, 0.0, 0.0, count, 4, max(1, math.ceil(scale - 1e-6)), False)
    planes = device.upload(np.broadcast_to(line, (1, 4, count)))
    mosaic = project(device, projection, Cfa.uniform(0), Window(first, 0, 32, 3), planes)
    x = scale * (first + np.arange(33.0))
    if projection.is_fine:
        exact = (
            np.diff(np.interp(x, np.arange(count + 1.0), np.concatenate([[0.0], np.cumsum(line.astype(np.float64))]))) / scale
        )
    else:
        exact = np.interp(x[:-1] + 0.5 * scale - 0.5, np.arange(count), line.astype(np.float64))
    size = np.full((3, 32), float(light.max()) * (first + 36) * scale)
    return Outcome(device.download(mosaic, (3, 32), np.float32), np.broadcast_to(exact, (3, 32)), size)


def run_scene_gather(device: Device, inputs: Inputs) -> Outcome:
    return area_outcome(inputs, number(inputs, "scale"), number(inputs, "radius_px"), MARGIN)


def run_defocus(device: Device, inputs: Inputs) -> Outcome:
    radius_px = number(inputs, "radius_px")
    margin = math.ceil(radius_px) + 3
    return area_outcome(inputs, 2.0, radius_px, margin, (40, 48))


def closed_form(inputs: Inputs) -> Case:
    """Return a scene of two surfaces whose picture is known."""
    near, far = number(inputs, "near_px"), number(inputs, "far_px")
    if inputs["kind"] == "penumbra":
        return penumbra(near, number(inputs, "slope"), 2)
    if inputs["kind"] == "stripes":
        return stripes(near, near + abs(far) + 0.5, number(inputs, "period_px"), 2)
    return uniform_layers(near, near + abs(far) + 0.5, 2)


def outcome_of(case: Case, electrons: float, hidden: str = "none", columns: slice = slice(None)) -> Outcome:
    """Electrons of a case's photosites."""
    found = blurred_case(case, electrons, TOLERANCE, hidden)  # type: ignore[arg-type]
    return Outcome(electrons * found[:, columns].astype(np.float64), electrons * case.truth[:, columns])


def run_occlusion(device: Device, inputs: Inputs) -> Outcome:
    return outcome_of(closed_form(inputs), number(inputs, "electrons"))


def run_wide_blur(device: Device, inputs: Inputs) -> Outcome:
    near, far = -number(inputs, "near_px"), -number(inputs, "near_px") * number(inputs, "far_share")
    return outcome_of(one_picture(uniform_layers(near, far)), number(inputs, "electrons"), "extend")


EDGE, NEAR_PX = 6, -5.0  # of a half-plane that makes tiles sample the aperture, and hides nothing of the lamp


def run_highlights(device: Device, inputs: Inputs) -> Outcome:
    """A lamp on a wall beside the edge of a nearer half-plane: where the edge reaches nothing, the exact disk."""
    radius_px = number(inputs, "radius_px")
    alone = point(radius_px, 1, number(inputs, "light"))
    covered = np.broadcast_to(np.arange(alone.colour.shape[2]) < alone.margin + EDGE, alone.colour.shape[1:]).astype(float)
    colour = np.stack([0.5 * covered, alone.colour[0]])
    radius = np.stack([np.full(covered.shape, NEAR_PX), alone.radius_px[0]])
    case = replace(alone, colour=colour, coverage=np.stack([covered, np.ones_like(covered)]), radius_px=radius)
    return outcome_of(case, number(inputs, "electrons"), columns=slice(EDGE + 7, TRUTH_COLUMNS))


def run_radius_statistics(device: Device, inputs: Inputs) -> Outcome:
    signs = np.random.default_rng(int(number(inputs, "signs"))).choice([-1.0, 1.0], (32, 128))
    radius = (picture(inputs, "radius") * signs).astype(np.float32)
    maps = device.upload(InterleavedColumns(1, 32, 64).encode(radius[None]))
    found, _ = measure_patches(device, maps, 32, 64, 0, first_class=-40.0, classes_per_unit=3.0)
    exact, size = radius.astype(np.float64), []

    def patches(values: np.ndarray) -> np.ndarray:
        split = values.reshape(32 // PATCH_ROWS, PATCH_ROWS, -1, PATCH_COLUMNS).swapaxes(1, 2)
        return split.reshape(*split.shape[:2], -1)

    steps = [np.diff(exact, axis=1, append=exact[:, -1:]), np.diff(exact, axis=0, append=exact[-1:])]
    steepest = np.maximum(*(patches(np.abs(step)) for step in steps)).max(axis=2)
    split = exact.reshape(32 // PATCH_ROWS, PATCH_ROWS, -1, PATCH_COLUMNS)
    slopes = np.diff(split, axis=3).mean(axis=(1, 3)), np.diff(split, axis=1).mean(axis=(1, 3))
    largest = patches(np.abs(exact)).max(axis=2)
    size = [0.0 * largest, 0.0 * largest, 0.0 * largest, largest, largest]
    return Outcome(found, np.stack([patches(exact).min(axis=2), patches(exact).max(axis=2), steepest, *slopes]), np.stack(size))


def run_patch_windows(device: Device, inputs: Inputs) -> Outcome:
    over, rows, columns, side = int(number(inputs, "over")), 43, 128, 8
    layout, shape = InterleavedColumns(over, over * rows, columns // 2), (over * rows, over * columns)
    radius = np.resize(picture(inputs, "radius"), shape)
    coverage = np.resize(picture(inputs, "coverage"), shape)
    planes = layout.encode(np.stack([coverage, coverage]))
    defines = {**Cfa.uniform(0).macros(0, 0), "OVER": over, "CHANNELS": 1, "COVERAGE": 1}
    measured = PatchWindows(device, layout, Defocus((radius,), True, 1.0), defines)
    band = {"sample_rows": layout.rows, "set_columns": layout.set_columns, "frame_x": 0, "frame_y": 0, "width": 1, "height": 1}
    measured.measure(device.upload(planes), device.upload(layout.encode(radius[None])), band)
    window = declared_struct(kernel_source("patch_windows.h"), "patch_window")
    found = device.download(measured.windows, (1, measured.rows, measured.columns), window)[0]
    exact = np.zeros((3, measured.rows, measured.columns))
    for row, column in np.ndindex(measured.rows, measured.columns):
        first, left = row * over * side, column * over * side
        held = slice(first, first + WINDOW_ROWS * over * side), slice(left, left + WINDOW_COLUMNS * over * side)
        exact[:, row, column] = radius[held].min(), radius[held].max(), coverage[held].min()
    return Outcome(np.stack([found[name] for name in ("least", "greatest", "filled")]), exact)


RAYS_FRAME, RAYS_MARGIN = Window(0, 0, 20, 12), 6


def run_lens_sampling(device: Device, inputs: Inputs) -> Outcome:
    """The same rays through one surface at one distance, read bilinearly in float64."""
    light, radius_px, points = picture(inputs), number(inputs, "radius_px"), ray_samples(64, patterns=1)
    surfaces = upload_surfaces(device, light[None, None], np.ones_like(light)[None], np.full((1, *light.shape), radius_px), 6)
    found = device.download(
        sample_lens(device, surfaces, points, RAYS_FRAME, cells=False), (1, RAYS_FRAME.height, RAYS_FRAME.width), np.float32
    )[0]
    y, x = np.mgrid[: RAYS_FRAME.height, : RAYS_FRAME.width].astype(np.float64) + RAYS_MARGIN - 0.5
    px, py, ux, uy = points[0].T.astype(np.float64)
    place = y[..., None] + py + radius_px * uy, x[..., None] + px + radius_px * ux
    exact = map_coordinates(light.astype(np.float64), place, order=1, mode="nearest").mean(axis=-1)
    return Outcome(found, exact, light.max())


def run_lens_height_field(device: Device, inputs: Inputs) -> Outcome:
    """A flat field stays flat, whatever its depths."""
    level, signs = number(inputs, "level"), np.random.default_rng(int(number(inputs, "signs"))).choice([-1.0, 1.0], (24, 32))
    radius = (picture(inputs, "radius") * signs).astype(np.float32)
    light = sample_height_field(
        device, np.full((1, 24, 32), level), radius, RAYS_MARGIN, ray_samples(64), Window(101, 57, 20, 12), 1
    )
    exact = np.full((1, 12, 20), float(np.float32(level)))
    return Outcome(device.download(light, exact.shape, np.float32), exact)


def run_lens_deep(device: Device, inputs: Inputs) -> Outcome:
    """Fog of one extent before a wall: a ray crosses all of it wherever it goes."""
    fog, alpha, wall = number(inputs, "fog"), number(inputs, "alpha"), number(inputs, "wall")
    near, thick, behind = number(inputs, "near_px"), number(inputs, "thick_px"), number(inputs, "behind_px")
    count = 20 * 26
    ends = np.array([[near, near + thick], [near + thick + behind] * 2])
    pixels = DeepPixels(
        np.arange(0, 2 * count + 1, 2),
        26,
        np.tile([[fog], [wall]], (count, 1)),
        np.tile([alpha, 1.0], count),
        np.ones(2 * count),
        np.tile([1.0 + (thick > 0.0), 1.0], count),
    )
    blur = DeepBlur(np.tile(ends[:, 0], count), np.tile(ends[:, 1], count), float(np.abs(ends).max()))
    sampler = DeepPicture(device, pixels, blur, np.eye(1), Projection(1.0, 0.0, 0.0, 26, 20, 1, False))
    frame = Window(0, 0, 26, 20)
    found = sampler.sample(ray_samples(64), frame, ((0, 0), (0, 0)), np.arange(count))
    return Outcome(found, np.full(count, fog + (1.0 - alpha) * wall))


PSF_SIDE, PSF_MARGIN, PSF_WALLS = 96, 64, 160


def run_psf(device: Device, inputs: Inputs) -> Outcome:
    """A frame through diffraction and a low-pass filter, against SciPy's convolution with the planned kernel."""
    planes = picture(inputs).astype(np.float64)
    low_pass = number(inputs, "low_pass_um")
    camera = green_camera(PSF_SIDE, PSF_SIDE, **({"low_pass_um": low_pass} if low_pass else {}))
    through = ThinLens(50.0, number(inputs, "f_number"), cos4=False, diffraction=True)
    shot = Shot(band_scene(planes, math.inf, interpolation="nearest"), through, EXPOSURE, camera)
    unit = plan(shot).optics
    per_plane = float(unit.accuracy.electrons_per_radiance * unit.weights.sum())
    exposure = replace(EXPOSURE, time_s=EXPOSURE.time_s * number(inputs, "electrons") / per_plane)
    planned = measure(plan(replace(shot, exposure=exposure)), device)
    found = device.download(expose(planned, device), (PSF_SIDE, PSF_SIDE), np.float32) / planned.optics.weights.sum()
    psf, truth = planned.optics.psf, planes
    if psf is not None:
        kernel = psf.kernel(0, 0, False, 0, 0).sum(axis=0)
        truth = fftconvolve(np.pad(planes, PSF_MARGIN, mode="edge"), kernel, mode="same")
        truth = np.maximum(truth[PSF_MARGIN:-PSF_MARGIN, PSF_MARGIN:-PSF_MARGIN], 0.0)
    electrons = number(inputs, "electrons")
    return Outcome(electrons * found.astype(np.float64), electrons * truth)


BESIDE_STEP_PX = 24  # photosites beside the step between two walls, whose light mixes


def run_psf_slabs(device: Device, inputs: Inputs) -> Outcome:
    """Two walls side by side through an aberrated lens, each against SciPy's convolution with the kernel of its radius.

    No light is a highlight, whose kernels have no negative values (`FieldPsf.highlight_limits`).
    """
    planes = 0.3 + 0.7 * np.minimum(picture(inputs).astype(np.float64), 1.0)
    radii_px = number(inputs, "left_px"), number(inputs, "right_px")
    through = thin_lens(number(inputs, "f_number"), SPHERICAL)
    shot = shot_of(planes, through, depth_map(through, *radii_px))
    planned = measure(plan(shot), device)
    light = device.download(expose(planned, device), planes.shape, np.float32).astype(np.float64)
    psf, middle = planned.optics.psf, PSF_WALLS // 2
    walls = slice(0, middle - BESIDE_STEP_PX), slice(middle + BESIDE_STEP_PX, None)
    found, truth = [], []
    for radius_px, columns in zip(radii_px, walls, strict=True):
        if psf is None or not psf.is_gathered_by_distance:
            break  # of walls alike, which other kernels compute
        kernel = replace(psf, radii_px=(radius_px,), core=None).kernel(0, 0, False, 0, 0)[0]
        spread = fftconvolve(np.pad(planes, PSF_MARGIN, mode="edge"), kernel, mode="same")
        truth.append(np.maximum(spread[PSF_MARGIN:-PSF_MARGIN, PSF_MARGIN:-PSF_MARGIN][:, columns], 0.0))
        found.append(light[:, columns])
    if not found:
        return Outcome(np.zeros(1), np.zeros(1))
    each_e = planned.optics.accuracy.electrons_per_radiance
    exact = each_e * float(planned.optics.weights.sum()) * np.concatenate(truth, axis=1)
    return Outcome(each_e * np.concatenate(found, axis=1), exact)


ELECTRONS = Real(5.0, 5e4, log=True, switches=(1000.0,))
SURFACES: dict[str, Domain] = {
    "kind": Choice(("penumbra", "stripes", "layers")),
    "near_px": Real(-14.0, -1.5, switches=(-2.0, -4.0, -8.0)),  # samples of half a photosite hold no smaller penumbra
    "far_px": Real(0.3, 14.0, switches=(1.0, 2.0, 4.0, 8.0)),
    "slope": Choice((0.0, 0.3, 1.0)),
    "period_px": Real(9.0, 24.0),
    "electrons": Real(5.0, 2e4, log=True),
}
KEPT = "the tolerance of the shot is 0.1 sigma, which 99.9 % of the photosites keep; this is the worst of all"

CASES = (
    StressCase(
        "projection",
        ("projection",),
        {"light": Picture(SCENE_SHAPE[4.0], 1e-9, 1e5), "scale": Choice((2.0, 2.7, 4.0)), "electrons": ELECTRONS},
        run_projection,
        "a place of up to 160 scene pixels is rounded to 2^-17, and so is the scale: 256 ulps of the brightest neighbour",
        most_ulps=256.0,
    ),
    StressCase(
        "projection_places",
        ("projection",),
        {
            "light": Picture((1, 64), 1e-3, 2e4),
            "scale": Real(0.3, 3.0, switches=(0.5, 1.0, 2.0)),
            "column": Choice((0, 1000, 6000, 23000)),
        },
        run_projection_places,
        "a place in the scene is a rounded product: 1 ulp of the place, times the contrast, at either end",
        most_ulps=3.0,
    ),
    StressCase(
        "scene_gather",
        ("scene_gather",),
        {
            "light": Picture(SCENE_SHAPE[4.0], 1e-9, 1e3),
            "scale": Choice((2.0, 2.7, 4.0)),
            "radius_px": Real(0.0, 1.5, switches=FINE_RADII),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_scene_gather,
        KEPT,
        most_sigma=0.5,
    ),
    StressCase(
        "defocus",
        ("defocus",),
        {
            "light": Picture((80, 96), 1e-9, 1e3),
            "radius_px": Real(0.05, 12.0, switches=(*FINE_RADII[1:], 2.0, 4.0, 8.0)),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_defocus,
        KEPT,
        most_sigma=0.5,
    ),
    StressCase("occlusion", ("occlusion",), SURFACES, run_occlusion, KEPT, most_sigma=0.5),
    StressCase(
        "highlights",
        ("highlights",),
        {"radius_px": Real(0.5, 10.0, switches=(1.0, 2.0)), "light": Real(1.0, 1e8, log=True), "electrons": ELECTRONS},
        run_highlights,
        KEPT,
        most_sigma=0.5,
    ),
    StressCase(
        "wide_blur",
        ("wide_blur",),
        {"near_px": Real(28.0, 80.0, switches=(32.0, 64.0)), "far_share": Real(0.3, 0.9), "electrons": ELECTRONS},
        run_wide_blur,
        KEPT + ", where circles of 28 photosites end near circles of 8",
        most_sigma=3.0,
    ),
    StressCase(
        "radius_statistics",
        ("radius_statistics",),
        {"radius": Picture((32, 128), 1e-9, 1e4), "signs": Whole(0, 1000)},
        run_radius_statistics,
        "extremes are exact, a step is one difference; a slope is a mean of 56 of them",
        most_ulps=8.0,
    ),
    StressCase(
        "patch_windows",
        ("patch_windows",),
        {"radius": Picture((43, 128), 1e-9, 200.0), "coverage": Picture((43, 128), 1e-9, 1.0), "over": Choice((1, 2, 4))},
        run_patch_windows,
        "numbers are compared",
        most_ulps=0.0,
    ),
    StressCase(
        "lens_sampling",
        ("lens_sampling",),
        {"light": Picture((24, 32), 1e-30, 1e30), "radius_px": Real(-6.0, 6.0, switches=(0.0, 1.0))},
        run_lens_sampling,
        "places of six photosites are rounded to 2^-22, times the contrast of neighbours; read along two axes",
        most_ulps=24.0,
    ),
    StressCase(
        "lens_height_field",
        ("lens_height_field",),
        {"radius": Picture((24, 32), 1e-9, 8.0), "level": Real(1e-30, 1e30, log=True), "signs": Whole(0, 1000)},
        run_lens_height_field,
        "a compensated sum of equal numbers and one division",
        most_ulps=4.0,
    ),
    StressCase(
        "lens_deep",
        ("lens_deep",),
        {
            "fog": Real(1e-9, 1e9, log=True),
            "wall": Real(1e-9, 1e9, log=True),
            "alpha": Real(0.0, 1.0),
            "near_px": Real(-6.0, 6.0, switches=(0.0,)),
            "thick_px": Choice((0.0, 0.5, 4.0)),
            "behind_px": Real(0.1, 4.0),
        },
        run_lens_deep,
        "the share that each pixel on the way lets through is a power, whose product over the way loses 1e-5",
        most_sigma=0.5,
    ),
    StressCase(
        "psf",
        ("psf_gather", "psf_light", "psf_tail", "psf_extremes"),
        {
            "light": Picture((PSF_SIDE, PSF_SIDE), 1e-9, 1e3),
            "f_number": Real(2.0, 45.0, log=True, switches=(4.0, 8.0, 16.0, 22.0)),
            "low_pass_um": Choice((0.0, 2.5, 4.0)),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_psf,
        KEPT,
        most_sigma=0.5,
    ),
    StressCase(
        "psf_slabs",
        ("psf_slabs", "psf_own_slabs", "psf_slab_bits"),
        {
            "light": Picture((PSF_WALLS, PSF_WALLS), 1e-3, 1.0),
            "f_number": Choice((5.6, 8.0, 11.0)),
            "left_px": Real(-2.5, 2.5, switches=(0.0,)),
            "right_px": Real(-2.5, 2.5, switches=(0.0,)),
        },
        run_psf_slabs,
        KEPT,
        most_sigma=0.5,
    ),
)
