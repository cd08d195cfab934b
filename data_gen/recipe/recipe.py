"""The recipe of a sample: all that is drawn for it. A function of the configuration and the sample's number alone."""

from collections.abc import Sequence
from dataclasses import dataclass

from data_gen.recipe.dataset_config import DataSet
from data_gen.recipe.moving_camera import MovingCamera
from data_gen.recipe.noise_setting import NoiseSetting
from data_gen.sources.patches import AUGMENTATIONS, Augmentation
from simulator.config.distributions import Normal, draw, weighted_index
from simulator.config.random_streams import RandomStream
from simulator.errors import require

SEEDS = 2**32


@dataclass(frozen=True)
class Recipe:
    """All that is drawn for a sample, before any picture is read.

    group: random stream that the samples of one picture share; it draws the picture and the random choices of its source.
    collection: section of the configuration's pictures; "" without a picture.
    place: two numbers in [0, 1): how far down and right the crop lies, over all places that fit.
    level: signal of a flat frame, 0 dark, 1 saturated; for a sample without a picture.
    window: x and y of the crop's corner on the sensor, both even, so that its colour filter begins like the camera's [px].
    moving: how the camera moves; None: it stands still.
    """

    index: int
    group: RandomStream
    collection: str
    place: tuple[float, float]
    augmentation: Augmentation
    level: float
    setting: NoiseSetting
    exposure_ratios: tuple[float, ...]
    offsets_px: tuple[tuple[float, float], ...]
    frame_seeds: tuple[int, ...]
    body_seed: int
    window: tuple[int, int]
    moving: MovingCamera | None = None


def draw_recipe(config: DataSet, index: int, attempt: int = 0) -> Recipe:
    """Draw a sample.

    attempt: 0, or how many pictures drawn before for this sample could not be used. It changes this sample alone.
    Raises PhotositeError when the camera's sensor is smaller than the crop.
    """
    group = RandomStream(config.seed, index // config.crops_per_picture, attempt)
    stream = RandomStream(config.seed, index, attempt)
    moving = None if config.motion is None else config.motion.draw(stream, config.frames)
    setting = config.noise.draw_setting(group, stream, None if moving is None else moving.exposure_s)
    down, right = stream.uniforms("place", 2)
    return Recipe(
        index=index,
        group=group,
        collection=_collection(config, group),
        place=(down, right),
        augmentation=AUGMENTATIONS[stream.integer("augmentation", len(AUGMENTATIONS)) if config.augment else 0],
        level=draw(config.noise_only.level, stream.uniform("level")) if config.mode == "noise_only" else 0.0,
        setting=setting,
        exposure_ratios=_exposure_ratios(config, stream),
        offsets_px=_offsets(config, stream),
        frame_seeds=_frame_seeds(config, index),
        body_seed=_body_seed(config, setting, index, stream),
        window=_window(config, setting, stream),
        moving=moving,
    )


def choose_picture(names: Sequence[str], group: RandomStream) -> str:
    """Return the picture of a group among those of its collection."""
    return names[group.integer("picture", len(names))]


def _collection(config: DataSet, group: RandomStream) -> str:
    """Draw a collection by its weight; "" for modes without pictures."""
    if not config.needs_pictures:
        return ""
    return tuple(config.pictures)[weighted_index(config.weights, group.uniform("collection"))]


def _exposure_ratios(config: DataSet, stream: RandomStream) -> tuple[float, ...]:
    """Draw each frame's exposure ratio."""
    ratio = draw(config.ratio_distribution, stream.uniform("exposure ratio"))
    if config.mode == "multi_exposure":
        return tuple(ratio * factor for factor in config.multi_exposure.ratios)
    return (ratio,) * config.frames


def _offsets(config: DataSet, stream: RandomStream) -> tuple[tuple[float, float], ...]:
    """Draw each frame's shift (y, x) against the first [px].

    An unbounded normal distribution is cut at the reach, six standard deviations; fewer than one draw in 10^8 lies beyond.
    """
    if config.mode != "burst" or config.motion is not None:
        return ((0.0, 0.0),) * config.frames
    distribution, reach = config.burst.shifts, config.burst.reach_px
    if isinstance(distribution, Normal) and distribution.within is None:
        distribution = Normal(distribution.normal, (-reach, reach))
    drawn = [draw(distribution, probability) for probability in stream.uniforms("shift", 2 * config.frames)]
    return ((0.0, 0.0), *zip(drawn[2::2], drawn[3::2], strict=True))


def _frame_seeds(config: DataSet, index: int) -> tuple[int, ...]:
    """Number the frames of the whole data set from a seed drawn once, so that no two of 2^32 frames have the same noise."""
    first = RandomStream(config.seed, 0).integer("first frame seed", SEEDS) + index * config.frames
    return tuple((first + frame) % SEEDS for frame in range(config.frames))


def _body_seed(config: DataSet, setting: NoiseSetting, index: int, stream: RandomStream) -> int:
    """Draw the seed of the camera body's fixed patterns."""
    body = index if config.bodies is None else stream.integer("body", config.bodies)
    return RandomStream(config.seed, body).integer(f"seed of a {setting.label}", SEEDS)


def _window(config: DataSet, setting: NoiseSetting, stream: RandomStream) -> tuple[int, int]:
    """Draw x and y of the crop's corner on the active area, both even [px]."""
    active, (height, width) = setting.camera.active, config.crop_px
    rule = f"the sensor of the {setting.label} is only {active.width} x {active.height} photosites; ask for smaller samples"

    def even_place(first: int, extent: int, side: int, probability: float) -> int:
        first, last = first + first % 2, first + extent - side
        require(last >= first, "crop", [height, width], rule)
        return first + 2 * int(probability * ((last - first) // 2 + 1))

    along_x, along_y = stream.uniforms("window", 2)
    return even_place(active.x, active.width, width, along_x), even_place(active.y, active.height, height, along_y)
