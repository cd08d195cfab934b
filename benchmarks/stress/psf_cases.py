"""Cases of the kernels of point spread functions."""

import math
from dataclasses import replace

import numpy as np
from helpers.aberrated_walls import SPHERICAL, depth_map, thin_lens
from helpers.camera_builders import green_camera
from helpers.green_frames import EXPOSURE
from helpers.kernels_alone import without_wings
from helpers.psf_frames import shot_of
from helpers.scene_builders import band_scene
from scipy.signal import fftconvolve

from simulator.device import Device
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.execution import expose
from simulator.pipeline.planner import Plan, measure, plan
from simulator.pipeline.shot import Shot

from .inputs import number, picture
from .place_cases import KEPT
from .search import Outcome, StressCase
from .space import Choice, Inputs, Picture, Real

PSF_SIDE, PSF_MARGIN, PSF_WALLS = 96, 64, 160


def run_psf(device: Device, inputs: Inputs) -> Outcome:
    """A chart through diffraction and a low-pass filter, against SciPy's convolution with the planned kernel."""
    planes = picture(inputs).astype(np.float64)
    low_pass = number(inputs, "low_pass_um")
    planned, found = frame_of(device, planes, inputs, "nearest", **({"low_pass_um": low_pass} if low_pass else {}))
    truth = planes if planned.optics.psf is None else spread_light(planned.optics, planes)
    electrons = number(inputs, "electrons")
    return Outcome(electrons * found, electrons * truth)


def run_psf_highlights(device: Device, inputs: Inputs) -> Outcome:
    """A photograph with highlights and no lamps through diffraction: what rings is clipped for light above the limit."""
    planes = picture(inputs).astype(np.float64)
    planned, found = frame_of(device, planes, inputs, "bilinear")
    psf, weight, electrons = planned.optics.psf, float(planned.optics.weights.sum()), number(inputs, "electrons")
    if psf is None or planned.optics.lamps is not None:
        return Outcome(np.zeros(1), np.zeros(1))
    dim = np.minimum(planes, psf.highlight_limits[0] / weight) if psf.has_ringing(0, 0) else planes
    parts = ((dim, False), (planes - dim, True))
    truth = sum(spread_by(psf.kernel(0, 0, positive, 0, 0).sum(axis=0), light) for light, positive in parts)
    return Outcome(electrons * found, electrons * np.maximum(truth, 0.0))


def frame_of(
    device: Device, planes: np.ndarray, inputs: Inputs, interpolation: str, **settings: float
) -> tuple[Plan, np.ndarray]:
    """Plan of a scene in focus of one pixel per photosite, by kernels alone; its light in units of planes, float64."""
    camera = green_camera(PSF_SIDE, PSF_SIDE, **settings)
    through = ThinLens(50.0, number(inputs, "f_number"), cos4=False, diffraction=True)
    shot = Shot(band_scene(planes, math.inf, interpolation=interpolation), through, EXPOSURE, camera)
    unit = plan(shot).optics
    per_plane = float(unit.accuracy.electrons_per_radiance * unit.weights.sum())
    exposure = replace(EXPOSURE, time_s=EXPOSURE.time_s * number(inputs, "electrons") / per_plane)
    planned = measure(without_wings(plan(replace(shot, exposure=exposure))), device)
    light = device.download(expose(planned, device), (PSF_SIDE, PSF_SIDE), np.float32)
    return planned, light.astype(np.float64) / float(planned.optics.weights.sum())


def spread_by(kernel: np.ndarray, light: np.ndarray) -> np.ndarray:
    """Light that goes on as it ends, convolved with a kernel."""
    found = fftconvolve(np.pad(light, PSF_MARGIN, mode="edge"), kernel, mode="same")
    return np.asarray(found[PSF_MARGIN:-PSF_MARGIN, PSF_MARGIN:-PSF_MARGIN])


def spread_light(optics: OpticsPlan, planes: np.ndarray) -> np.ndarray:
    """Light (rows, columns) behind a planned point spread function in focus, of a scene of one plane and pixel per photosite.

    Its pixels are even squares. Lamps are added to what the others leave, which is not negative.
    """
    psf, weight = optics.psf, float(optics.weights.sum())
    assert psf is not None and psf.even_squares
    picture, lamps = planes.copy(), np.zeros(planes.shape)
    if optics.lamps is not None:
        place = optics.lamps.rows, optics.lamps.columns
        kept, drawn = optics.lamps.split(planes[..., None], optics.weights)
        picture[place], lamps[place] = kept[:, 0] / weight, drawn[:, 0] / weight
    kernel = psf.kernel(0, 0, False, 0, 0).sum(axis=0)
    return sum(np.maximum(spread_by(kernel, light), 0.0) for light in (picture, lamps))


BESIDE_STEP_PX = 24  # photosites beside the step between two walls, whose light mixes


def run_psf_slabs(device: Device, inputs: Inputs) -> Outcome:
    """Two walls side by side through an aberrated lens, each against SciPy's convolution with the kernel of its radius.

    No light is a highlight, whose kernels have no negative values (`FieldPsf.highlight_limits`).
    """
    planes = 0.3 + 0.7 * np.minimum(picture(inputs).astype(np.float64), 1.0)
    radii_px = number(inputs, "left_px"), number(inputs, "right_px")
    through = thin_lens(number(inputs, "f_number"), SPHERICAL)
    shot = shot_of(planes, through, depth_map(through, *radii_px))
    planned = measure(without_wings(plan(shot)), device)
    light = device.download(expose(planned, device), planes.shape, np.float32).astype(np.float64)
    psf, middle = planned.optics.psf, PSF_WALLS // 2
    walls = slice(0, middle - BESIDE_STEP_PX), slice(middle + BESIDE_STEP_PX, None)
    found, truth = [], []
    for radius_px, columns in zip(radii_px, walls, strict=True):
        if psf is None or not psf.is_gathered_by_distance:
            break  # of walls alike, which other kernels compute
        kernel = replace(psf, radii_px=(radius_px,), core=None).kernel(0, 0, False, 0, 0)[0]
        truth.append(np.maximum(spread_by(kernel, planes)[:, columns], 0.0))
        found.append(light[:, columns])
    if not found:
        return Outcome(np.zeros(1), np.zeros(1))
    each_e = planned.optics.accuracy.electrons_per_radiance
    exact = each_e * float(planned.optics.weights.sum()) * np.concatenate(truth, axis=1)
    return Outcome(each_e * np.concatenate(found, axis=1), exact)


CASES = (
    StressCase(
        "psf",
        ("psf_gather", "psf_cells", "psf_tail", "lamps"),
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
        "psf_highlights",
        ("psf_extremes",),
        {
            "light": Picture((PSF_SIDE, PSF_SIDE), 0.05, 1.0),
            "f_number": Real(1.4, 11.0, log=True, switches=(2.8, 4.0, 8.0)),
            "electrons": Real(5.0, 2e4, log=True),
        },
        run_psf_highlights,
        KEPT,
        most_sigma=0.5,
    ),
    StressCase(
        "psf_slabs",
        ("psf_slabs", "psf_own_slabs", "psf_slab_bits", "psf_slab_places"),
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
