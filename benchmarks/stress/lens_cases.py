"""Cases of the kernels behind a lens at rest: blur and rays."""

import math
from dataclasses import replace

import numpy as np
from helpers.area_truth import means_behind_a_near_surface, means_of_upright_layers
from helpers.lens_frame import case_plan, executed_case
from helpers.lens_truths import COLUMNS as TRUTH_COLUMNS
from helpers.lens_truths import Case, penumbra, point, stripes, uniform_layers
from helpers.textured_planes import one_picture
from scipy.ndimage import map_coordinates

from simulator.device import Device
from simulator.device.kernel_source import declared_struct, kernel_source
from simulator.optics.defocus.defocus import PATCH_COLUMNS, PATCH_ROWS, Defocus
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.geometry.projection import Projection
from simulator.optics.passes.patch_windows import PATCH_COLUMNS as PATCH_ACROSS
from simulator.optics.passes.patch_windows import PATCH_ROWS as PATCH_DOWN
from simulator.optics.passes.patch_windows import WINDOW_COLUMNS, WINDOW_ROWS, PatchWindows
from simulator.optics.passes.radius_statistics import measure_patches
from simulator.optics.ray_reference.deep_rays import DeepBlur, DeepPicture
from simulator.optics.ray_reference.height_field_rays import sample_height_field
from simulator.optics.ray_reference.layered_rays import ray_samples, sample_lens, upload_surfaces
from simulator.scene.deep_pixels import DeepPixels
from simulator.sensor.camera.camera_sections import Window

from .inputs import number, picture
from .place_cases import ELECTRONS, PROMISED, SCENE_SHAPE, area_outcome
from .search import Outcome, StressCase, promised_sigma
from .space import Choice, Domain, Inputs, Picture, Real, Whole

TOLERANCE = 0.1  # of the shots [sigma]
MARGIN = 8  # photosites that see past the scene
FINE_RADII = (0.0, 0.1, 0.25, 0.5, 1.0)  # steps of `scene_gather.RADIUS_STEP_PX`


def run_scene_gather(device: Device, inputs: Inputs) -> Outcome:
    return area_outcome(inputs, number(inputs, "scale"), number(inputs, "radius_px"), MARGIN)


def run_defocus(device: Device, inputs: Inputs) -> Outcome:
    radius_px = number(inputs, "radius_px")
    margin = math.ceil(radius_px) + 3
    return area_outcome(inputs, 2.0, radius_px, margin, (40, 48))


def run_mixed_squares(device: Device, inputs: Inputs) -> Outcome:
    """Pixels that no samples divide, gathered one by one or mixed in samples."""
    radius_px = number(inputs, "radius_px")
    return area_outcome(inputs, 2.5, radius_px, math.ceil(radius_px) + 3, (40, 48))


def run_lamps_in_the_dark(device: Device, inputs: Inputs) -> Outcome:
    """One lamp over black, or one beside a fainter one, out of focus, at any place of a photosite; other light is far away.

    Large frames have so many photosites that no quantile of the light holds lamps, small ones so few that one does.
    """
    scale, shape = number(inputs, "scale"), (48, 56) if inputs["frame"] == "large" else (12, 16)
    light = np.zeros([round(scale * side) for side in shape], np.float32)
    light[tuple(slice(round(scale), round(scale * side / 5)) for side in shape)] = number(inputs, "other")
    row, column = len(light) // 2 + int(number(inputs, "down")), len(light[0]) // 2 + int(number(inputs, "right"))
    light[row, column : column + 2] = 1.0, number(inputs, "second")
    return area_outcome({**inputs, "light": light}, scale, number(inputs, "radius_px"), 0, shape, chords=2048)


def of_squares(case: Case) -> Case:
    """Return a near surface before a sharp one with the picture of its even squares, which hold no slanted edge as such."""
    means = means_behind_a_near_surface(
        case.colour[0], case.coverage[0], case.colour[1], float(case.radius_px[0, 0, 0]), case.oversampling
    )
    inner = slice(case.margin, -case.margin)
    return replace(case, truth=means[inner, inner])


def of_upright_squares(case: Case) -> Case:
    """Return two surfaces that vary from left to right alone with the picture of their even squares, which hold no wave."""
    row = case.oversampling * case.margin
    lines = case.colour[:, row], case.coverage[0, row], case.radius_px[:, row, 0]
    means = means_of_upright_layers(*lines, case.oversampling)[case.margin : -case.margin]
    return replace(case, truth=np.broadcast_to(means, case.truth.shape))


def closed_form(inputs: Inputs) -> Case:
    """Return a scene of two surfaces whose picture is known."""
    near, far = number(inputs, "near_px"), number(inputs, "far_px")
    if inputs["kind"] == "penumbra":
        return of_squares(penumbra(near, number(inputs, "slope"), 2))
    if inputs["kind"] == "stripes":
        return of_upright_squares(stripes(near, near + abs(far) + 0.5, number(inputs, "period_px"), 2))
    layers = uniform_layers(near, near + abs(far) + 0.5, 2)
    return replace(layers, radius_px=leaning(layers.radius_px, LEAN * number(inputs, "slope")))


def leaning(radius_px: np.ndarray, lean: float) -> np.ndarray:
    """Return the radii of layers (layers, rows, columns), of which the last grows by so much from column to column."""
    grown = radius_px.copy()
    grown[-1] += lean * np.arange(radius_px.shape[-1])
    return grown


def outcome_of(case: Case, electrons: float, hidden: str = "none", columns: slice = slice(None)) -> Outcome:
    """Electrons of a case's photosites."""
    planned = case_plan(case, electrons, TOLERANCE, hidden)  # type: ignore[arg-type]
    found, promised = executed_case(case, planned)[:, columns].astype(np.float64), promised_sigma(planned)
    return Outcome(electrons * found, electrons * case.truth[:, columns], promised_sigma=promised)


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
    over, rows, columns = int(number(inputs, "over")), 43, 128
    layout, shape = InterleavedColumns(over, over * rows, columns // 2), (over * rows, over * columns)
    radius = np.resize(picture(inputs, "radius"), shape)
    coverage = np.resize(picture(inputs, "coverage"), shape)
    planes = layout.encode(np.stack([coverage, coverage]))
    measured = PatchWindows(device, layout, Defocus((radius,), True, 1.0), {"OVER": over, "COVERAGE": 1})
    band = {"sample_rows": layout.rows, "set_columns": layout.set_columns, "frame_x": 0, "frame_y": 0, "width": 1}
    band |= {"height": 1, "light_row": 0, "channels": 1, "cfa": 0}
    measured.measure(device.upload(planes), device.upload(layout.encode(radius[None])), band)
    window = declared_struct(kernel_source("patch_windows.h"), "patch_window")
    found = device.download(measured.windows, (1, measured.rows, measured.columns), window)[0]
    exact = np.zeros((3, measured.rows, measured.columns))
    for row, column in np.ndindex(measured.rows, measured.columns):
        first, left = row * over * PATCH_DOWN, column * over * PATCH_ACROSS
        held = slice(first, first + WINDOW_ROWS * over * PATCH_DOWN), slice(left, left + WINDOW_COLUMNS * over * PATCH_ACROSS)
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


LEAN = 0.05  # growth of the radius of a wall, from sample to sample [photosites], whose even light does not show it
SURFACES: dict[str, Domain] = {
    "kind": Choice(("penumbra", "stripes", "layers")),
    "near_px": Real(-14.0, -1.5, switches=(-2.0, -4.0, -8.0)),  # samples of half a photosite hold no smaller penumbra
    "far_px": Real(0.3, 14.0, switches=(1.0, 2.0, 4.0, 8.0)),
    "slope": Choice((0.0, 0.3, 1.0)),
    "period_px": Real(9.0, 24.0),
    "electrons": Real(5.0, 2e4, log=True),
}

CASES = (
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
        PROMISED,
        keeps=True,
    ),
    StressCase(
        "defocus",
        ("defocus_sums", "defocus_mean"),
        {
            "light": Picture((80, 96), 1e-9, 1e3),
            "radius_px": Real(0.05, 12.0, switches=(*FINE_RADII[1:], 2.0, 4.0, 8.0)),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_defocus,
        PROMISED,
        keeps=True,
    ),
    StressCase(
        "mixed_squares",
        ("defocus_mean", "scene_gather"),
        {
            "light": Picture((100, 120), 1e-9, 1e3),
            "radius_px": Real(0.05, 12.0, switches=(*FINE_RADII[1:], 1.5, 2.0, 4.0)),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_mixed_squares,
        PROMISED,
        keeps=True,
    ),
    StressCase(
        "lamps_in_the_dark",
        ("scene_gather", "defocus_sums", "defocus_mean"),
        {
            "scale": Choice((1.0, 1.25, 1.5, 2.0, 2.5, 4.0)),
            "frame": Choice(("large", "small")),
            "other": Choice((0.0, 1e-5, 1e-3)),
            "down": Whole(0, 3),
            "right": Whole(0, 3),
            "second": Choice((0.0, 1e-3, 0.7)),
            "radius_px": Real(0.2, 14.0, log=True, switches=(*FINE_RADII[2:], 1.5, 2.0, 4.0)),
            "electrons": Real(1e2, 1e7, log=True),
        },
        run_lamps_in_the_dark,
        PROMISED,
        keeps=True,
    ),
    StressCase("occlusion", ("occlusion", "layer_covariance"), SURFACES, run_occlusion, PROMISED, keeps=True),
    StressCase(
        "highlights",
        ("highlights_mark", "highlights_take", "highlights_spread"),
        {"radius_px": Real(0.5, 10.0, switches=(1.0, 2.0)), "light": Real(1.0, 1e8, log=True), "electrons": ELECTRONS},
        run_highlights,
        PROMISED + "; half a sigma is chosen: the budget does not tell that the disk of such a lamp is exact",
        most_sigma=0.5,
        keeps=True,
    ),
    StressCase(
        "wide_blur",
        ("wide_blur",),
        {"near_px": Real(28.0, 80.0, switches=(32.0, 64.0)), "far_share": Real(0.3, 0.9), "electrons": ELECTRONS},
        run_wide_blur,
        PROMISED,
        keeps=True,
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
        ("patch_content", "patch_windows"),
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
)
