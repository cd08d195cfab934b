"""What a data set is: its configuration as frozen objects. docs/dataset.md says how the file is written."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from data_gen.recipe.camera_noise import CameraNoise
from data_gen.recipe.moving_camera import CameraMotion
from data_gen.recipe.own_prior import OwnPrior
from data_gen.recipe.published_priors import PriorNoise
from data_gen.samples.sample import Mode
from data_gen.sources.collections import Pictures, open_collection
from data_gen.storage.writers.writer import FORMATS, WriterOptions
from simulator.config import load_file, named_file
from simulator.config.distributions import Distribution, LogUniform, Normal, check_weights, support_of
from simulator.config.random_streams import LARGEST_SEED
from simulator.errors import require

LARGEST_COUNT = 2**48
OF_MOTION = "webdataset", "hdf5", "zarr", "lmdb"  # formats that hold all of a sample of a moving camera


@dataclass(frozen=True)
class Burst:
    """Several frames of one scene, each moved against the first.

    frames: how many, 2 to 64.
    shift_px: shift of a frame along y and along x, drawn for each [px]; left out: normal, mean 0, standard deviation 1, unless
        the camera moves.
    """

    frames: int = 8
    shift_px: Distribution | None = None

    def __post_init__(self) -> None:
        require(2 <= self.frames <= 64, "burst.frames", self.frames, "give 2 to 64")
        reach = self.reach_px
        require(reach <= 64, "burst.shift", f"up to {reach} px", "shifts beyond 64 pixels are no burst; narrow the range")

    @property
    def shifts(self) -> Distribution:
        """Distribution of the shift."""
        return Normal((0.0, 1.0)) if self.shift_px is None else self.shift_px

    @property
    def reach_px(self) -> int:
        """Largest shift, rounded up; a normal one ends at six standard deviations."""
        shifts = self.shifts
        if isinstance(shifts, Normal) and shifts.within is None:
            mean, deviation = shifts.normal
            return math.ceil(abs(mean) + 6.0 * deviation)
        return math.ceil(max(map(abs, support_of(shifts))))


@dataclass(frozen=True)
class MultiExposure:
    """Several frames of one scene with different light.

    ratios: what each frame's exposure ratio is multiplied by.
    """

    ratios: tuple[float, ...] = (1.0, 4.0, 16.0)

    def __post_init__(self) -> None:
        good = 2 <= len(self.ratios) <= 64 and all(0 < ratio < math.inf for ratio in self.ratios)
        require(good, "multi_exposure.ratios", list(self.ratios), "give 2 to 64 ratios above 0")


@dataclass(frozen=True)
class NoiseOnly:
    """Flat frames: what differs from the clean code is noise alone.

    level: signal of the reference exposure, 0 dark, 1 saturated.
    """

    level: Distribution = LogUniform((1e-3, 1.0))

    def __post_init__(self) -> None:
        low, high = support_of(self.level)
        require(0 <= low and high <= 1, "noise_only.level", f"{low:g} to {high:g}", "give 0 (dark) to 1 (saturated)")


@dataclass(frozen=True)
class WriterChoice:
    """How samples are stored.

    format: of the shards; docs/dataset.md lists them.
    channels: mosaic as the sensor has it, or four planes in the order rggb or rgbg.
    samples_per_shard: a shard is the unit of work, of restarting and of distribution.
    """

    format: str = "webdataset"
    channels: Literal["mosaic", "rggb", "rgbg"] = "mosaic"
    samples_per_shard: int = 1000

    def __post_init__(self) -> None:
        require(self.format in FORMATS, "writer.format", self.format, f"give one of {', '.join(FORMATS)}")
        most = 10**8 if self.format == "eld" else 10**9  # ELD's keys have eight digits
        rule = f"give 1 to {most}"
        require(1 <= self.samples_per_shard <= most, "writer.samples_per_shard", self.samples_per_shard, rule)

    @property
    def options(self) -> WriterOptions:
        """The part of this choice that the writers take."""
        return WriterOptions(self.channels)


@dataclass(frozen=True)
class DataSet:
    """A data set: sample number i is a function of this and of i alone.

    count: samples. seed: of everything that is drawn, 0 to 2^64 - 1.
    crop_px: height and width of a sample, both even [px].
    pictures: where clean pictures come from, a section for each collection, by any name; none for dark and noise_only.
    picture_weights: how often a collection is taken against the others, by its name; 1 when left out.
    noise: calibrated cameras, a published prior, or lines of one's own.
    exposure_ratio: light of the clean reference over that of the noisy frame; 1, or the prior's when left out.
    mode: single, burst, dark, noise_only or multi_exposure; of the last sections, the one of that name counts.
    motion: camera that moves, in modes with pictures; left out: it stands still, but for the shifts of a burst.
    variance: whether samples hold the variance of each code.
    augment: flips and transposition, each with probability 1/2.
    crops_per_picture: samples in a row that are cut from one picture, seen by one camera.
    bodies: camera bodies of each camera, each with its own fixed patterns; another for every sample when left out.
    on_problem: skip takes another picture in place of one that cannot be used, refuse stops.
    name, description, license: for the data card; the licence is that of the pictures.
    resolved: the full configuration, plain data.
    """

    count: int
    crop_px: tuple[int, int]
    noise: CameraNoise | PriorNoise | OwnPrior
    pictures: dict[str, Pictures] = field(default_factory=dict)
    picture_weights: dict[str, float] = field(default_factory=dict)
    seed: int = 0
    exposure_ratio: Distribution | None = None
    mode: Mode = "single"
    motion: CameraMotion | None = None
    variance: bool = False
    augment: bool = True
    crops_per_picture: int = 1
    bodies: int | None = None
    on_problem: Literal["skip", "refuse"] = "skip"
    name: str = "Photosite data set"
    license: str = "not stated"
    description: str = ""
    writer: WriterChoice = WriterChoice()
    burst: Burst = Burst()
    multi_exposure: MultiExposure = MultiExposure()
    noise_only: NoiseOnly = NoiseOnly()
    resolved: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        require(1 <= self.count <= LARGEST_COUNT, "count", self.count, "give 1 to 2^48 samples")
        require(0 <= self.seed <= LARGEST_SEED, "seed", self.seed, "give a whole number from 0 to 2^64 - 1")
        good = all(2 <= side <= 16384 and side % 2 == 0 for side in self.crop_px)
        require(good, "crop", list(self.crop_px), "give height and width, even numbers from 2 to 16384, such as [512, 512]")
        require(self.crops_per_picture >= 1, "crops_per_picture", self.crops_per_picture, "give 1 or more")
        require(self.bodies is None or self.bodies >= 1, "bodies", self.bodies, "give 1 or more, or leave it out")
        ratio = self.ratio_distribution
        require(support_of(ratio)[0] > 0, "exposure_ratio", f"from {support_of(ratio)[0]:g}", "a ratio of light is above 0")
        need = "this mode cuts samples from pictures; name a collection, such as `leaves: {procedural: [dead_leaves]}`"
        require(bool(self.pictures) or not self.needs_pictures, "pictures", "{}", need)
        if self.motion is not None:
            rule = f"there is no picture to move in mode {self.mode}; leave it out"
            require(self.needs_pictures, "motion", "given", rule)
            rule = "the camera's path moves the frames; leave the shift out"
            require(self.burst.shift_px is None, "burst.shift", self.burst.shift_px, rule)
            if isinstance(self.noise, CameraNoise):
                self.noise.check_dark(support_of(self.motion.exposure_time_s)[1], "motion.exposure_time_s")
            rule = f"has no place for sharp twins and flow; give one of {', '.join(OF_MOTION)}"
            require(self.writer.format in OF_MOTION, "writer.format", self.writer.format, rule)
        for name in self.picture_weights:
            require(name in self.pictures, "picture_weights", name, f"no such collection; there is {', '.join(self.pictures)}")
        check_weights("picture_weights", self.weights or (1.0,))
        for name in self.pictures:
            for camera in self.noise.list_cameras():
                open_collection(self.pictures, name, camera)

    @property
    def weights(self) -> tuple[float, ...]:
        """How often each collection is drawn against the others, in the order of the collections."""
        return tuple(self.picture_weights.get(name, 1.0) for name in self.pictures)

    @property
    def needs_pictures(self) -> bool:
        """Whether samples are cut from pictures."""
        return self.mode not in ("dark", "noise_only")

    @property
    def ratio_distribution(self) -> Distribution:
        """Distribution of the exposure ratio."""
        return self.noise.exposure_ratio if self.exposure_ratio is None else self.exposure_ratio

    @property
    def frames(self) -> int:
        """Frames of a sample."""
        return {"burst": self.burst.frames, "multi_exposure": len(self.multi_exposure.ratios)}.get(self.mode, 1)


def load_data_set(path: str | Path, overrides: Iterable[str] = ()) -> DataSet:
    """Read a data set's configuration.

    path: of the file, or the name of one in configs/datasets. overrides: `dotted.path=value` texts as --set takes them.
    Raises PhotositeError with file, line, key, value and fix.
    """
    return load_file(DataSet, named_file("datasets", path), overrides)
