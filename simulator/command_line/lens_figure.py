"""Picture of a thin lens: Gauss's rays and the cones of light to scale, and the blur circle against the distance."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from simulator.measurement.report.figures import ALLOWED, FAILED, MEASURED, TRUTH, new_figure
from simulator.optics.lens.thin_lens import ThinLens

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

IMAGE_SHARE = 0.8  # height of the drawn image in half heights of the sensor
POINTS = ("#2e8b57", "#8e44ad", "#d98200", "#00838f")  # colours of points out of focus
_WIDTH_TO_HEIGHT = 2.0  # of a panel, about


def draw_lens(lens: ThinLens, sensor_mm: tuple[float, float], distances_m: Sequence[float], title: str) -> "Figure":
    """Return the picture: the whole path of the rays, the camera's side, the place of the sensor, and blur against distance.

    The first three have one scale along and across the axis. Rays run from left to right; the lens stands at 0.
    sensor_mm: width and height [mm]. distances_m: of points on the axis that are drawn out of focus [m]; inf is allowed.
    Raises PhotositeError when matplotlib is missing.
    """
    figure, (whole, camera, sensor, blur) = new_figure(2, 2, 13.0, 7.4)
    figure.suptitle(title, fontsize=12)
    shown_m = [distance for distance in distances_m if 1e3 * distance > lens.focal_length_mm]  # nearer points have no image
    _draw_whole(whole, lens, sensor_mm[1])
    _draw_camera(camera, lens, sensor_mm[1], shown_m)
    _draw_sensor(sensor, lens, sensor_mm[1], shown_m)
    _draw_blur(blur, lens, math.hypot(*sensor_mm), distances_m)
    return figure


def gauss_rays_mm(lens: ThinLens, image_mm: float) -> list[np.ndarray]:
    """Return Gauss's rays of a point in focus whose image lies `image_mm` below the axis: (points, 2) arrays of x and y [mm].

    Parallel to the axis and then through the rear focal point; straight through the middle of the lens; and through the front
    focal point and then parallel. Of a point at infinity only the last two can be drawn; they begin 3 f before the lens.
    """
    f_mm, z_i_mm = lens.focal_length_mm, lens.image_distance_mm
    if math.isinf(lens.focus_distance_m):
        slope = -image_mm / f_mm
        return [np.array([[-3 * f_mm, y - 3 * f_mm * slope], [0.0, y], [z_i_mm, -image_mm]]) for y in (0.0, -image_mm)]
    z_o_mm, object_mm = 1e3 * lens.focus_distance_m, image_mm / lens.magnification
    return [np.array([[-z_o_mm, object_mm], [0.0, y], [z_i_mm, -image_mm]]) for y in (object_mm, 0.0, -image_mm)]


def cone_mm(lens: ThinLens, distance_m: float) -> tuple[float, float]:
    """Return where a point on the axis has its image behind the lens, and half the width of its light on the sensor [mm]."""
    image_mm = 1.0 / (1.0 / lens.focal_length_mm - 1e-3 / distance_m)
    return image_mm, abs(float(lens.blur_radius_um(distance_m))) * 1e-3


def _draw_whole(axes: "Axes", lens: ThinLens, height_mm: float) -> None:
    """Draw object, lens and sensor; in metres where the object is a metre or more away."""
    f_mm, z_i_mm, image_mm = lens.focal_length_mm, lens.image_distance_mm, 0.5 * IMAGE_SHARE * height_mm
    rays = gauss_rays_mm(lens, image_mm)
    length_mm = float(-min(ray[0, 0] for ray in rays))
    scale, unit = (1e-3, "m") if length_mm >= 1e3 else (1.0, "mm")
    names = ("parallel, then through F'", "through the middle", "through F, then parallel")
    for ray, name, color in zip(rays, names[-len(rays) :], (MEASURED, TRUTH, FAILED)[-len(rays) :], strict=True):
        axes.plot(*(scale * ray).T, color=color, linewidth=1.1, label=name)
    top_mm = max(float(np.abs(ray[:, 1]).max()) for ray in rays)
    lens_mm = max(abs(float(ray[1, 1])) for ray in rays) + 0.5 * lens.pupil_diameter_mm
    _draw_arrow(axes, 0.0, -scale * lens_mm, scale * lens_mm, MEASURED, "<->")
    if math.isfinite(lens.focus_distance_m):
        _draw_arrow(axes, -scale * length_mm, 0.0, scale * float(rays[0][0, 1]), TRUTH, "->")
    axes.plot(
        [scale * z_i_mm] * 2,
        [-0.5 * scale * height_mm, 0.5 * scale * height_mm],
        color=TRUTH,
        linewidth=2.5,
        solid_capstyle="butt",
    )
    _mark_foci(axes, scale * f_mm)
    _scale_evenly(axes, (-1.05 * scale * length_mm, 1.05 * scale * z_i_mm + 0.03 * scale * length_mm), 1.15 * scale * top_mm)
    axes.set(xlabel=f"along the axis [{unit}]", ylabel=f"[{unit}]", title="Gauss's rays, object to sensor, to scale")
    axes.legend(fontsize=8, loc="lower left", frameon=False)


def _draw_camera(axes: "Axes", lens: ThinLens, height_mm: float, distances_m: Sequence[float]) -> None:
    """Draw the lens, the image of Gauss's rays, and the light of points on the axis."""
    f_mm, z_i_mm, image_mm = lens.focal_length_mm, lens.image_distance_mm, 0.5 * IMAGE_SHARE * height_mm
    edge_mm, half_mm = 0.5 * lens.pupil_diameter_mm, 0.5 * height_mm
    rays = gauss_rays_mm(lens, image_mm)
    for ray, color in zip(rays, (MEASURED, TRUTH, FAILED)[-len(rays) :], strict=True):
        axes.plot(*ray[1:].T, color=color, linewidth=1.0)
    _draw_arrow(axes, z_i_mm, 0.0, -image_mm, TRUTH, "->")
    axes.fill([0.0, z_i_mm, 0.0], [edge_mm, 0.0, -edge_mm], color=ALLOWED, label="from the point in focus")
    for distance_m, color in zip(distances_m, POINTS, strict=False):
        _draw_cone(axes, lens, distance_m, color, z_i_mm)
    axes.plot([z_i_mm] * 2, [-half_mm, half_mm], color=TRUTH, linewidth=2.5, solid_capstyle="butt")
    _draw_arrow(axes, 0.0, -1.1 * edge_mm, 1.1 * edge_mm, MEASURED, "<->")
    axes.annotate(f"A = {2 * edge_mm:.3g} mm", (0.0, edge_mm), (-6, 2), textcoords="offset points", ha="right", fontsize=8)
    _mark_foci(axes, f_mm)
    _scale_evenly(axes, (-0.45 * z_i_mm, 1.15 * z_i_mm), 1.15 * max(half_mm, edge_mm))
    axes.set(xlabel="along the axis [mm]", ylabel="[mm]", title=f"Lens to sensor, z_i = {z_i_mm:.4g} mm, to scale")


def _draw_sensor(axes: "Axes", lens: ThinLens, height_mm: float, distances_m: Sequence[float]) -> None:
    """Draw the light of points on the axis where it meets the sensor, large enough to see the blur circles."""
    z_i_mm, cones = lens.image_distance_mm, [cone_mm(lens, distance_m) for distance_m in distances_m]
    reach_mm = max([abs(image_mm - z_i_mm) for image_mm, _ in cones] + [1e-2 * z_i_mm])
    reach_mm = 1.6 * min(reach_mm, 0.5 * z_i_mm)
    end_mm, slope = z_i_mm + reach_mm, 0.5 * lens.pupil_diameter_mm / z_i_mm
    place = [z_i_mm - reach_mm, z_i_mm, end_mm]
    wide = np.array([reach_mm * slope, 0.0, reach_mm * slope])
    axes.fill_between(place, -wide, wide, color=ALLOWED, label=f"in focus, {_name(lens.focus_distance_m)}")
    for (image_mm, half_mm), distance_m, color in zip(cones, distances_m, POINTS, strict=False):
        _draw_cone(axes, lens, distance_m, color, end_mm)
        name = f"{_name(distance_m)}: C = {2e3 * half_mm:.4g} µm, image at {image_mm:.4g} mm"
        axes.plot([z_i_mm] * 2, [-half_mm, half_mm], color=color, linewidth=4.0, alpha=0.6, solid_capstyle="butt", label=name)
    axes.axvline(z_i_mm, color=TRUTH, linewidth=1.2)
    half_mm = max([half for _, half in cones] + [reach_mm * slope])
    _scale_evenly(axes, (z_i_mm - reach_mm, end_mm), min(1.5 * half_mm, reach_mm))
    axes.set(xlabel="along the axis [mm]", ylabel="[mm]", title="Blur circles at the sensor, to scale")
    axes.legend(fontsize=8, loc="upper left")


def _draw_blur(axes: "Axes", lens: ThinLens, diagonal_mm: float, distances_m: Sequence[float]) -> None:
    """Draw the diameter of the blur circle against the distance of the point."""
    circle_um = lens.circle_um(diagonal_mm)
    (near_m, far_m), hyperfocal_m, airy_um = (
        lens.depth_of_field_m(circle_um),
        lens.hyperfocal_m(circle_um),
        lens.airy_diameter_um(),
    )
    focus_m = lens.focus_distance_m
    middle_m = focus_m if math.isfinite(focus_m) else hyperfocal_m
    drawn_m = [distance for distance in distances_m if math.isfinite(distance)]
    low_m = max(0.7 * min([middle_m / 10, near_m / 2, *drawn_m]), 1.02e-3 * lens.focal_length_mm)
    high_m = 1.4 * max([middle_m * 20, 2 * far_m if math.isfinite(far_m) else 0.0, *drawn_m])
    along_m = np.unique(np.concatenate([np.geomspace(low_m, high_m, 600), middle_m * (1 + np.geomspace(1e-5, 0.5, 60))]))
    along_m = np.unique(np.concatenate([along_m, middle_m * (1 - np.geomspace(1e-5, 0.5, 60))]))
    along_m = along_m[(along_m >= low_m) & (along_m <= high_m)]
    blur_um = 2.0 * np.abs(np.asarray(lens.blur_radius_um(along_m)))
    floor_um = 0.2 * min(airy_um, circle_um)
    axes.axvspan(near_m, min(far_m, high_m), color=ALLOWED, label="depth of field")
    axes.plot(along_m, np.maximum(blur_um, 1e-3 * floor_um), color=MEASURED, label="blur circle")
    axes.axhline(circle_um, color=FAILED, linewidth=1.0, linestyle="--", label=f"circle of confusion {circle_um:.3g} µm")
    axes.axhline(airy_um, color=TRUTH, linewidth=1.0, linestyle=":", label=f"Airy disk {airy_um:.3g} µm")
    if low_m < hyperfocal_m < high_m:
        axes.axvline(
            hyperfocal_m, color=TRUTH, linewidth=0.8, linestyle="-.", label=f"hyperfocal distance {hyperfocal_m:.4g} m"
        )
    for distance_m, color in zip(drawn_m, POINTS, strict=False):
        axes.plot([distance_m], [2.0 * abs(float(lens.blur_radius_um(distance_m)))], "o", color=color)
    top_um = max(float(blur_um.max()), circle_um)
    axes.set(xscale="log", yscale="log", xlim=(low_m, high_m), ylim=(floor_um, 2.0 * top_um))
    axes.set(xlabel="distance of the point [m]", ylabel="diameter on the sensor [µm]", title="Blur circle against distance")
    steps = (1, 2, 5) if high_m / low_m < 100.0 else (1,)
    ticks = [step * 10.0**power for power in range(-4, 7) for step in steps]
    kept = [tick for tick in ticks if low_m <= tick <= high_m]
    axes.set_xticks(kept, [f"{tick:g}" for tick in kept])
    axes.tick_params(axis="x", which="minor", labelbottom=False)
    axes.yaxis.set_major_formatter("{x:g}")
    axes.tick_params(axis="y", which="minor", labelleft=False)
    axes.legend(fontsize=8, loc="best")


def _draw_cone(axes: "Axes", lens: ThinLens, distance_m: float, color: str, end_mm: float) -> None:
    """Draw the two rays of a point on the axis through the rim of the pupil, from the lens to `end_mm` behind it."""
    edge_mm = 0.5 * lens.pupil_diameter_mm
    image_mm, _ = cone_mm(lens, distance_m)
    stop_mm = edge_mm * (1.0 - end_mm / image_mm)
    for side in (-1.0, 1.0):
        axes.plot([0.0, end_mm], [side * edge_mm, side * stop_mm], color=color, linewidth=1.0)


def _draw_arrow(axes: "Axes", x: float, start: float, end: float, color: str, style: str) -> None:
    axes.annotate("", (x, end), (x, start), arrowprops={"arrowstyle": style, "color": color, "shrinkA": 0, "shrinkB": 0})


def _mark_foci(axes: "Axes", f: float) -> None:
    axes.axhline(0.0, color=TRUTH, linewidth=0.6)
    for place, name in ((-f, "F"), (f, "F'")):
        axes.plot([place], [0.0], "o", color=TRUTH, markersize=3.5)
        axes.annotate(name, (place, 0.0), (0, 5), textcoords="offset points", ha="center", fontsize=9, clip_on=True)


def _scale_evenly(axes: "Axes", across: tuple[float, float], half: float) -> None:
    """Set one scale along and across: the panel shows at least `across` and from -half to half, whichever needs more."""
    width, height = across[1] - across[0], 2.0 * half
    if width < _WIDTH_TO_HEIGHT * height:
        extra = 0.5 * (_WIDTH_TO_HEIGHT * height - width)
        across = across[0] - extra, across[1] + extra
    else:
        half = 0.5 * width / _WIDTH_TO_HEIGHT
    axes.set(xlim=across, ylim=(-half, half))
    axes.set_aspect("equal", adjustable="box")


def _name(distance_m: float) -> str:
    return "∞" if math.isinf(distance_m) else f"{distance_m:.4g} m"
