"""The recipe of a sample: all that is drawn for it. A function of the configuration and the sample's number alone."""

from dataclasses import dataclass

from data_gen.recipe.dataset_config import DataSet
from data_gen.recipe.distributions import Normal, draw, weighted
from data_gen.recipe.noise_setting import NoiseSetting
from data_gen.recipe.random_streams import Chance
from data_gen.sources.patches import AUGMENTATIONS, Augmentation
from simulator.errors import require

SEEDS = 2**32


@dataclass(frozen=True)
class Recipe:
    """All that is drawn for a sample, before any picture is read.

    group: random numbers that the samples of one picture share; they draw the picture and what its source leaves to chance.
    collection: section of the configuration's pictures; "" without a picture.
    place: two numbers in [0, 1): how far down and right the crop lies, over all places that fit.
    level: signal of a flat frame, 0 dark, 1 saturated; for a sample without a picture.
    window: x and y of the crop's corner on the sensor, both even, so that its colour filter begins like the camera's [px].
    """

    index: int
    group: Chance
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


def recipe(config: DataSet, index: int, attempt: int = 0) -> Recipe:
    """Draw a sample.

    attempt: 0, or how many pictures drawn before for this sample could not be used. It changes this sample alone.
    Raises PhotositeError when the camera's sensor is smaller than the crop.
    """
    group = Chance(config.seed, index // config.crops_per_picture, attempt)
    chance = Chance(config.seed, index, attempt)
    setting = config.noise.drawn(group, chance)
    return Recipe(
        index=index,
        group=group,
        collection=_collection(config, group),
        place=tuple(chance.shares("place", 2)),
        augmentation=AUGMENTATIONS[chance.whole("augmentation", len(AUGMENTATIONS)) if config.augment else 0],
        level=draw(config.noise_only.level, chance.share("level")) if config.mode == "noise_only" else 0.0,
        setting=setting,
        exposure_ratios=_exposure_ratios(config, chance),
        offsets_px=_offsets(config, chance),
        frame_seeds=_frame_seeds(config, index),
        body_seed=_body_seed(config, setting, index, chance),
        window=_window(config, setting, chance),
    )


def picture_name(names: tuple[str, ...], group: Chance) -> str:
    """Return the picture of a group among those of its collection."""
    return names[group.whole("picture", len(names))]


def _collection(config: DataSet, group: Chance) -> str:
    if not config.needs_pictures:
        return ""
    return tuple(config.pictures)[weighted(config.weights, group.share("collection"))]


def _exposure_ratios(config: DataSet, chance: Chance) -> tuple[float, ...]:
    ratio = draw(config.ratio_sampler, chance.share("exposure ratio"))
    if config.mode == "multi_exposure":
        return tuple(ratio * factor for factor in config.multi_exposure.ratios)
    return (ratio,) * config.frames


def _offsets(config: DataSet, chance: Chance) -> tuple[tuple[float, float], ...]:
    """Shifts (y, x) against the first frame; a normal draw stops at the reach, which fewer than one in 10^8 pass."""
    if config.mode != "burst":
        return ((0.0, 0.0),) * config.frames
    sampler, reach = config.burst.shift_px, config.burst.reach_px
    if isinstance(sampler, Normal) and sampler.within is None:
        sampler = Normal(sampler.normal, (-reach, reach))
    drawn = [draw(sampler, share) for share in chance.shares("shift", 2 * config.frames)]
    return ((0.0, 0.0), *zip(drawn[2::2], drawn[3::2], strict=True))


def _frame_seeds(config: DataSet, index: int) -> tuple[int, ...]:
    """One after the other from a number that the data set draws, so that no two frames of 2^32 have the same noise."""
    first = Chance(config.seed, 0).whole("first frame seed", SEEDS) + index * config.frames
    return tuple((first + frame) % SEEDS for frame in range(config.frames))


def _body_seed(config: DataSet, setting: NoiseSetting, index: int, chance: Chance) -> int:
    body = index if config.bodies is None else chance.whole("body", config.bodies)
    return Chance(config.seed, body).whole(f"seed of a {setting.label}", SEEDS)


def _window(config: DataSet, setting: NoiseSetting, chance: Chance) -> tuple[int, int]:
    active, (height, width) = setting.camera.active, config.crop_px
    sides, corner = ((active.x, active.width, width), (active.y, active.height, height)), []
    for (first, extent, side), share in zip(sides, chance.shares("window", 2), strict=True):
        first, last = first + first % 2, first + extent - side
        rule = f"the sensor of the {setting.label} is only {active.width} x {active.height} photosites; ask for smaller samples"
        require(last >= first, "crop", [height, width], rule)
        corner.append(first + 2 * int(share * ((last - first) // 2 + 1)))
    return tuple(corner)
