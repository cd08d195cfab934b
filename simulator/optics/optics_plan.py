"""The plan of the optics: all decisions from the radiance of the scene to the electron radiance of each photosite."""

import itertools
import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Self

import numpy as np

from simulator.optics.defocus.accuracy import Accuracy
from simulator.optics.defocus.defocus import Defocus
from simulator.optics.defocus.mixed_edges import WIDE, LayerEdges, cells_ns, crossed_spans, find_edges, open_parts
from simulator.optics.defocus.scene_contrast import SceneContrast
from simulator.optics.error_term import Skipped
from simulator.optics.geometry.projection import Projection
from simulator.optics.veiling_glare import VeilingGlare
from simulator.scene.content_keys import digest, freeze
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera_sections import Window
from simulator.sensor.camera.cfa import Cfa

LACKED = 0.75  # of the tolerance that edges of layers may leave where means over photosites are composited
SEEN_ROWS = 32  # at which that is measured
SEEN_POINTS = 1024  # of aperture and time, at most, by which that is measured
LEAST_TURN = 0.05  # sine of a turn up to which pixels lie as the photosites do
MOST_MIXED_SCALE = 8.0  # scene pixels per sample and axis up to which edges are composited exactly
SAME_SCALE = 1e-6  # difference from one scene pixel per photosite at which there is one
COUNTED_ROWS, COUNTED_INSTANTS = 64, 16  # by which spans that edges cross are counted
LONGEST_SHIFT_PX = 2048.0  # longest path whose weights are found in the rectangle around it [photosites]
MOST_SHIFTED_LAYERS = 4  # that one launch composites
MOST_DRIFT = 0.007  # change of displacements from photosite to photosite, by which a span of 128 drifts less than a pixel

if TYPE_CHECKING:  # what a sharp frame at rest does without
    from simulator.optics.defocus.joint_motion import JointMotion
    from simulator.optics.geometry.layer_phases import LayerPhases
    from simulator.optics.geometry.motion_plan import MotionPlan
    from simulator.optics.psf.field_psf import FieldPsf
    from simulator.optics.psf.lamps import Lamps
    from simulator.optics.psf.wings import Wings
    from simulator.optics.ray_reference.deep_rays import DeepBlur


@dataclass(frozen=True)
class OpticsPlan:
    """Decisions between the scene and the light on the sensor.

    scene: surfaces as they are rendered. weights: (bands, channels) float32 [e- s^-1 um^-2 sr^-1].
    cfa: colour of each photosite, from the sensor's upper left corner on.
    window: photosites that are computed; it may extend beyond the sensor. sensor_px: width and height of the sensor.
    is_direct: whether photosites gather the even squares of a fine scene directly, over their open area.
    defocus: blur of the ideal lens; None: sharp everywhere.
    psf: kernels of diffraction, aberrations, low-pass filter and aperture of the photosites; None: none are needed.
    disoccluded_share: fraction of the picture that sees background which is occluded in the scene; None: its layers contain it.
    deep_blur: blur of the samples of a deep picture, where rays are followed (tolerance 0); None: the layers are blurred.
    psf_skipped: why a point spread function is left out, with its predicted error; None: it is not.
    focus_px: signed blur radius of the kernels of a lens with aberrations where `defocus` is None: the middle of the scene's.
    ignored_px: largest blur radius that is left out where `defocus` is None, beside that [photosites].
    contrast: of the scene, on which the error of the blur depends; that of the laws where there is no blur.
    motion: how the image moves while the shutter is open; None: it does not. flash_motion: while a flash shines.
    has_flash: whether a flash lights the bands of the scene's second half.
    joint: motion that the points of the aperture carry, of the method "joint"; None: they carry none.
    illumination_error: of the table of clipped pupils, as a share of the brightest light. sampling_error: of the samples of
        light that kernels by distance are applied to.
    tolerance: of all approximations together [standard deviations of the noise]; 0: the reference path. `accuracy` has that for
        which each of them is planned.
    lamps: pixels of the scene that are drawn by themselves behind the PSF; None: none are. Errors as shares of the brightest
        light: lamp_error of those that are not, focus_error of kernels at `focus_px` alone, spots_error of kernels that hold a
        low-pass filter, spread_error of those that spread each layer by itself, far_error of circles far beyond the Airy disk.
    layer_rays: whether rays add what these lack, on the reference path.
    wings: light of diffraction from beyond the kernels; None: none is added. wings_error: what that leaves, or leaving it out
        [standard deviations].
    moved_radii: of the maps of blur radii, where they lie on another grid than the light; None: they lie on the scene's.
    motion_skipped: why motion is left out, with its predicted error; None: it is not.
    """

    scene: Scene
    weights: np.ndarray
    projection: Projection
    cfa: Cfa
    window: Window
    sensor_px: tuple[int, int]
    accuracy: Accuracy
    is_direct: bool = False
    defocus: Defocus | None = None
    veiling_glare: VeilingGlare | None = None
    psf: "FieldPsf | None" = None
    disoccluded_share: float | None = None
    deep_blur: "DeepBlur | None" = None
    psf_skipped: Skipped | None = None
    focus_px: float = 0.0
    ignored_px: float = 0.0
    contrast: SceneContrast = SceneContrast()
    motion: "MotionPlan | None" = None
    flash_motion: "MotionPlan | None" = None
    has_flash: bool = False
    motion_skipped: Skipped | None = None
    joint: "JointMotion | None" = None
    illumination_error: float = 0.0
    sampling_error: float = 0.0
    tolerance: float = 0.0
    moved_radii: Projection | None = None
    lamps: "Lamps | None" = None
    lamp_error: float = 0.0
    focus_error: float = 0.0
    spots_error: float = 0.0
    spread_error: float = 0.0
    far_error: float = 0.0
    layer_rays: bool = False
    wings: "Wings | None" = None
    wings_error: float = 0.0

    @property
    def radius_projection(self) -> Projection:
        """Resampling of the maps of blur radii: that of the scene, unless light was swept on a grid of its own."""
        return self.moved_radii or self.projection

    @property
    def covering_layers(self) -> int:
        """Layers up to the first that covers all of the picture."""
        opaque = (number for number, layer in enumerate(self.scene.layers, 1) if layer.coverage is None)
        return next(opaque, len(self.scene.layers))

    @property
    def sweeps_rows(self) -> bool:
        """Whether a swept image is read by spans of a row, which is several times faster than photosite by photosite."""
        projection, motion = self.projection, self.motion
        if motion is None or motion.vectors is not None:
            return False
        return projection.warp is None and motion.turns_slowly and motion.path.lines.axis != "columns"

    def sweeps_shift(self, over: int = 1) -> bool:
        """Whether a swept image is one convolution with the weights of its path, which is several times faster again.

        That is the image of a picture with a pixel for each of `over` samples per photosite and axis, which moves without a
        turn, while lines are rows.
        """
        motion = self.motion
        if motion is None or self.covering_layers > 1 or not self._sweeps_pixels(motion, over):
            return False
        if motion.length.longest_px > LONGEST_SHIFT_PX or not motion.is_shift:
            return False
        return motion.is_common or not motion.lamp_count or motion.path.straight_shift() is not None

    def sweeps_shifted_layers(self, over: int = 1) -> bool:
        """Whether layers move apart without a turn, few enough to be composited by one launch.

        The scene has a pixel for each sample, or layers are averaged before (`layer_phases`).
        """
        motion = self.motion
        if motion is None or not 1 < self.covering_layers <= MOST_SHIFTED_LAYERS or not motion.shifts_surfaces:
            return False
        return self._sweeps_pixels(motion, over) or (over == 1 and self.layer_phases is not None)

    @property
    def sweeps_drifting_layers(self) -> bool:
        """Whether one launch composites sharp layers that move apart, and whose displacements change little along a row.

        A span of photosites of a row then reads adjacent pixels, with a pixel for each photosite.
        """
        motion = self.motion
        if motion is None or motion.method != "swept" or motion.shifts_surfaces or not self._sweeps_pixels(motion, 1):
            return False
        return 1 < self.covering_layers <= MOST_SHIFTED_LAYERS and max(motion.slopes) <= MOST_DRIFT

    @cached_property
    def layer_phases(self) -> "LayerPhases | None":
        """Places between photosites at which layers that shift apart are averaged; None: none are.

        Such a scene has another number of pixels than photosites, and its layers are sharp.
        """
        motion, projection = self.motion, self.projection
        if motion is None or motion.vectors is not None or motion.blur is not None or motion.path.lines.axis == "columns":
            return None
        from simulator.optics.geometry.layer_phases import LEAST_SCALE, MOST_SCALE, plan_phases

        if projection.warp is not None or not LEAST_SCALE <= projection.scale <= MOST_SCALE:
            return None
        if not (projection.is_fine or projection.is_bilinear or projection.nearest):
            return None
        plan, planes = motion.with_lamps_everywhere(), self.channels + 1
        return plan_phases(plan, projection, self.covering_layers, self.moving_layers, planes)

    def composites_cells(self, over: int = 1) -> bool:
        """Whether layers shift apart over even squares, so that they can be composited exactly (kernels/layer_cells.cl).

        over: samples per photosite and axis, each of which sees at least a pixel.
        """
        motion, projection = self.motion, self.projection
        if motion is None or not 1 < self.covering_layers <= MOST_SHIFTED_LAYERS or not motion.shifts_surfaces:
            return False
        if motion.vectors is not None or motion.path.lines.axis == "columns" or projection.warp is not None:
            return False
        return not projection.is_bilinear and projection.scale <= over * MOST_MIXED_SCALE

    def mixes_edges(self, over: int = 1) -> bool:
        """Whether they are, since the covariance of edges and what is behind them within a photosite is seen.

        Where means over photosites lack less than LACKED of the tolerance, as measured, they take a fraction of the time.
        """
        if not (self.composites_cells(over) and self.layer_edges.are_seen):
            return False
        return not self.sweeps_shifted_layers(over) or self.lacked_sigma(over) > LACKED * self.tolerance

    @property
    def mixes_points(self) -> bool:
        """Whether layers for which `samples_shifted_layers` holds are, at each point of the aperture."""
        return self.layer_edges.are_seen and self.lacked_sigma() > LACKED * self.tolerance

    @property
    def shifted_points(self) -> int:
        """Points of aperture and time through which layers are seen for which `samples_shifted_layers` holds."""
        from simulator.optics.defocus.aperture_samples import sample_count  # not needed for a sharp frame

        blur = self.moving_blur
        assert blur is not None  # it blurs them
        return int(sample_count(np.array([blur.largest_px]), blur)[0])

    @property
    def reads_rows(self) -> bool:
        """Whether points of layers for which `samples_shifted_layers` holds read the nearest of some rows between pixels."""
        from simulator.optics.geometry.rows_between import MOST_SHARE

        return self.samples_shifted_layers and self.rows_error <= MOST_SHARE * self.accuracy.allowed

    @property
    def rows_error(self) -> float:
        """Error of that, of detail between zero and the brightest light, as its share."""
        from simulator.optics.geometry.rows_between import rows_error

        blur = self.moving_blur
        assert blur is not None  # it blurs the layers, each by one radius
        smallest_px = min(abs(float(radius)) for radius in blur.radii_px[: self.covering_layers])
        return rows_error(self.shifted_points, smallest_px)

    def lacked_sigma(self, over: int = 1) -> float:
        """What means over photosites lack at edges of layers that shift apart, `over` samples per photosite and axis.

        It is of the whole sensor, so that a window has the frame's bits [standard deviations of the noise].
        """
        from simulator.optics.defocus.edge_samples import choose_samples, lacked_sigma

        assert self.motion is not None  # something moves
        geometry, layers = self.motion.path.motion.geometry, self.scene.layers[: self.covering_layers]
        whole = Window(0, 0, geometry.width_px, geometry.height_px)
        rows, columns = over * _some_rows(whole, SEEN_ROWS), np.arange(0, over * whole.width, WIDE)
        ways, shares = self._sampled_ways
        places = self.projection.scale, self.projection.offset_x, self.projection.offset_y, self.projection.open_side
        key = "lacked", freeze(self.weights), self.accuracy, over, len(layers), places, *self._ways_key

        def measure() -> float:
            least, most = ways.min(axis=1), ways.max(axis=1)
            crossed = crossed_spans(self.layer_edges, self.projection, least, most, rows, columns, over)
            samples = choose_samples(crossed, WIDE, over * whole.width, rows, ways, shares, self.weights)
            samples = replace(samples, part=1.0 / over)  # an edge crosses so many of them
            return lacked_sigma(layers, samples, self.projection, over, self.accuracy)

        return self.scene.remember(key, measure)

    @cached_property
    def _ways_key(self) -> tuple[bytes, bytes]:
        """Key of `_sampled_ways`."""
        ways, shares = self._sampled_ways
        return digest(ways), digest(shares)

    @cached_property
    def _sampled_ways(self) -> tuple[np.ndarray, np.ndarray]:
        """Displacements of layers (rows or 1, instants, layers, 2) [photosites], and shares of light (rows or 1, instants)."""
        motion, layers = self.motion, self.covering_layers
        assert motion is not None  # something moves
        geometry = motion.path.motion.geometry
        rows = _some_rows(Window(0, 0, geometry.width_px, geometry.height_px), 1 if motion.is_common else SEEN_ROWS)
        if not self.samples_shifted_layers:
            return motion.with_lamps_everywhere().path.of_lines(rows).shifts(motion.count, range(layers))
        from simulator.optics.defocus.aperture_samples import moving_samples

        blur, count = self.moving_blur, min(self.shifted_points, SEEN_POINTS)
        assert blur is not None and blur.motion is not None  # it blurs them
        points = moving_samples(blur.pupil, count, 1, blur.area.open_side).astype(np.float64)
        return blur.motion.layer_shifts(rows.astype(np.float64), points, blur.radii_px[:layers]), np.full(
            (len(rows), count), 1.0 / count
        )

    def mixed_share(self, over: int = 1) -> float:
        """Share of the window's photosites, or of samples of them, that are composited so where edges are seen."""
        motion, window, layers = self.motion, self.window, self.covering_layers
        if motion is None or not (self.sweeps_shifted_layers(over) or self.samples_shifted_layers):
            return 1.0
        rows = _some_rows(window, COUNTED_ROWS)
        path = motion.path.of_lines(np.zeros(1, np.intp) if motion.is_common else rows)
        instants = path.of_shift(range(layers)).instants(COUNTED_INSTANTS)
        ways = instants.pose_numbers.reshape(*instants.weights.shape, layers, 2)
        blur = self.defocus if motion.method == "joint" else None
        reach = np.zeros((layers, 1)) if blur is None else np.abs(np.array(blur.radii_px[:layers], np.float64))[:, None]
        least, most = ways.min(axis=1) - reach, ways.max(axis=1) + reach
        columns = np.arange(over * window.x // WIDE * WIDE, over * (window.x + window.width), WIDE)
        return float(crossed_spans(self.layer_edges, self.projection, least, most, over * rows, columns, over).mean())

    @cached_property
    def cell_instants(self) -> int:
        """Instants at which layers are composited so, which keep the error that is planned for means over photosites.

        An edge that passes a photosite is hidden and seen again up to `open_parts` times, each of which errs as an edge does
        that passes it once; and edges of two layers meet at the speed at which these shift apart.
        """
        from simulator.optics.geometry.instants import MOST_INSTANTS

        assert self.motion is not None  # something moves
        plan = self.motion.with_lamps_everywhere()
        ways = [plan.path.shift_at(plan.path.times_s, layer) for layer in range(self.covering_layers)]
        lengths = [np.linalg.norm(np.diff(way, axis=0), axis=-1).sum() for way in ways]
        apart = [np.linalg.norm(np.diff(a - b, axis=0), axis=-1).sum() for a, b in itertools.combinations(ways, 2)]
        more = open_parts(self.projection.scale) * max(float(max(apart) / max(lengths)), 1.0)
        return min(math.ceil(plan.count * (math.sqrt(more) if plan.count >= plan.length.longest_px else more)), MOST_INSTANTS)

    def cells_ns(self, over: int = 1) -> float:
        """Predicted time of a photosite, or of one of its samples, and instant where layers are composited so [ns]."""
        step = 1 if len(self.cfa.colors) == 1 or over > 1 else 2
        return cells_ns(self.covering_layers, self.projection.scale / over, step)

    @cached_property
    def layer_edges(self) -> LayerEdges:
        """Where edges of layers lie that hide light in parts of photosites."""
        scene, accuracy, layers = self.scene, self.accuracy, self.covering_layers
        if not any(layer.coverage is not None for layer in scene.layers[: layers - 1]):
            return LayerEdges({}, 0.0)
        key = "layer edges", freeze(self.weights), accuracy, layers
        return scene.remember(key, lambda: find_edges(scene, layers, self.weights, accuracy))

    @property
    def samples_shifted_layers(self) -> bool:
        """Whether a lens blurs layers that move apart without a turn each by one radius, as one launch composites them.

        Through a point of the aperture, at its instant, all photosites of a line then see a layer displaced alike.
        """
        motion, blur = self.motion, self.defocus
        if motion is None or blur is None or motion.method != "joint" or self.psf is not None:
            return False
        if not 1 < self.covering_layers <= MOST_SHIFTED_LAYERS or blur.maps or blur.eyes is not None:
            return False
        radius = np.array(blur.largest_px)
        over = int(blur.accuracy.samples_per_axis(np.array(blur.least_px), radius, self.projection.scale))
        return over == 1 and self._sweeps_pixels(motion, 1) and motion.shifts_surfaces

    @property
    def moving_layers(self) -> int:
        """Covering layers up to the last that moves."""
        assert self.motion is not None  # something moves
        own = self.motion.path.motion
        return max((layer + 1 for layer in range(self.covering_layers) if not own.is_at_rest(layer)), default=0)

    @property
    def varies_in_one_layer(self) -> bool:
        """Whether all covering layers but one are even within each photosite: at rest, with the photosites for pixels.

        Mean light and coverage of the layers are then composited without an error: only one of the factors varies. Of pixels
        that turn against the photosites by more than LEAST_TURN the means themselves err.
        """
        motion, projection = self.motion, self.projection
        if motion is None or self.defocus is not None or projection.is_bilinear or projection.warp is not None:
            return False
        begins = projection.offset_x, projection.offset_y
        if abs(projection.scale - 1.0) > SAME_SCALE or any(abs(begin - round(begin)) > SAME_SCALE for begin in begins):
            return False
        own = motion.path.motion
        moving = [layer for layer in range(self.covering_layers) if not own.is_at_rest(layer)]
        turns = [own.homographies(motion.path.poses, layer)[..., :2, :2] - np.eye(2) for layer in moving]
        return len(moving) <= 1 and all(float(np.abs(turn).max()) <= LEAST_TURN for turn in turns)

    def _sweeps_pixels(self, motion: "MotionPlan", over: int) -> bool:
        """Whether what is swept has a pixel for each of `over` samples per photosite and axis, read between four of them."""
        projection = self.projection
        is_even = projection.scale == over and not projection.nearest and projection.warp is None
        return is_even and projection.open_side == 1.0 and motion.vectors is None and motion.path.lines.axis != "columns"

    @property
    def sweeps_lamps_apart(self) -> bool:
        """Whether places that lamps pass have more instants than others: where spans of one picture are swept."""
        if self.motion is None or self.motion.lamp_count == 0 or self.sweeps_shift(self.light_samples):
            return False
        return self.sweeps_rows and self.covering_layers == 1

    @property
    def light_samples(self) -> int:
        """Samples per photosite and axis of light that is swept."""
        return 1 if self.motion is None or self.motion.blur is None else self.motion.blur.samples_per_axis

    @property
    def channels(self) -> int:
        """Colour planes of the camera."""
        return self.weights.shape[1]

    @property
    def joins_colors(self) -> bool:
        """Whether blur or motion of a pattern that is larger than 2 x 2 runs once for each colour (`join_colors`)."""
        is_blurred = self.defocus is not None or self.psf is not None or self.motion is not None
        return is_blurred and not self.cfa.is_small

    @property
    def has_coverage(self) -> bool:
        """Whether any surface has a coverage below 1."""
        return any(layer.coverage is not None for layer in self.scene.layers)

    def blur_window(self) -> Window:
        """Photosites of the geometric blur: the window, and the margin that a convolution after it needs."""
        if self.psf is None or self.psf.by_distance:
            return self.window
        if self.psf.core is not None:
            reach, own = self.psf.gather_reach_px, self.window
            return Window(own.x - reach, own.y - reach, own.width + 2 * reach, own.height + 2 * reach)
        from simulator.optics.psf.tiled_convolution import bound_tiles, split_into_tiles  # imports scipy.fft

        tiles = split_into_tiles(self.psf.x_px, self.psf.y_px, (self.sensor_px[1], self.sensor_px[0]))
        return bound_tiles(tiles, self.psf.reach_px, self.window)

    def in_one_color(self, plane: int) -> Self:
        """Return the plan of a sensor whose photosites all have this colour."""
        return replace(self, cfa=Cfa.uniform(plane))

    @property
    def sees_spots(self) -> bool:
        """Whether the image is the mean of those of a low-pass filter's four spots, at which rays of the reference start."""
        follows_rays = self.defocus is not None and self.psf is None and self.accuracy.tolerance == 0.0
        return self.projection.low_pass_px > 0.0 and not follows_rays

    def at_spots(self) -> list[Self]:
        """Return the plans of the images that a low-pass filter's four spots show, of each spot alone."""
        found = []
        for x_px, y_px in self.projection.spots:
            motion = self.motion
            if motion is not None:
                motion = replace(motion, path=motion.path.at_spot(x_px, y_px))
            found.append(replace(self, projection=self.projection.at_spot(x_px, y_px), motion=motion))
        return found

    @property
    def moves_by_component(self) -> bool:
        """Whether there is a flash that sees what moves at other times than the scene's own light does."""
        return self.has_flash and not (self.motion is None and self.flash_motion is None)

    def lit_by(self, bands: slice, is_flash: bool = False) -> Self:
        """Return the plan of the light of these bands of the scene alone, such as those of a flash."""
        weights = np.zeros_like(self.weights)
        weights[bands] = self.weights[bands]
        glare = None if self.veiling_glare is None else self.veiling_glare.lit_by(bands)
        motion = self.flash_motion if is_flash else self.motion
        joint = None if motion is None else self.joint
        return replace(self, weights=weights, veiling_glare=glare, motion=motion, joint=joint)

    @property
    def moves_pixels(self) -> bool:
        """Whether the optics run at several places of the scene, whose pixels samples then do not divide."""
        return any(motion is not None and motion.method == "instants" for motion in (self.motion, self.flash_motion))

    @property
    def reads_pixels(self) -> bool:
        """Whether photosites read single pixels (`Projection.reads_pixels`) of a scene at rest, behind a blur alone.

        Those of a scene whose motion is left out would be averaged: circles inside a photosite blur it.
        """
        moves = not (self.motion is None and self.flash_motion is None)
        is_left_out = self.motion_skipped is not None and self.motion_skipped.sigma > 0.0
        return self.projection.reads_pixels and self.psf is None and not (moves or is_left_out)

    def with_moved_pixels(self) -> Self:
        """Return the plan of a scene whose pixels do not stay on the borders of samples."""
        accuracy, defocus = replace(self.accuracy, whole_pixels=0), self.defocus
        if defocus is not None:
            defocus = defocus.with_moved_pixels()
        return replace(self, accuracy=accuracy, defocus=defocus)

    def on_wider_photosites(self) -> Self:
        """Return the plan of the same blur on photosites twice as wide, which cover the window and one more on each side."""
        assert self.defocus is not None  # only a blur is computed on wider photosites
        x, y = self.window.x // 2 - 1, self.window.y // 2 - 1
        right, bottom = (self.window.x + self.window.width + 1) // 2 + 1, (self.window.y + self.window.height + 1) // 2 + 1
        width, height = self.sensor_px
        return replace(
            self,
            projection=self.projection.on_wider_photosites(),
            moved_radii=None if self.moved_radii is None else self.moved_radii.on_wider_photosites(),
            window=Window(x, y, right - x, bottom - y),
            sensor_px=((width + 1) // 2, (height + 1) // 2),
            defocus=self.defocus.on_wider_photosites(),
        )

    @property
    def moving_blur(self) -> Defocus | None:
        """The blur with the motion that the points of its aperture carry, of the light whose error is larger; None: no blur."""
        if self.joint is None or self.defocus is None:
            return self.defocus
        moving = [motion for motion in (self.motion, self.flash_motion) if motion is not None]
        return replace(self.defocus, motion=replace(self.joint, path=max(moving, key=lambda motion: motion.error).path))

    def cfa_macros(self) -> dict[str, object]:
        """Macros of kernels/cfa.h for the window."""
        return self.cfa.macros(self.window.x, self.window.y)


def _some_rows(window: Window, count: int) -> np.ndarray:
    """So many rows of a window, or all if it has fewer."""
    return np.linspace(window.y, window.y + window.height - 1, min(window.height, count)).astype(np.intp)
