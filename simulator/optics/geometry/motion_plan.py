"""Plans how the motion of a frame's image is computed: skipped, swept by one kernel, or as the sum of instants."""

import math
from collections.abc import Hashable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, Self

import numpy as np

from simulator.errors import PhotositeError
from simulator.exposure.exposed_light import LightComponent
from simulator.exposure.motion import Motion
from simulator.exposure.object_motion import LayerMoves
from simulator.optics.error_term import Skipped
from simulator.optics.geometry.end_spacing import LIT_SHARE
from simulator.optics.geometry.fixed_blur import FixedBlur
from simulator.optics.geometry.image_motion import ImageMotion, LayerPath, Surface, plan_geometry
from simulator.optics.geometry.instants import (
    Instants,
    PathLength,
    TimedPath,
    cut_error,
    needed_cuts,
    needed_instants,
)
from simulator.optics.geometry.pixel_vectors import PixelVectors, pixel_vectors
from simulator.optics.geometry.projection import Projection
from simulator.optics.geometry.spaced_instants import SpacedInstants
from simulator.optics.geometry.texture_error import RESONANT, textured_instants
from simulator.optics.lens.lens import Lens
from simulator.scene.content_keys import freeze
from simulator.scene.scene import Layer, Scene
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import Window

SAME_PLACE_PX = 1e-6  # distance of places on the sensor that are the same [photosites]
SAME_SHIFT_PX = 1e-3  # largest difference of shifts of an image that are the same [photosites]
SAME_SHARE = 0.05  # of the allowed error, for shifts that are the same, and for ways that are straight

MOST_NODES = 16384  # instants that the lines of a rolling shutter share
MOST_TILT = 0.01  # rows per column of the picture up to which rows are blended before columns
MOST_STRETCH = 0.04  # change of scale up to which a span of photosites reads a stated number of scene pixels

MotionMethod = Literal["swept", "swept_first", "joint", "instants"]


@dataclass(frozen=True)
class Timing:
    """What moves in a shot, and when light reaches the lines of the sensor.

    motion: on the shot's clock. components: of the shot's light: the scene's own, then that of a flash.
    """

    motion: Motion
    components: tuple[LightComponent, ...]

    @property
    def key(self) -> Hashable:
        """What the image of a moving scene depends on. Raises OSError for a file of a path that is not there."""
        return freeze(self)


@dataclass(frozen=True)
class MotionNeed:
    """What a scene and its optics ask of the number of instants.

    contrast: of the scene's edges over one photosite, as a share of the brightest light, in the noise of photosites that see
    LIT_SHARE of their step. bend: the same of changes of its slope from pixel to pixel; 0: these are smooth. dark, dark_bend:
    both in the noise of photosites that see none of the step, where a path ends or begins. allowed: error that is
    allowed, as a share of the brightest light, > 0. cut_off: highest frequency that is seen [cycles per photosite].
    texture: standard deviation of the scene's differences over one photosite, as a share of the brightest light.
    border: contrast of neighbouring pixels of the scene, as a share of the brightest light, where one covers the other.
    sigma: one standard deviation of the noise, as a share of the brightest light.
    lamps: contrast of the scene's lamps, as `contrast`, which does not hold them. dark_lamps: the same as `dark`.
    has_corners: whether light may end in corners, as squares do: not where it is read between pixels larger than photosites,
        nor behind a blur.
    """

    contrast: float
    dark: float
    bend: float
    dark_bend: float
    texture: float
    allowed: float
    cut_off: float
    border: float
    sigma: float
    lamps: float = 0.0
    dark_lamps: float = 0.0
    has_corners: bool = True

    @property
    def largest(self) -> float:
        """Contrast of all edges, with those of lamps."""
        return max(self.contrast, self.lamps)

    def of_share(self, share: float) -> Self:
        """Return the need of a part of the light whose edges are weaker by a factor."""
        names = "contrast", "dark", "bend", "dark_bend", "texture", "border", "lamps", "dark_lamps"
        return replace(self, **{name: share * getattr(self, name) for name in names})

    def behind(self, steepest: float, slope: float, dark_slope: float) -> Self:
        """Return the need behind a blur, where the light of an edge rises by no more than this share of it per photosite.

        slope, dark_slope: `contrast` and `dark` of light that rises on over all of a blur circle, of which blur takes nothing.

        The spread of a line has one peak, so its spectrum falls at least as the peak over pi times the frequency. A wave that
        is seen by less than what is allowed needs no instants.
        """
        cut_off = min(self.cut_off, 0.5 * self.contrast * steepest / (math.pi * self.allowed))
        corners = self.has_corners and steepest == 1.0
        own = self.of_share(steepest)
        slopes = {"contrast": max(own.contrast, slope), "dark": max(own.dark, dark_slope)}
        return replace(own, border=self.border, cut_off=cut_off, has_corners=corners, **slopes)

    def contrast_along(self, length_px: float) -> float:
        """Return the contrast of the edge that is wrong by as much as all edges of a path of this length [photosites].

        Errors of a texture's edges have either sign: they add as the root of their number. The factor bounds 99 % of the
        photosites of random pixels.
        """
        return max(self.contrast, self.bend, 1.6 * self.texture * math.sqrt(2.0 * self.cut_off * length_px))

    def contrast_of_corners(self, length_px: float, slant: float) -> float:
        """Return the contrast of the edge that is wrong by as much as corners of light over black past which a way slants.

        A photosite on a chord c of a corner sees slant t (c - t) of the step C: light of C slant c^3 / 6 L in all.
        Instants h apart are wrong by at most C slant c h^2 / 6 L, a twelfth at either end. In the noise of dark and light that
        is most where the light is twice the variance of the dark, sqrt(3) times its noise. An edge is wrong by C h^2 / 8 L.

        slant: of the path (`TimedPath.slant`). 0: there are no corners.
        """
        if not self.has_corners:
            return 0.0
        step = ((self.dark / self.contrast) ** 2 - 1.0) / LIT_SHARE  # over the variance of the dark
        twice = 12.0 * length_px / max(slant * step, 1e-12)
        return 4.0 / (3.0 * math.sqrt(3.0)) * self.dark * slant * min(twice ** (1.0 / 3.0), 1.0)


@dataclass(frozen=True)
class MotionPlan:
    """How the image of a scene that moves is computed.

    method: "swept": one kernel gathers each photosite along its path. "swept_first": the same for the light before a blur,
        which is computed once. "joint": the points of the aperture that sample the blur carry instants. "instants": the
        optics are run at each instant.
    path: of the images of all surfaces under the shutter. length: of the longest. count: instants of each line.
    error: predicted, as a share of the brightest light. moves_alike: whether the images of all surfaces move as one.
    vectors: velocities of the pixels of a scene of one picture that is swept; None: pixels do not move by themselves.
    blur: what follows the method "swept_first"; None: another method. reason: why no cheaper method was taken; "": none is.
    lamp_count: instants of each line where lamps pass, if that is more than `count`; 0: it is not. even_count: even instants
    of each line that are as exact as `count`, which may lie denser at the ends of the path (`TimedPath.spaced`), and as those
    of lamps. same_px: difference of shifts of the image that are the same [photosites]. edge_count: instants that edges need,
    where corners need more; 0: all. instants_error: part of `error` that instants leave. straight_error: what a straight even
    way leaves in their place, of one that bends a little. is_exact: whether means over such a way are taken, not instants.
    missed_error: predicted, of motion that is too fast to be followed (`TimedPath.missed_px`), which `error` does not hold.
    parallax_error: predicted, of a surface of many distances that moves as its nearest place, where that is more than allowed
        and nothing follows each distance; `error` does not hold it, either.
    """

    method: MotionMethod
    path: TimedPath
    length: PathLength
    count: int
    error: float
    moves_alike: bool
    even_count: int
    vectors: PixelVectors | None = None
    blur: FixedBlur | None = None
    reason: str = ""
    lamp_count: int = 0
    same_px: float = SAME_SHIFT_PX
    edge_count: int = 0
    instants_error: float = 0.0
    straight_error: float = 0.0
    is_exact: bool = False
    missed_error: float = 0.0
    parallax_error: float = 0.0

    @property
    def is_common(self) -> bool:
        """Whether all lines are open at the same times."""
        return all(one.is_common for one in self.path.openings)

    def with_exact_means(self) -> Self:
        """Return the plan of an image whose means over a straight even way are exact, so that no instants are left."""
        left = min(self.straight_error, self.instants_error)
        return replace(self, error=self.error - self.instants_error + left, instants_error=left, is_exact=True)

    def shared_nodes(self) -> np.ndarray:
        """Return times of instants that all lines of the sensor share, (nodes,) [s from the release], for `node_weights`."""
        own = self.path.lines
        open_s = float((own.closed_s - own.opens_s).mean())
        span_s = float(own.closed_s.max() - own.opens_s.min())
        count = math.ceil(self.even_count * math.sqrt(self.path.crowding) * span_s / max(open_s, 1e-12) - 1e-9)
        return self.path.even_nodes(min(max(count, 1), MOST_NODES))

    def lines_of(self, window: Window) -> np.ndarray:
        """Return the numbers of the lines of a window's rows, of which one is enough where all are open at the same times."""
        if self.path.lines.axis != "rows" or self.is_common:
            return np.zeros(1, np.intp)
        return np.arange(window.y, window.y + window.height)

    def instants(self, lines: range, count: int | None = None) -> Instants:
        """Return the instants of some lines of the sensor, also beyond its border (`TimedPath.of_lines`).

        count: of each line; None: as planned.
        """
        own, count = self.path.lines, count or self.count
        if own.axis == "all":
            return self.path.instants(count)
        return self.path.of_lines(np.array(lines)).instants(count)

    def window_instants(self, window: Window, count: int | None = None) -> Instants:
        """Return the instants of the lines of a window of the sensor; count: as of `instants`."""
        columns = self.path.lines.axis == "columns"
        first, size = (window.x, window.width) if columns else (window.y, window.height)
        return self.instants(range(first, first + size), count)

    def middle_homography(self) -> np.ndarray:
        """Return the homography (3, 3) of the mean pose of the exposure, of lines that are open at the same times."""
        instants = self.path.of_lines(np.zeros(1, np.intp)).instants(1)
        return self.path.motion.homographies(instants.pose_numbers[0, 0], 0)

    def with_lamps_everywhere(self) -> Self:
        """Return the plan in which every place has the instants of lamps."""
        return replace(self, count=max(self.count, self.lamp_count), lamp_count=0)

    def seen_at(self, places_px: np.ndarray, steps: int = 65) -> np.ndarray:
        """Return the least and greatest x and y on the sensor where places at rest are seen, (places, 4) [photosites].

        places_px: (places, 2) from the sensor's upper left corner, of the nearest surface.
        """
        motion = self.path.motion
        centre = 0.5 * np.array([motion.geometry.width_px, motion.geometry.height_px])
        poses = self.path.poses[np.unique(np.linspace(0, len(self.path.poses) - 1, steps).astype(int))]
        back = np.linalg.inv(motion.homographies(poses, 0))
        found = np.column_stack([places_px - centre, np.ones(len(places_px))]) @ np.swapaxes(back, -1, -2)
        seen = found[..., :2] / found[..., 2:] + centre
        return np.column_stack([seen.min(axis=0), seen.max(axis=0)])[:, [0, 2, 1, 3]]

    def seen_window(self, window: Window) -> Window:
        """Return photosites at rest that see all that the photosites of a window see on their paths."""
        width, height = self.path.motion.geometry.width_px, self.path.motion.geometry.height_px
        beyond = max(-window.x, -window.y, window.x + window.width - width, window.y + window.height - height, 0)
        reach = math.ceil(self.path.farthest_px * (1.0 + 4.0 * beyond / min(width, height))) + 2
        return Window(window.x - reach, window.y - reach, window.width + 2 * reach, window.height + 2 * reach)

    @cached_property
    def slopes(self) -> tuple[float, float]:
        """Largest change of the displacement along a row, across and down the picture [photosites per photosite]."""
        own, tilt, stretch = self.path.motion, 0.0, 0.0
        reach = 0.5 * math.hypot(own.geometry.width_px, own.geometry.height_px)
        for surface in range(len(own.surfaces)):
            shape = np.abs(own.homographies(self.path.poses, surface) - np.eye(3)).max(axis=0)
            bend = reach * float(shape[2, 0] + shape[2, 1])
            tilt, stretch = max(tilt, float(shape[1, 0]) + bend), max(stretch, float(shape[0, 0]) + 2.0 * bend)
        return tilt, stretch

    @cached_property
    def is_shift(self) -> bool:
        """Whether all places of the nearest surface's image move by the same way, to `same_px` over the sensor."""
        return self._shifts(0)

    @cached_property
    def shifts_surfaces(self) -> bool:
        """Whether that holds for each surface, which may move by a way of its own."""
        return all(map(self._shifts, range(len(self.path.motion.surfaces))))

    def _shifts(self, surface: int) -> bool:
        return _turn_px(self.path.motion, self.path.poses, surface) < self.same_px

    @property
    def turns_slowly(self) -> bool:
        """Whether displacements change so little along a row that spans of photosites may be read together."""
        tilt, stretch = self.slopes
        return tilt <= MOST_TILT and stretch <= MOST_STRETCH


def moving_path(
    scene: Scene, lens: Lens, camera: Camera, projection: Projection, moving: Motion, component: LightComponent
) -> tuple[TimedPath, PixelVectors | None]:
    """Return the path of a scene's image in the light of one component, and the velocities of its pixels, if these move.

    Raises PhotositeError for motion that the scene or the paths do not allow.
    """
    size = scene.planes.shape[0], scene.planes.shape[1]
    surfaces = tuple(_surface(moving, number, layer, size) for number, layer in enumerate(scene.layers))
    moving.check_layers([surface.nearest_m for surface in surfaces])
    geometry = plan_geometry(lens, camera, projection)
    vectors = pixel_vectors(scene, moving, geometry.scale * geometry.image_distance_px)
    drifts_px = None if vectors is None else vectors.polygon / geometry.scale
    motion = ImageMotion(geometry, surfaces, moving.camera, drifts_px, fastest_hz=moving.fastest_hz)
    path = TimedPath(motion, component.lit_openings(), component.release_s, component.curve)
    motion.check_view(path.poses)
    return path, vectors


def plan_motion(
    path: TimedPath,
    vectors: PixelVectors | None,
    moving: Motion,
    need: MotionNeed,
    blur: FixedBlur | str | None = None,
    can_join: bool = False,
    *,
    is_kept: bool = False,
) -> MotionPlan | Skipped:
    """Plan the motion of a frame along a path in the light of one component; why, where none is computed.

    vectors: velocities of pixels. blur: None: each photosite sees one place of each surface, without blur; a reason: why the
    blur is not fixed. can_join: whether the optics allow the method "joint", which is taken where surfaces move apart or by
    their depth, or lie behind one another. is_kept: whether motion is computed that is too small to be seen.
    Raises PhotositeError for motion that no method holds.
    """
    farthest = path.farthest_px
    if max(need.largest, need.dark) * farthest <= need.allowed:
        if farthest < SAME_PLACE_PX:
            return Skipped("nothing moves")
        if not is_kept:
            sigma = max(need.largest, need.dark) * farthest / need.sigma
            return Skipped(f"the image moves by up to {farthest:.2g} photosites, {sigma:.2g} sigma", sigma)
    length, missed = path.length, max(need.largest, need.dark) * min(path.missed_px, 1.0)
    edges, corners = need.contrast_along(length.longest_px), need.contrast_of_corners(length.longest_px, path.slant)
    contrast = max(edges, corners)
    steepest = max(need.largest, need.dark, need.dark_bend, contrast)
    same_px = min(SAME_SHIFT_PX, SAME_SHARE * need.allowed / steepest)
    path = path.straight_within(same_px)
    apart_px = max(_turn_px(path.motion, path.poses, surface) for surface in range(len(path.motion.surfaces)))
    left_out = steepest * apart_px if SAME_PLACE_PX * same_px < apart_px < same_px else 0.0  # of turns of an image that shifts
    need = replace(need, allowed=need.allowed - left_out)
    dark = max(need.dark, need.dark_bend, contrast)
    even = SpacedInstants.even(length, dark, need.allowed, need.cut_off)
    spaced = SpacedInstants.fewest(length, contrast, dark, need.allowed, need.cut_off)
    of_edges = SpacedInstants.fewest(length, edges, dark, need.allowed, need.cut_off).count if corners > edges else spaced.count
    path, count, contrast = path.spaced(spaced.spacing), spaced.count, spaced.contrast
    tears = vectors is not None and vectors.tears(*(path.start_s + path.times_s[[0, -1]]))
    if tears:
        count = max(count, math.ceil(spaced.excess * needed_cuts(need.border, need.allowed)))
    lamps = needed_instants(length, need.lamps, need.allowed, 0.0)
    even_count, lamp_count = max(even.count, lamps), math.ceil(spaced.excess * lamps)
    textured, pixels = 0.0, need.texture if need.bend else 0.0  # independent ones at the most
    if RESONANT * pixels * math.sqrt(length.longest_px) > contrast:
        count, textured = textured_instants(path, count, pixels, need.allowed)
    error = max(path.instants_error(count, length, contrast), cut_error(count, need.border) if tears else 0.0, textured)
    if lamp_count > count:
        error = max(error, path.instants_error(lamp_count, length, need.lamps))
    else:
        lamp_count = 0
    instants, everywhere, error = error, max(count, lamp_count), error + left_out
    if vectors is not None:
        count, lamp_count = everywhere, 0
    alike, (deep, parallax_px) = vectors is None and _moves_alike(path), _shifted_by_depth(path)
    parallax = need.largest * parallax_px / max(length.longest_px, 1.0)
    untold = 0.0
    if deep is not None and parallax <= need.allowed:  # all of the surface moves as its nearest place
        deep, error = None, error + parallax
    elif deep is not None and not can_join:  # the same, since nothing follows each distance
        deep, untold = None, parallax
    swept = MotionPlan("swept", path, length, count, error, alike, even_count, vectors, lamp_count=lamp_count, same_px=same_px)
    bent = 0.0 if vectors is not None else steepest * path.bend_px  # pixels with velocities of their own have no common way
    swept = replace(swept, edge_count=of_edges, instants_error=instants, straight_error=bent)
    swept = replace(swept, missed_error=missed, parallax_error=untold)
    if blur is None and deep is None:
        return swept
    reason = blur if isinstance(blur, str) else ""
    if isinstance(blur, FixedBlur):
        skew = path.skew
        if blur.error(skew, length.longest_px) > need.allowed:
            blur = blur.following(skew)
        fixed = blur.error(skew, length.longest_px)
        reason = f"swept first it would be wrong by {fixed / need.allowed:.2g} times the tolerance"
        can_sweep = deep is None and (vectors is None or blur.samples_per_axis == 1)
        if can_sweep and fixed <= need.allowed:
            error += fixed + blur.common_error
            return replace(swept, method="swept_first", error=error, blur=blur)
    if moving.vectors is not None:
        raise PhotositeError(_why_no_vectors(blur is None), key="motion.vectors", value=moving.vectors.image)
    if can_join and not (alike and deep is None and len(path.motion.surfaces) == 1):
        return MotionPlan("joint", path, length, everywhere, error, alike, even_count, same_px=same_px, missed_error=missed)
    if not alike:
        raise PhotositeError(
            "moves the layers of the scene apart, behind a lens that blurs; turn the camera alone, or stop the lens down until "
            "all is sharp",
            key="motion",
        )
    if need.lamps and not textured:  # which all photosites have instants for
        ends = spaced.dense_at_ends(max(count / spaced.excess, lamps), need.dark_lamps / need.lamps)
        path, everywhere = path.spaced(ends.spacing), max(everywhere, ends.count)
    instants_of_all = MotionPlan("instants", path, length, everywhere, error, alike, even_count, reason=reason)
    return replace(instants_of_all, missed_error=missed, parallax_error=untold)


def _turn_px(motion: ImageMotion, poses: np.ndarray, surface: int) -> float:
    """Return the largest way by which places of a surface's image move apart over the sensor, at most [photosites]."""
    reach = 0.5 * math.hypot(motion.geometry.width_px, motion.geometry.height_px)
    turn = np.abs(motion.homographies(poses, surface) - np.eye(3)).max(axis=0)
    return reach * float(turn[:2, :2].max() + reach * turn[2, :2].max())


def _why_no_vectors(is_sharp: bool) -> str:
    if is_sharp:
        return (
            "moves pixels of a picture with a depth map, which a camera that moves would shift apart; turn the camera instead "
            "of moving it, or have its motion in the vectors"
        )
    return (
        "moves pixels one by one, which no pass does behind a lens or a filter that blurs; use a lens without aberrations and "
        "diffraction, focused until all is sharp, or cut the picture into scene.layers and give motion.layers"
    )


def _surface(motion: Motion, number: int, layer: Layer, size: tuple[int, int]) -> Surface:
    path: LayerPath | None = None
    if number in motion.layers:

        def moves(times_s: np.ndarray) -> LayerMoves:
            found = motion.layer_moves(number, times_s, size)
            assert found is not None  # the layer moves
            return found

        path = moves
    return Surface(float(np.min(layer.depth_m)), float(np.max(layer.depth_m)), path)


def _shifted_by_depth(path: TimedPath) -> tuple[int | None, float]:
    """Return the first surface whose image is shifted by distances that differ from pixel to pixel; None: none is.

    And by how much its nearest and farthest places are shifted apart at most, of all such surfaces [photosites].
    """
    motion, corners = path.motion, path.motion.geometry.corners()
    first, apart_px = None, 0.0
    for number, surface in enumerate(motion.surfaces):
        if surface.nearest_m == surface.farthest_m:
            continue
        shift = motion.parallax(path.poses, number, corners)[1]
        own_px = float(np.linalg.norm(shift, axis=-1).max()) * (1.0 / surface.nearest_m - 1.0 / surface.farthest_m)
        if own_px > SAME_PLACE_PX:
            first, apart_px = number if first is None else first, max(apart_px, own_px)
    return first, apart_px


def _moves_alike(path: TimedPath) -> bool:
    """Whether the images of all surfaces move as one."""
    motion = path.motion
    first, *others = (motion.homographies(path.poses, number) for number in range(len(motion.surfaces)))
    return all(bool(np.abs(other - first).max() < SAME_PLACE_PX / motion.geometry.image_distance_px) for other in others)
