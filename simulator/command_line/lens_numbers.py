"""What a lens amounts to, in numbers with their formulas, for `photosite lens` and the table Lens of `photosite explain`."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from simulator.command_line.shot_numbers import Fact
from simulator.exposure.exposure_value import exposure_value, exposure_value_100
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.perspective import GREEN_NM, crop_factor
from simulator.optics.lens.pinhole import RAYLEIGH, SHARPEST, Pinhole
from simulator.optics.lens.thin_lens import CIRCLES_PER_DIAGONAL, ThinLens
from simulator.optics.optics_plan import OpticsPlan
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Camera
from simulator.sensor.stages.irradiance import Irradiance

BLOCK_PX = 2.0  # a blur circle within one 2x2 block of the filter mosaic cannot be seen in the raw file
_PREFIXES = {"f_number": "f/", "f_number_35mm": "f/", "working_f_number": "f/", "t_number": "T/"}


@dataclass(frozen=True)
class LensNumber:
    """A number of a lens.

    key: name with the unit at its end, for files. quantity: name for people.
    value: in `unit`; inf where nothing limits it. unit: "" for a ratio.
    formula: where the value comes from.
    at_m: distance of the point from the lens that it belongs to [m]; None: of the lens as it is focused.
    """

    key: str
    quantity: str
    value: float
    unit: str
    formula: str
    at_m: float | None = None


@singledispatch
def list_numbers(lens: Lens, sensor_mm: tuple[float, float], distances_m: Iterable[float] = ()) -> list[LensNumber]:
    """Return all numbers of a lens; each kind of lens is registered below.

    sensor_mm: width and height of the sensor [mm]. distances_m: of points whose blur circles are wanted [m]; inf is allowed.
    """
    raise NotImplementedError(type(lens).__name__)


@list_numbers.register
def _list_bare_sensor_numbers(
    lens: BareSensor, sensor_mm: tuple[float, float], distances_m: Iterable[float] = ()
) -> list[LensNumber]:
    formula = "pi, of a hemisphere of one radiance; the notes say how much of it the scene fills"
    return [*_sensor_numbers(sensor_mm), _irradiance_number(lens, formula)]


@list_numbers.register
def _list_pinhole_numbers(lens: Pinhole, sensor_mm: tuple[float, float], distances_m: Iterable[float] = ()) -> list[LensNumber]:
    at = f"at {GREEN_NM:g} nm"
    advised = f"half of the light in the smallest circle: {SHARPEST:.3f} sqrt(lambda v) {at}"
    rayleigh_mm = lens.sharpest_diameter_mm(constant=RAYLEIGH)
    return [
        *_sensor_numbers(sensor_mm),
        LensNumber("pupil_diameter_mm", "hole", lens.diameter_mm, "mm", "d"),
        LensNumber("f_number", "f-number", lens.f_number, "", "N = v / d"),
        LensNumber("image_distance_mm", "image distance", lens.distance_mm, "mm", "v, hole to sensor"),
        *_perspective_numbers(lens, sensor_mm),
        *_list_blur(lens, distances_m, "d (1 + v / z)"),
        _airy_number(lens, f"2.44 lambda N {at}, N = v / d = {lens.f_number:.4g}"),
        LensNumber("sharpest_diameter_mm", "sharpest hole", lens.sharpest_diameter_mm(), "mm", advised),
        LensNumber("rayleigh_diameter_mm", "sharpest, Rayleigh", rayleigh_mm, "mm", f"{RAYLEIGH} sqrt(lambda v) {at}"),
        _irradiance_number(lens, "pi / (1 + 4 N^2)"),
    ]


@list_numbers.register
def _list_thin_lens_numbers(
    lens: ThinLens, sensor_mm: tuple[float, float], distances_m: Iterable[float] = ()
) -> list[LensNumber]:
    transmittance = f"T = N / sqrt(tau), tau = {lens.effective_transmittance:.4g}"
    return [
        *_sensor_numbers(sensor_mm),
        LensNumber("focal_length_mm", "focal length", lens.focal_length_mm, "mm", "f"),
        LensNumber("f_number", "f-number", lens.f_number, "", "N"),
        LensNumber("pupil_diameter_mm", "pupil diameter", lens.pupil_diameter_mm, "mm", "A = f / N"),
        LensNumber("focus_distance_m", "focus distance", lens.focus_distance_m, "m", "z_o, lens to the plane in focus"),
        LensNumber("image_distance_mm", "image distance", lens.image_distance_mm, "mm", "1/f = 1/z_i + 1/z_o"),
        LensNumber("magnification", "magnification", lens.magnification, "", "m = z_i / z_o"),
        *_perspective_numbers(lens, sensor_mm),
        *_list_field(lens, sensor_mm),
        *_list_depth(lens, math.hypot(*sensor_mm)),
        *_list_blur(lens, distances_m, "C = A z_i |1/z_focus - 1/z|"),
        _airy_number(lens, f"2.44 lambda N_w at {GREEN_NM:g} nm"),
        LensNumber("working_f_number", "working f-number", lens.working_f_number, "", "N_w = N (1 + m)"),
        LensNumber("t_number", "T-stop", lens.t_number, "", transmittance),
        _irradiance_number(lens, _irradiance_formula(lens.irradiance)),
    ]


def _sensor_numbers(sensor_mm: tuple[float, float]) -> list[LensNumber]:
    diagonal_mm = math.hypot(*sensor_mm)
    return [
        LensNumber("sensor_width_mm", "sensor, width", sensor_mm[0], "mm", "w"),
        LensNumber("sensor_height_mm", "sensor, height", sensor_mm[1], "mm", "h"),
        LensNumber("sensor_diagonal_mm", "sensor, diagonal", diagonal_mm, "mm", "sqrt(w^2 + h^2)"),
        LensNumber("crop_factor", "crop factor", crop_factor(diagonal_mm), "", "43.27 mm / diagonal"),
    ]


def _perspective_numbers(lens: ThinLens | Pinhole, sensor_mm: tuple[float, float]) -> list[LensNumber]:
    """Field of view, and what sees and gathers the same on 36 mm x 24 mm."""
    diagonal_mm = math.hypot(*sensor_mm)
    extents = {"horizontal": sensor_mm[0], "vertical": sensor_mm[1], "diagonal": diagonal_mm}
    same = f"f and N times the crop factor 43.27 mm / diagonal = {crop_factor(diagonal_mm):.3f}"
    return [
        *(
            LensNumber(
                f"field_of_view_{way}_deg",
                f"field of view, {way}",
                lens.field_of_view_deg(extent_mm),
                "deg",
                "2 atan(extent / 2 z_i)",
            )
            for way, extent_mm in extents.items()
        ),
        LensNumber(
            "focal_length_35mm_mm", "35 mm equivalent, focal length", lens.focal_length_35mm_mm(diagonal_mm), "mm", same
        ),
        LensNumber("f_number_35mm", "35 mm equivalent, f-number", lens.f_number_35mm(diagonal_mm), "", same),
    ]


def _list_field(lens: ThinLens, sensor_mm: tuple[float, float]) -> list[LensNumber]:
    """Return what the sensor sees of the plane in focus."""
    return [
        LensNumber(
            f"field_{way}_m", f"field in focus, {way}", lens.field_m(extent_mm, lens.focus_distance_m), "m", "extent / m"
        )
        for way, extent_mm in zip(("width", "height"), sensor_mm, strict=True)
    ]


def _list_depth(lens: ThinLens, diagonal_mm: float) -> list[LensNumber]:
    circle_um = lens.circle_um(diagonal_mm)
    near_m, far_m = lens.depth_of_field_m(circle_um)
    formula = "as stated" if lens.circle_of_confusion_um is not None else f"diagonal / {CIRCLES_PER_DIAGONAL:g} (Lyon 2006)"
    limits = "1/z = 1/z_focus +- C / (A z_i)"
    return [
        LensNumber("circle_of_confusion_um", "circle of confusion", circle_um, "um", formula),
        LensNumber("near_limit_m", "near limit", near_m, "m", limits),
        LensNumber("far_limit_m", "far limit", far_m, "m", limits),
        LensNumber("depth_of_field_m", "depth of field", far_m - near_m, "m", "far limit - near limit"),
        LensNumber("hyperfocal_distance_m", "hyperfocal distance", lens.hyperfocal_m(circle_um), "m", "f^2 / (N C) + f"),
    ]


def _list_blur(lens: ThinLens | Pinhole, distances_m: Iterable[float], formula: str) -> list[LensNumber]:
    """Return the diameter of the blur circle of a point at each distance."""
    return [
        LensNumber(
            "blur_circle_um",
            f"blur circle at {metres(distance_m)}",
            2.0 * abs(float(lens.blur_radius_um(distance_m))),
            "um",
            formula,
            distance_m,
        )
        for distance_m in distances_m
    ]


def _airy_number(lens: ThinLens | Pinhole, formula: str) -> LensNumber:
    return LensNumber("airy_disk_um", "Airy disk", lens.airy_diameter_um(), "um", formula)


def _irradiance_number(lens: Lens, formula: str) -> LensNumber:
    value_sr = lens.irradiance_per_radiance_sr()
    return LensNumber("irradiance_per_radiance_sr", "irradiance per radiance", value_sr, "sr", formula)


def exposure_value_numbers(f_number: float, time_s: float, iso: int) -> list[LensNumber]:
    """Return the exposure values of an f-number and an exposure time."""
    formula = f"EV - log2(ISO / 100), ISO {iso}"
    return [
        LensNumber("exposure_value", "EV", exposure_value(f_number, time_s), "EV", "log2(N^2 / t)"),
        LensNumber("exposure_value_100", "EV at ISO 100", exposure_value_100(f_number, time_s, iso), "EV", formula),
    ]


def write_number(number: LensNumber, pitch_um: float | None = None) -> str:
    """Return a number with its unit for a table. pitch_um: to show sizes on the sensor in photosites, too."""
    value = number.value
    match number.unit:
        case "m":
            return metres(value)
        case "um":
            return f"{value:.4g} um" if pitch_um is None else size(value, pitch_um)
        case "deg" | "EV":
            return f"{value:.2f} {number.unit}"
        case _:
            return f"{_PREFIXES.get(number.key, '')}{value:.5g} {number.unit}".strip()


def lens_facts(shot: Shot, planned: Plan) -> list[Fact]:
    """Geometry, depth of field, blur and light gathering of the shot's lens."""
    lens, camera = shot.lens, shot.camera
    numbers = {number.key: number for number in list_numbers(lens, camera.sensor_mm)}
    corner = [_corner_fact(camera, planned.sensor.irradiance)]
    return [*_facts(lens, numbers, shot, planned.optics), *(corner if lens.forms_image else []), *_filter_facts(lens)]


def _filter_facts(lens: Lens) -> list[Fact]:
    """Grey filter before the lens; nothing without one."""
    if lens.nd_filter is None:
        return []
    share = lens.nd_filter.transmittance
    formula = f"10^-D, D = {-math.log10(share):.4g}: {100 * share:.4g} % of the light passes"
    return [Fact("ND filter", f"{-math.log2(share):.3f} stops", formula)]


@singledispatch
def _facts(lens: Lens, numbers: dict[str, LensNumber], shot: Shot, optics: OpticsPlan) -> list[Fact]:
    """Facts of one kind of lens; each kind is registered below."""
    raise NotImplementedError(type(lens).__name__)


@_facts.register
def _bare_sensor_facts(lens: BareSensor, numbers: dict[str, LensNumber], shot: Shot, optics: OpticsPlan) -> list[Fact]:
    return [_fact(numbers["irradiance_per_radiance_sr"], "{:.6g} sr")]


@_facts.register
def _pinhole_facts(lens: Pinhole, numbers: dict[str, LensNumber], shot: Shot, optics: OpticsPlan) -> list[Fact]:
    pitch_um = shot.camera.pixel_pitch_um
    return [
        _fact(numbers["pupil_diameter_mm"], "{:g} mm"),
        _fact(numbers["image_distance_mm"], "{:g} mm"),
        *_perspective_facts(numbers),
        *_blur_facts(lens, optics, pitch_um),
        _size_fact(numbers["airy_disk_um"], pitch_um),
        _fact(numbers["sharpest_diameter_mm"], "{:.3f} mm"),
        _fact(numbers["rayleigh_diameter_mm"], "{:.3f} mm"),
        _fact(numbers["irradiance_per_radiance_sr"], "{:.4g} sr"),
    ]


@_facts.register
def _thin_lens_facts(lens: ThinLens, numbers: dict[str, LensNumber], shot: Shot, optics: OpticsPlan) -> list[Fact]:
    pitch_um = shot.camera.pixel_pitch_um
    return [
        _fact(numbers["focal_length_mm"], "{:g} mm"),
        _fact(numbers["pupil_diameter_mm"], "{:.3f} mm"),
        _fact(numbers["image_distance_mm"], "{:.3f} mm"),
        _fact(numbers["magnification"], "{:.5f}"),
        *_perspective_facts(numbers),
        *_depth_facts(lens, numbers, pitch_um),
        *_blur_facts(lens, optics, pitch_um),
        _size_fact(numbers["airy_disk_um"], pitch_um),
        _fact(numbers["working_f_number"], "f/{:.4g}"),
        _fact(numbers["t_number"], "T/{:.4g}"),
        _fact(numbers["irradiance_per_radiance_sr"], "{:.6g} sr"),
    ]


def _fact(number: LensNumber, text: str) -> Fact:
    return Fact(number.quantity, text.format(number.value), number.formula)


def _size_fact(number: LensNumber, pitch_um: float) -> Fact:
    return Fact(number.quantity, size(number.value, pitch_um), number.formula)


def _perspective_facts(numbers: dict[str, LensNumber]) -> list[Fact]:
    across, down, diagonal = (numbers[f"field_of_view_{way}_deg"] for way in ("horizontal", "vertical", "diagonal"))
    view = f"{across.value:.2f} deg x {down.value:.2f} deg, diagonal {diagonal.value:.2f} deg"
    focal, f_number = numbers["focal_length_35mm_mm"], numbers["f_number_35mm"]
    same = f"{focal.value:.1f} mm f/{f_number.value:.3g}"
    return [Fact("field of view", view, across.formula), Fact("35 mm equivalent", same, focal.formula)]


def _depth_facts(lens: ThinLens, numbers: dict[str, LensNumber], pitch_um: float) -> list[Fact]:
    near, far = numbers["near_limit_m"], numbers["far_limit_m"]
    in_raw = lens.depth_of_field_m(BLOCK_PX * pitch_um)
    return [
        _size_fact(numbers["circle_of_confusion_um"], pitch_um),
        Fact("depth of field", _range((near.value, far.value)), near.formula),
        Fact("depth of field, raw", _range(in_raw), f"the same, C = {BLOCK_PX:g} photosites"),
        Fact("hyperfocal distance", metres(numbers["hyperfocal_distance_m"].value), numbers["hyperfocal_distance_m"].formula),
    ]


def _blur_facts(lens: ThinLens | Pinhole, optics: OpticsPlan, pitch_um: float) -> list[Fact]:
    """Blur circle at infinity and at the scene's nearest and farthest place."""
    depths_m = [layer.depth_m for layer in optics.scene.layers]
    near_m, far_m = min(float(np.min(depth_m)) for depth_m in depths_m), max(float(np.max(depth_m)) for depth_m in depths_m)
    distances = {metres(distance_m): distance_m for distance_m in (near_m, far_m, math.inf)}
    numbers = list_numbers(lens, (1.0, 1.0), distances.values())  # no blur circle depends on the size of the sensor
    return [_size_fact(number, pitch_um) for number in numbers if number.at_m is not None]


def _corner_fact(camera: Camera, stage: Irradiance) -> Fact:
    share = stage.relative_illumination(0.5 * math.hypot(camera.width_px, camera.height_px))
    factors = ["cos^4 of the field angle"] * (stage.tan2_per_px2 > 0) + ["open share of the pupil"] * bool(stage.vignetting)
    stops = f", {math.log2(share):.2f} stops" if 0 < share < 1 else ""
    return Fact("light in the corner", f"{100 * share:.2f} %{stops}", " * ".join(factors) or "as on the axis")


def size(diameter_um: float, pitch_um: float) -> str:
    """A diameter in micrometres and in photosites."""
    return f"{diameter_um:.4g} um, {diameter_um / pitch_um:.2f} photosites"


def metres(distance_m: float) -> str:
    """A distance; infinity in words."""
    return "infinity" if math.isinf(distance_m) else f"{distance_m:#.4g} m"


def _range(limits_m: tuple[float, float]) -> str:
    return " to ".join(map(metres, limits_m))


def _irradiance_formula(kind: str) -> str:
    return "pi tau / (1 + 4 N_w^2)" if kind == "thin_lens" else "pi tau / (4 N_w^2)"
