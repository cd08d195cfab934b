"""Cases of the kernels of the light that falls on the sensor: its colours, its share of the time, and the veil of the lens."""

from dataclasses import replace

import numpy as np

from simulator.device import Device
from simulator.exposure.exposed_light import ExposedLight, LightComponent
from simulator.exposure.light_curve import SteadyLight
from simulator.exposure.line_exposure import add_exposed_lines, expose_lines
from simulator.exposure.line_times import LineTimes
from simulator.optics.passes.camera_planes import camera_planes
from simulator.optics.passes.wings import add_wings
from simulator.optics.psf.wings import Wings
from simulator.optics.veiling_glare import LEAST_OPEN, VeilingGlare, add_veiling_glare
from simulator.scene.scene import Layer
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa
from simulator.sensor.kernel.kernel_launch import FrameSetting
from simulator.sensor.kernel.noise_free import mean_electrons
from simulator.sensor.stages.exposure import Integration
from simulator.sensor.stages.irradiance import Irradiance
from simulator.sensor.stages.registry import STAGES

from .inputs import COLUMNS, FRAME, ROWS, SHAPE, number, picture
from .search import Outcome, StressCase
from .space import Choice, Domain, Inputs, Picture, Real


def run_line_exposure(device: Device, inputs: Inputs) -> Outcome:
    axis = str(inputs["axis"])
    count = {"rows": ROWS, "columns": COLUMNS, "all": 1}[axis]
    lengths = np.maximum(picture(inputs, "lengths")[0, :count].astype(np.float64), 1e-30)
    lengths = lengths / lengths.max()
    zero = np.zeros(count)
    lines = LineTimes(axis, zero, zero, lengths, lengths, np.ones(count))  # type: ignore[arg-type]
    exposed = ExposedLight((LightComponent(False, SteadyLight(), (lines,), 0.0, 1.0),), axis, "")  # type: ignore[arg-type]
    mosaic = device.upload(picture(inputs))
    expose_lines(device, mosaic, FRAME, exposed, exposed.components[0])
    add_exposed_lines(device, mosaic, device.upload(picture(inputs, "flash")), FRAME, exposed, exposed.components[0])
    shares = np.minimum(lengths / lengths.max(), 1.0)
    shares = shares[:, None] if axis == "rows" else shares
    exact = (picture(inputs).astype(np.float64) + picture(inputs, "flash")) * shares
    return Outcome(device.download(mosaic, SHAPE, np.float32), exact)


def run_camera_planes(device: Device, inputs: Inputs) -> Outcome:
    planes = picture(inputs, "planes")
    weights = np.float32(number(inputs, "weight")) * picture(inputs, "weights")
    buffer = camera_planes(device, Layer(planes, 1.0), weights, False)
    found = device.download(buffer, (weights.shape[1], *planes.shape[:2]), np.float32)
    with np.errstate(over="ignore"):
        exact = np.einsum("yxb,bc->cyx", planes.astype(np.float64), weights.astype(np.float64))
    return Outcome(found, exact)


def irradiance_of(inputs: Inputs) -> Irradiance:
    """Return the lens of these inputs, whose axis meets the middle of a sensor: whole or half photosites."""
    shares = tuple(np.linspace(1.0, number(inputs, "corner_share"), 5).tolist())
    centre_px = 0.5 * round(2.0 * number(inputs, "centre_px"))
    return Irradiance(number(inputs, "solid_angle_sr"), number(inputs, "tan2_per_px2"), centre_px, 12.5, shares, 0.05)


def vignetting_size(lens: Irradiance, x: int, y: int) -> np.ndarray:
    """Return the fall-off without the vignetting: the share of the pupil is a difference of shares near 1."""
    return relative_illumination(replace(lens, vignetting=()), x, y) / lens.effective_solid_angle_sr


def relative_illumination(lens: Irradiance, x: int, y: int) -> np.ndarray:
    """Return irradiance over radiance of each photosite of a frame at (x, y) [sr], float64."""
    rows, columns = np.mgrid[y : y + ROWS, x : x + COLUMNS].astype(np.float64) + 0.5
    radius_px = np.hypot(columns - lens.centre_x_px, rows - lens.centre_y_px)
    return lens.effective_solid_angle_sr * np.asarray(lens.relative_illumination(radius_px))


LENS_SPACE: dict[str, Domain] = {
    "solid_angle_sr": Real(1e-8, 3.0, log=True),
    "tan2_per_px2": Real(1e-16, 1e-2, log=True),
    "centre_px": Real(-30.0, 6000.0, switches=(0.5, 18.0)),
    "corner_share": Real(0.0, 1.0),
    "x": Choice((0, 1, 4095, 65535, 2**24 - 1 - COLUMNS)),
    "y": Choice((0, 1, 8191)),
}


def run_veiling_glare(device: Device, inputs: Inputs) -> Outcome:
    """The veil is divided by the fall-off by which the light is multiplied later: what arrives on the sensor is compared."""
    lens, cfa = irradiance_of(inputs), Cfa.uniform(0)
    window = Window(int(number(inputs, "x")), int(number(inputs, "y")), COLUMNS, ROWS)
    veil, share, mosaic = number(inputs, "veil"), number(inputs, "share"), device.upload(picture(inputs))
    add_veiling_glare(device, mosaic, VeilingGlare(share, np.array([veil])), lens, cfa.macros(0, 0), window)
    arrived, stages = (
        device.empty(SHAPE, np.float32),
        (lens, Integration(1.0, 1.0), STAGES["analog_gain"](1.0), STAGES["adc"](8, 0.0)),
    )
    mean_electrons(device, mosaic, arrived, SHAPE, [FrameSetting(stages, x=window.x, y=window.y)])
    open_sr = relative_illumination(lens, window.x, window.y)
    with np.errstate(over="ignore"):
        veiled = veil * np.minimum(open_sr / (LEAST_OPEN * lens.effective_solid_angle_sr), 1.0)
        exact = (1.0 - share) * picture(inputs).astype(np.float64) * open_sr + veiled
    size = vignetting_size(lens, window.x, window.y) * lens.effective_solid_angle_sr * picture(inputs)
    fades = open_sr < 2.0 * LEAST_OPEN * lens.effective_solid_angle_sr  # with a share that is a difference of shares near 1
    return Outcome(device.download(arrived, SHAPE, np.float32), exact, size + np.where(fades, veil / LEAST_OPEN, veiled))


WING_CELLS = (14, 18)  # of which two on each side lie beyond the frame, with the largest cells


def run_wings(device: Device, inputs: Inputs) -> Outcome:
    """Bilinear between the cells' middles, of light that the host spread over them."""
    cell_px, x, y = (int(number(inputs, name)) for name in ("cell_px", "x", "y"))
    mosaic, pattern = device.upload(picture(inputs)), np.full((3, 3), number(inputs, "share") / 9.0)
    wings = Wings(picture(inputs, "cells")[..., None].astype(np.float64), cell_px, pattern, np.ones(1), 1.0)
    weights, window = np.ones((1, 1), np.float32), Window(x, y, COLUMNS, ROWS)
    add_wings(device, mosaic, wings, weights, Cfa.uniform(0).macros(0, 0), window)
    veil = wings.veil(weights)[0].astype(np.float64)
    down, across = (
        np.clip((first + np.arange(count) + 0.5) / cell_px + 0.5, 0.0, size - 1.0)
        for first, count, size in zip((y, x), SHAPE, veil.shape, strict=True)
    )
    top, left = (np.minimum(place.astype(int), size - 2) for place, size in zip((down, across), veil.shape, strict=True))
    row, column = (down - top)[:, None], across - left
    near = [[veil[np.ix_(top + j, left + i)] for i in (0, 1)] for j in (0, 1)]
    above, below = (one + column * (other - one) for one, other in near)
    kept = np.float64(np.float32(1.0 - pattern.sum())) * picture(inputs)
    size = kept + np.max([*near[0], *near[1]], axis=0)
    return Outcome(device.download(mosaic, SHAPE, np.float32), kept + above + row * (below - above), size)


CASES = (
    StressCase(
        "line_exposure",
        ("line_exposure", "add_line_exposure"),
        {
            "light": Picture(SHAPE, most=1e37),
            "flash": Picture(SHAPE, most=1e37),
            "lengths": Picture((1, COLUMNS), 1e-12, 1e6),
            "axis": Choice(("rows", "columns", "all")),
        },
        run_line_exposure,
        "shares of lines that differ by less than 1e-6 are 1: 16.8 ulps; two products and a sum",
        most_ulps=20.0,
    ),
    StressCase(
        "camera_planes",
        ("camera_planes",),
        {
            "planes": Picture((6, 9, 31), 1e-30, 1e18),
            "weights": Picture((31, 3), 1e-12, 1e3),
            "weight": Real(1e-6, 1e6, log=True),
        },
        run_camera_planes,
        "31 products and their sum in eights",
        most_ulps=32.0,
    ),
    StressCase(
        "wings",
        ("wings",),
        {
            "light": Picture(SHAPE, most=1e37),
            "cells": Picture(WING_CELLS, most=1e37),
            "share": Real(0.0, 0.3),
            "cell_px": Choice((4, 8, 32)),
            "x": Choice((0, 1, 7)),
            "y": Choice((0, 5)),
        },
        run_wings,
        "bilinear between four cells: 3 roundings of differences, products and sums each, and a product and a sum",
        most_ulps=6.0,
    ),
    StressCase(
        "veiling_glare",
        ("veiling_glare",),
        {"light": Picture(SHAPE, most=1e37), "veil": Real(1e-30, 1e25, log=True), "share": Real(0.0, 0.3), **LENS_SPACE},
        run_veiling_glare,
        "of cos^4: 17.8 roundings, of the vignetting 16, of reciprocal and products 8",
        most_ulps=45.0,
    ),
)
