"""Projection of the scene's grid onto the sensor's photosites."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from simulator.device import Buffer, Device
from simulator.errors import PhotositeError
from simulator.optics.geometry.footprint import Footprint, footprint_of
from simulator.optics.geometry.footprint_projection import project_footprint, project_footprint_planes
from simulator.optics.geometry.interleaved_columns import InterleavedColumns
from simulator.optics.lens.distortion import Warp, plan_warp
from simulator.optics.lens.lens import Lens
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

ANY_CFA = Cfa.uniform(0).macros(0, 0)  # of kernels that compute all channels
UPRIGHT_PARTS = 4  # per axis of photosites that lean, as which they are blurred, or samples from which on these are upright
LEANING_PARTS = (1, 1.1), (2, 1.25)  # per axis, up to such an extent over the stretch, of photosites that are gathered
SEPARABLE = 0.5  # most scene pixels per sample and axis for which a plane is read across first, then down
UPRIGHT_PX = 1024  # columns that a work-item of kernels/upright_projection.cl has on a CPU, of the scene or of the sensor
UPRIGHT_ROWS = 16  # rows of photosites of it
SPAN = 16  # samples of a work-item on a CPU
EDGE_PX = 1.0  # difference in blur radius above which neighbouring scene pixels belong to two surfaces


@dataclass(frozen=True)
class Projection:
    """Resampling of the scene's grid by the photosites.

    A photosite is the exact mean of the scene over its area. In a scene finer than the photosites each pixel is an even square.
    A coarser scene is bilinear between the centres of its pixels, unless it asks for the nearest. At one scene pixel per
    photosite it is read at the middle of a photosite, which is the mean of even squares, too; behind a distortion, where
    photosites are no squares of pixels, it is bilinear light as that of a coarser scene.

    scale: scene pixels per photosite. offset_x, offset_y: scene position [px] of the sensor's upper left corner.
    scene_width, scene_height: of the scene's grid [px].
    samples: parts per photosite and axis that are averaged where the scene is coarse.
    nearest: pixels of a coarse scene are even squares, too, instead of light that is bilinear between them.
    stretch: largest local magnification of `warp` and `pose`.
    extent: largest width or height in the scene of what a photosite sees through them, over that of one that they do not turn.
    warp: distortion of the lens, applied before the scale; None: none.
    open_side: side of the light-sensitive square in the middle of a photosite [photosites] that `project` averages.
    low_pass_px: distance of a low-pass filter's spots on either axis [photosites]: rays see them, and a sharp image is the mean
        of its `spots`.
    edge_px: difference in blur radius above which neighbouring scene pixels belong to two surfaces [photosites].
    pose: of the camera, after `warp`: pivot x, y and displacement as kernels/scene_place.h has them; None: at rest.
    leans: whether it counts that photosites are parallelograms in the scene behind `warp` or `pose`, beside how large they are.
    cuts_pixels: whether pixels as wide as photosites, which lie between them, are even squares as those of a finer scene are.
    is_bilinear: whether photosites are means of light between the centres of pixels: those of a coarser scene, or of as many
        behind a distortion.
    footprints: squares over which `project`, and samples of `project_planes`, average light of each channel, or of all; nothing
        displaces it then. None: the photosite, or its sample.
    """

    scale: float
    offset_x: float
    offset_y: float
    scene_width: int
    scene_height: int
    samples: int
    nearest: bool
    warp: Warp | None = None
    stretch: float = 1.0
    extent: float = 1.0
    open_side: float = 1.0
    edge_px: float = EDGE_PX
    pose: tuple[float, ...] | None = None
    is_bilinear: bool = False
    low_pass_px: float = 0.0
    footprints: tuple[Footprint, ...] = ()
    leans: bool = True
    cuts_pixels: bool = False

    @property
    def fits_footprint(self) -> bool:
        """Whether light may be averaged over squares of a footprint."""
        return (self.is_bilinear or self.has_square_pixels) and not self.is_displaced

    def each_footprint(self, count: int) -> list[Footprint]:
        """Footprint of each of so many planes."""
        return [one for plane in range(count) if (one := footprint_of(self.footprints, plane)) is not None]

    def sample_footprints(self, count: int, over: int) -> list[Footprint]:
        """Footprint of each of so many planes, on `over` samples per photosite and axis; none where each reads its own pixels.

        Upright samples that borders of even squares cross are squares of their own width.
        """
        is_cut = not self.is_displaced and self.taps(1.0 / over) > 1
        return self.each_footprint(count) or [Footprint(side_px=1.0 / over)] * (count if is_cut else 0)

    @property
    def is_displaced(self) -> bool:
        """Whether a distortion or a pose displaces photosites in the scene."""
        return self.warp is not None or self.pose is not None

    @property
    def spots(self) -> list[tuple[float, float]]:
        """Places x, y of the four spots of the low-pass filter from the middle of a photosite [photosites]."""
        half = 0.5 * self.low_pass_px
        return [(x, y) for y in (-half, half) for x in (-half, half)]

    def at_spot(self, x_px: float, y_px: float) -> Self:
        """Return the resampling by photosites that lie so far from these, without a filter before them."""
        offset = self.offset_x + self.scale * x_px, self.offset_y + self.scale * y_px
        warp = None if self.warp is None else self.warp.at_spot(x_px, y_px)
        return replace(self, offset_x=offset[0], offset_y=offset[1], warp=warp, low_pass_px=0.0)

    def on_wider_photosites(self) -> Self:
        """Return the resampling of the same scene by photosites twice as wide, from the same corner of the sensor on."""
        warp = None if self.warp is None else self.warp.on_wider_photosites()
        samples = min(2 * self.samples, max(1, math.ceil(4.0 * self.scale)))  # more than two per scene pixel tell nothing
        wider = replace(self, scale=2.0 * self.scale, samples=samples, warp=warp, open_side=1.0, edge_px=0.5 * self.edge_px)
        if self.pose is None:
            return wider
        halved = np.array([0.5, 0.5, 0.5, 1.0, 1.0, 0.5, 1.0, 1.0, 2.0, 2.0]) * self.pose
        return replace(wider, pose=tuple(halved.tolist()))

    def on_samples(self, over: int) -> Self:
        """Return the resampling of a picture whose pixels are `over` x `over` samples of each photosite."""
        upright = replace(
            self, warp=None, pose=None, nearest=False, is_bilinear=False, cuts_pixels=False, stretch=1.0, extent=1.0
        )
        return replace(upright, scale=float(over), offset_x=0.0, offset_y=0.0, samples=over)

    @property
    def turn_rad(self) -> float:
        """Angle by which the pose turns steps on the sensor around its pivot, from the right downwards."""
        if self.pose is None:
            return 0.0
        _, _, _, across_x, across_y, _, down_x, down_y, _, _ = self.pose
        return math.atan2(down_x - across_y, 2.0 + across_x + down_y)

    @property
    def is_fine(self) -> bool:
        """Whether pixels are even squares that photosites cut: more than one per photosite and axis, or `cuts_pixels`."""
        return self.scale > 1.0 + 1e-6 or self.cuts_pixels

    @property
    def has_square_pixels(self) -> bool:
        """Whether pixels are even squares of light: those of a fine scene, and of one that asks for the nearest."""
        return self.is_fine or self.nearest

    @property
    def has_squares(self) -> bool:
        """Whether photosites see parts of pixels that are even squares; else light between the middles of these."""
        return self.has_square_pixels or (not self.is_bilinear and self.open_side < 1.0)

    @property
    def has_pixel_per_photosite(self) -> bool:
        """Whether pixels of the scene are as large as photosites, so that light between them bends at their middles.

        Means over photosites of a coarser scene bend by a third as much, by less than its edges.
        """
        return abs(self.scale - 1.0) < 1e-6

    @property
    def has_own_pixels(self) -> bool:
        """Whether each photosite has one pixel of the scene, as large as itself."""
        return self.has_pixel_per_photosite and self.whole_pixels([1]) == 1

    @property
    def lies_between_pixels(self) -> bool:
        """Whether photosites lie between pixels as large as themselves."""
        return self.has_pixel_per_photosite and not self.has_own_pixels

    @property
    def reads_pixels(self) -> bool:
        """Whether each photosite has one pixel of the scene, which is its light at its middle: no area counts."""
        return self.has_own_pixels and not self.is_bilinear and self.open_side == 1.0 and self.low_pass_px == 0.0

    def copies_pixels(self, over: int) -> bool:
        """Whether samples, `over` per photosite and axis, are pixels of the scene, one after the other."""
        is_whole = self.scale == 1.0 and self.offset_x == round(self.offset_x) and self.offset_y == round(self.offset_y)
        return over == 1 and is_whole and self.reads_pixels and not self.footprints and not self.nearest

    def copied_from(self, origin_x: int, origin_y: int) -> dict[str, int]:
        """Scalar arguments of kernels/pixel_planes.cl for an output whose first photosite is this one of the sensor."""
        left, top = origin_x + round(self.offset_x), origin_y + round(self.offset_y)
        return {"scene_width": self.scene_width, "scene_height": self.scene_height, "left": left, "top": top}

    def whole_pixels(self, counts: Sequence[int]) -> int:
        """First of these samples per photosite and axis that divides each scene pixel into whole samples; 0: none."""
        for count in () if self.is_displaced else counts:
            per_pixel = count / self.scale
            wholes = per_pixel, per_pixel * self.offset_x, per_pixel * self.offset_y
            if per_pixel > 0.5 and all(abs(number - round(number)) < 1e-4 for number in wholes):
                return count
        return 0

    def has_leaning(self, over: int) -> bool:
        """Whether samples, `over` per photosite and axis, are parallelograms of even squares."""
        return self.has_squares and self.is_displaced and self.leans and over < UPRIGHT_PARTS

    def taps(self, side: float, leans: bool = False) -> int:
        """Most scene pixels per axis that an area of this side [photosites] touches; 0 where they are no even squares.

        leans: it is a parallelogram.
        """
        if not self.has_squares:
            return 0
        wide = side * self.scale * (self.extent if leans else self.stretch)
        places = self.offset_x, self.offset_y, self.scale, side * self.scale
        begins_on_pixels = not self.is_displaced and self.open_side == 1.0 and all(place == round(place) for place in places)
        return math.ceil(wide - 1e-4) + (not begins_on_pixels)

    @property
    def leaning_parts(self) -> int:
        """Parts per axis of a photosite, in each of which what leans counts to the first order (kernels/scene_gather.cl)."""
        if not self.is_displaced or not self.leans:
            return 1
        return next((parts for parts, most in LEANING_PARTS if self.extent <= most * self.stretch), UPRIGHT_PARTS)

    def defines(self, cfa_macros: dict[str, object], over: int = 1, inset: float = 0.0) -> dict[str, object]:
        """Macros of kernels/projection.cl, for planes of `over` x `over` samples per photosite.

        cfa_macros: of kernels/cfa.h, for the output's upper left corner. inset: of a mosaic's open area [photosites].
        """
        leans = self.has_leaning(over)
        area = {"TAPS": self.taps((1.0 - 2.0 * inset) / over, leans), "LEANS": int(leans), "INSET": f"{inset:.9e}f"}
        distortion = {"DISTORTION": 0} if self.warp is None else {"DISTORTION": 1, **self.warp.macros()}
        return {
            "SAMPLES": -(-self.samples // over),
            "BENDS": int(self.is_bilinear and not self.is_fine),
            "OVER": over,
            "POSE": int(self.pose is not None),
            "EDGE": f"{self.edge_px:.9e}f",
            **area,
            **distortion,
            **cfa_macros,
        }

    def rests(self) -> np.ndarray:
        """Return what float32 leaves of scale, offset_x and offset_y, (3,) float32."""
        exact = np.array([self.scale, self.offset_x, self.offset_y])
        return (exact - exact.astype(np.float32)).astype(np.float32)

    def upload_pose(self, device: Device) -> Buffer:
        """Return the argument `pose` of kernels that project: (13,) float32, with what float32 leaves of scale and offsets."""
        pose = np.zeros(10) if self.pose is None else np.array(self.pose)
        return device.upload(np.concatenate([pose, self.rests()]).astype(np.float32))

    def is_separable(self, over: int) -> bool:
        """Whether samples, `over` per photosite and axis, are read bilinearly and at least two to a scene pixel and axis."""
        smooth = not self.is_displaced and not self.nearest and not self.is_fine
        return smooth and -(-self.samples // over) == 1 and self.scale <= SEPARABLE * over

    def scene_rows(self, first_px: float, rows_px: float) -> tuple[int, int]:
        """First scene row that rows of photosites read bilinearly, and how many; one more on each side, as kernels round."""
        first, last = (math.floor(self.offset_y + self.scale * place - 0.5) for place in (first_px, first_px + rows_px))
        low, high = (min(max(row, 0), self.scene_height - 1) for row in (first - 1, last + 2))
        return low, high - low + 1

    def arguments(self, origin_x: int, origin_y: int) -> dict[str, float]:
        """Scalar arguments of kernels/projection.cl for an output whose first photosite is this one of the sensor."""
        return {
            "scene_width": self.scene_width,
            "scene_height": self.scene_height,
            "origin_x": origin_x,
            "origin_y": origin_y,
            "scale": self.scale,
            "offset_x": self.offset_x,
            "offset_y": self.offset_y,
        }


def plan_projection(scene: Scene, lens: Lens, camera: Camera) -> Projection:
    """Geometry between scene pixels and photosites; the optical axis meets the centres of both.

    A scene with a field of view keeps its true size: scene pixels per radian of tangent over photosites per
    radian of tangent. Without one the picture is scaled to cover the sensor and cropped.
    Raises PhotositeError when the field of view of the camera exceeds the scene.
    """
    height, width = scene.planes.shape[:2]
    image_distance_px = 1e3 * lens.image_distance_mm / camera.pixel_pitch_um
    warp = plan_warp(lens.distortion, image_distance_px, camera.width_px, camera.height_px, camera.channels)
    stretch, extent = (1.0, 1.0) if warp is None else warp.extent(camera.width_px, camera.height_px)[2:]
    if scene.field_of_view_deg is None:
        scale = min(width / camera.width_px, height / camera.height_px)
    else:
        scale = _true_scale(scene, lens, camera)
        _check_coverage(scene, lens, camera)
    is_coarse = scale < (1.0 - 1e-6 if warp is None else 1.0 + 1e-6)
    return Projection(
        scale=scale,
        offset_x=0.5 * (width - scale * camera.width_px),
        offset_y=0.5 * (height - scale * camera.height_px),
        scene_width=width,
        scene_height=height,
        samples=max(1, math.ceil(scale * stretch - 1e-6)),
        nearest=scene.interpolation == "nearest",
        is_bilinear=is_coarse and scene.interpolation != "nearest",
        warp=warp,
        stretch=stretch,
        extent=extent,
    )


def tangent_per_pixel(scene: Scene, lens: Lens, camera: Camera) -> float:
    """Return the tangent of the angle from the axis per pixel of the scene, without distortion; 0 where nothing tells it.

    Raises PhotositeError as `plan_projection` does.
    """
    if scene.field_of_view_deg is not None:
        return 2.0 * math.tan(math.radians(0.5 * scene.field_of_view_deg)) / scene.planes.shape[1]
    if not lens.forms_image:
        return 0.0
    return 1e-3 * camera.pixel_pitch_um / (lens.image_distance_mm * plan_projection(scene, lens, camera).scale)


def project(device: Device, projection: Projection, cfa: Cfa, window: Window, planes: Buffer) -> Buffer:
    """Device buffer (height, width) float32: the sharp image of one surface in each photosite's own colour.

    planes: device buffer (channels, scene height, scene width) float32 [e- s^-1 um^-2 sr^-1]. window: photosites to compute.
    """
    mosaic = device.empty((window.height, window.width), np.float32)
    if projection.footprints:
        project_footprint(device, projection, projection.each_footprint(1 + max(cfa.colors)), cfa, window, planes, mosaic)
        return mosaic
    defines = projection.defines(cfa.macros(window.x, window.y), inset=0.5 * (1.0 - projection.open_side))
    arguments = {
        "planes": planes,
        "mosaic": mosaic,
        "pose": projection.upload_pose(device),
        **projection.arguments(window.x, window.y),
    }
    if projection.is_displaced:
        span = min(device.span, SPAN)
        kernel = device.kernel("projection_mosaic", {**defines, "SPAN": span}, file="projection.cl")
        device.run(kernel, (2 * -(-window.width // (2 * span)), window.height), None, width=window.width, **arguments)
        return mosaic
    pitch = max(1, math.ceil(projection.scale - 1e-6))
    span = 1 if device.span == 1 else max(UPRIGHT_PX // pitch, 16)
    parts = {"SPAN": span, "ROWS": UPRIGHT_ROWS, "PITCH": pitch, "COLORS": 1 + max(cfa.colors)}
    kernel = device.kernel("upright_projection", {**defines, **parts})
    size = -(-window.width // span), -(-window.height // UPRIGHT_ROWS)
    device.run(kernel, size, (1, 1) if span > 1 else None, width=window.width, rows=window.height, **arguments)
    return mosaic


def project_planes(
    device: Device,
    projection: Projection,
    planes: Buffer,
    count: int,
    sampled: Buffer,
    first_plane: int,
    layout: InterleavedColumns,
    origin: tuple[int, int],
    rows: int | None = None,
) -> None:
    """Enqueue the projection of all channels of one surface onto the samples of a layout.

    planes: device buffer (count, scene height, scene width) float32. sampled: buffer of the layout's planes, written from
    first_plane on. origin: photosite (x, y) of the sensor at the layout's first sample. rows: of samples, that are written from
    the first on; None: all.
    """
    if footprints := projection.sample_footprints(count, layout.over):
        project_footprint_planes(device, projection, footprints, planes, sampled, first_plane, layout, origin, rows)
        return
    span, settings = _span(device, layout), projection.arguments(*origin)
    if projection.copies_pixels(layout.over):
        kernel = device.kernel("pixel_planes", {"OVER": layout.over, "SPAN": span})
        size = layout.set_columns // span, layout.rows if rows is None else rows, count
        place = projection.copied_from(*origin)
        device.run(kernel, size, None, planes=planes, sampled=sampled, first_plane=first_plane, rows=layout.rows, **place)
        return
    defines = {**projection.defines(ANY_CFA, layout.over), "SPAN": span}  # those of `project_radius`, which shares the build
    if not projection.is_separable(layout.over):
        kernel = device.kernel("projection_planes", defines, file="projection.cl")
        settings |= {"first_plane": first_plane, "rows": layout.rows}
        pose = projection.upload_pose(device)
        size = _work_size(layout, count, span, rows)
        device.run(kernel, size, None, planes=planes, sampled=sampled, pose=pose, **settings)
        return
    columns, written, sets = layout.work_size(count, rows)
    first_row, scene_rows = projection.scene_rows(origin[1], written / layout.over)
    across = device.empty((sets, scene_rows, columns), np.float32)
    steps: tuple[tuple[str, int, dict[str, object]], ...] = (
        ("projection_across", scene_rows, {"planes": planes, "across": across}),
        (
            "projection_down",
            written,
            {"across": across, "sampled": sampled, "first_plane": first_plane, "across_rows": scene_rows, "rows": layout.rows},
        ),
    )
    pose = projection.upload_pose(device)
    for name, height, buffers in steps:
        kernel = device.kernel(name, defines, file="projection.cl")
        arguments = {"first_row": first_row, "pose": pose, **settings, **buffers}
        device.run(kernel, (columns, height, sets), None, **{key: arguments[key] for key in kernel.arguments})


def project_radius(
    device: Device,
    projection: Projection,
    scene_radius: Buffer,
    radius: Buffer,
    number: int,
    layout: InterleavedColumns,
    origin: tuple[int, int],
    rows: int | None = None,
) -> None:
    """Enqueue the projection of a map of signed blur radii [photosites] onto the samples of a layout.

    scene_radius: device buffer (scene height, scene width) float32. radius: buffer of the layout's planes, of which plane
    `number` is written. origin: photosite (x, y) of the sensor at the layout's first sample. rows: as of `project_planes`.
    """
    span = _span(device, layout)
    kernel = device.kernel(
        "projection_radius", {**projection.defines(ANY_CFA, layout.over), "SPAN": span}, file="projection.cl"
    )
    settings = {"first_plane": number, "rows": layout.rows, **projection.arguments(*origin)}
    pose, size = projection.upload_pose(device), _work_size(layout, 1, span, rows)
    device.run(kernel, size, None, scene_radius=scene_radius, radius=radius, pose=pose, **settings)


def _span(device: Device, layout: InterleavedColumns) -> int:
    """Samples of a work-item: a whole part of a row, of which a CPU's compiler makes vectors."""
    return math.gcd(min(device.span, SPAN), layout.set_columns)


def _work_size(layout: InterleavedColumns, planes: int, span: int, rows: int | None) -> tuple[int, int, int]:
    """Global size of a kernel whose work-items have `span` samples of a column set. rows: as of `project_planes`."""
    columns, height, sets = layout.work_size(planes, rows)
    return columns // span, height, sets


def seen_pixels(scene: Scene, lens: Lens, camera: Camera) -> tuple[float, float]:
    """Return width and height of what the sensor sees of a scene with a field of view [px], more than those of a narrow scene.

    Distortion sees as far as its farthest photosite does.
    """
    image_distance_px = 1e3 * lens.image_distance_mm / camera.pixel_pitch_um
    warp = plan_warp(lens.distortion, image_distance_px, camera.width_px, camera.height_px, camera.channels)
    reach_x, reach_y = (1.0, 1.0) if warp is None else warp.extent(camera.width_px, camera.height_px)[:2]
    scale = _true_scale(scene, lens, camera)
    return scale * camera.width_px * reach_x, scale * camera.height_px * reach_y


def _true_scale(scene: Scene, lens: Lens, camera: Camera) -> float:
    """Return scene pixels per photosite of a scene with a field of view."""
    assert scene.field_of_view_deg is not None
    scene_focal_px = 0.5 * scene.planes.shape[1] / math.tan(math.radians(0.5 * scene.field_of_view_deg))
    return scene_focal_px * 1e-3 * camera.pixel_pitch_um / lens.image_distance_mm


def _check_coverage(scene: Scene, lens: Lens, camera: Camera) -> None:
    """Raise PhotositeError when the field of view of the camera exceeds the scene."""
    height, width = scene.planes.shape[:2]
    seen_x, seen_y = seen_pixels(scene, lens, camera)
    if seen_x > width + 1e-6 or seen_y > height + 1e-6:
        short = max(seen_x / width, seen_y / height)
        raise PhotositeError(
            "the camera sees "
            f"{lens.field_of_view_deg(camera.sensor_mm[0]):.1f} deg x {lens.field_of_view_deg(camera.sensor_mm[1]):.1f} deg, "
            f"past the edge of the scene; use a lens of at least {lens.focal_length_mm * short:.1f} mm, "
            "leave field_of_view out, or say what is outside, such as scene.outside: black",
            key="scene.field_of_view",
            value=f"{scene.field_of_view_deg:g} deg",
        )
