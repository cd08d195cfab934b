"""What moves while the shutter is open."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from simulator.errors import PhotositeError, require
from simulator.exposure.camera_motion import CameraPath, Poses, SteadyMotion
from simulator.exposure.camera_table import CameraTable, MeasuredClip
from simulator.exposure.hand_tremor import HandTremor
from simulator.exposure.line_times import LineTimes
from simulator.exposure.mid_exposure import mid_exposure_s
from simulator.exposure.object_motion import LayerMotion, LayerMoves
from simulator.exposure.vector_maps import BlenderVectors, VectorField, VectorMap
from simulator.scene.pixel_file import DataWindow
from simulator.units import Seconds


@dataclass(frozen=True)
class Motion:
    """Motion of a shot, on one clock for the rows of a frame and the frames of a series (`Exposure.start_s`).

    camera: path of the camera; left out: it stands on a tripod.
    layers: motion of layers of the scene, by number from 0, the nearest; those left out stand still. A scene of one picture is
        layer 0.
    vectors: velocity of each pixel of a scene of one picture.
    frame_time_s: what `frame` means in speeds per frame [s], such as 1/24 s.
    flow_time_s: from the middle of this frame's exposure to that of the next, where the truth's flow leads [s]; left out: the
        frame time.
    Raises PhotositeError for speeds per frame without a frame time, and for vectors beside the motion of layers.
    """

    camera: SteadyMotion | CameraTable | MeasuredClip | HandTremor | None = None
    layers: dict[int, LayerMotion] = field(default_factory=dict)
    vectors: VectorMap | BlenderVectors | None = None
    frame_time_s: Seconds | None = None
    flow_time_s: Seconds | None = None

    def __post_init__(self) -> None:
        for key in ("frame_time", "flow_time"):
            time_s, rule = getattr(self, f"{key}_s"), "give a time above 0 s, such as 1/24 s"
            require(time_s is None or 0 < time_s < np.inf, f"motion.{key}", f"{time_s} s", rule)
        for number, layer in self.layers.items():
            require(number >= 0, "motion.layers", number, "name layers by their number from 0, the nearest")
            self._check_frame_time(layer.is_per_frame, f"motion.layers.{number}.velocity")
        if self.vectors is not None:
            rule = "a scene of one picture has vectors, or its layer 0 moves as a whole; leave one of both out"
            require(not self.layers, "motion.vectors", self.vectors.image, rule)
            self._check_frame_time(self.vectors.is_per_frame, "motion.vectors.unit")

    def _check_frame_time(self, is_per_frame: bool, key: str) -> None:
        if is_per_frame and self.frame_time_s is None:
            raise PhotositeError("needs the time of a frame; add motion.frame_time, such as 1/24 s", key=key, value="per frame")

    @property
    def flow_after_s(self) -> float | None:
        """Time that the truth's flow spans [s]; None: not stated."""
        return self.frame_time_s if self.flow_time_s is None else self.flow_time_s

    def camera_poses(self, times_s: np.ndarray) -> Poses:
        """Return the poses of the camera at some instants (instants,) of the clock [s]; 0 on a tripod.

        Raises PhotositeError for instants outside the path.
        """
        return _STILL.poses(times_s) if self.camera is None else self.camera.poses(times_s)

    @property
    def fastest_hz(self) -> float:
        """Highest frequency at which the camera or a layer may move [Hz]. Raises as `check_span`."""
        layers = [layer.fastest_hz(f"motion.layers.{number}") for number, layer in self.layers.items()]
        return max([0.0 if self.camera is None else self.camera.fastest_hz, *layers])

    def layer_moves(self, number: int, times_s: np.ndarray, size: tuple[int, int]) -> LayerMoves | None:
        """Return where a layer is at some instants (instants,) of the clock [s]; None for one that stands still.

        size: (height, width) of the scene [px]. Raises PhotositeError for instants outside a path of limited length.
        """
        layer = self.layers.get(number)
        return None if layer is None else layer.moves(times_s, size, self.frame_time_s, f"motion.layers.{number}")

    def vector_field(self, size: tuple[int, int], window: DataWindow | None = None) -> VectorField | None:
        """Return the velocity of each pixel of the scene; None without vectors.

        size: (height, width) of the scene [px]. window: `Scene.window`. Raises PhotositeError for a file that is missing or
        damaged, of another size or data window than the scene, or holds NaN or Inf.
        """
        return None if self.vectors is None else self.vectors.load(size, self.frame_time_s, window)

    def check_layers(self, nearest_m: Sequence[float]) -> None:
        """Raise PhotositeError for motion that the layers of a scene cannot have.

        These are motion of layers that the scene lacks or in metres of infinitely far ones, and vectors of several layers.
        Tables are read as by `read_path`.
        nearest_m: distance of the nearest place of each layer [m].
        """
        count = len(nearest_m)
        for number, layer in self.layers.items():
            rule = f"the scene has {count} layers, numbered from 0, the nearest; name one of them"
            require(number < count, f"motion.layers.{number}", number, rule)
            if math.isinf(nearest_m[number]) and (moved := layer.moved_in_metres(f"motion.layers.{number}")) is not None:
                key, value = moved
                pixels = "columns x_px, y_px" if key.endswith(".path") else "a velocity in px/s"
                rule = f"is in metres, but the layer is infinitely far; give its depth, such as 3 m, or {pixels}"
                raise PhotositeError(rule, key=key, value=value)
        if self.vectors is not None:
            rule = f"vectors are of one picture, but the scene has {count} layers; give motion.layers instead"
            require(count == 1, "motion.vectors", self.vectors.image, rule)

    def check_span(self, first_s: float, last_s: float) -> None:
        """Raise PhotositeError unless all paths hold from one time of the clock to another [s]."""
        self.camera_poses(np.array([first_s, last_s]))
        for number in self.layers:
            self.layer_moves(number, np.array([first_s, last_s]), (1, 1))

    def needed_span(self, release_s: float, openings: Sequence[LineTimes], has_flow: bool) -> tuple[float, float]:
        """Return the first and last time of the clock at which a frame needs the paths [s].

        That is while any line is open and, with flow, in the middle of the next frame. release_s: of the shutter, on the clock
        [s].
        """
        first_s = min(float(one.opens_s.min()) for one in openings)
        last_s = max(float(one.closed_s.max()) for one in openings)
        if has_flow and self.flow_after_s is not None:
            last_s = max(last_s, self.flow_after_s + float(mid_exposure_s(openings).max()))
        return release_s + first_s, release_s + last_s


_STILL: CameraPath = SteadyMotion()
