"""From recipes to samples: pictures are read and cut, and the noise of a batch of frames is drawn in one launch."""

from collections.abc import Iterable, Iterator
from itertools import islice

import numpy as np

from data_gen.recipe.dataset_config import DataSet
from data_gen.recipe.recipe import Recipe, picture_name, recipe
from data_gen.samples.sample import Sample
from data_gen.sources.collections import open_collection
from data_gen.sources.patches import Crop, choose_crop, cut_patch, mosaic_of
from data_gen.sources.source import CleanImage, Source
from simulator.device import Device
from simulator.errors import PhotositeError
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack, frame_stack_moments
from simulator.sensor.seeds import Seeds

MOST_ATTEMPTS = 100  # pictures drawn for one sample before the collection counts as unusable
SPLINE_PX = 8  # beyond which a cubic spline's memory of the border is below 10^-4 (its pole is -0.27)
BATCH_PIXELS = 2**22  # of one launch, 16 mosaics of 512 x 512: more at once take longer, for want of cache and memory pages


class Generator:
    """Makes samples of a data set.

    problems: what was wrong with pictures that could not be used: message -> numbers of the samples that drew them.
    """

    def __init__(self, config: DataSet, device: Device, sources: dict[tuple[str, int], Source] | None = None):
        """sources: collections that are open already, by name and number of the camera; others are added."""
        self.config, self.device = config, device
        self.problems: dict[str, list[int]] = {}
        self._sources = {} if sources is None else sources
        self._last: tuple[object, CleanImage] | None = None

    def samples(self, indices: Iterable[int]) -> Iterator[Sample]:
        """Make samples, in the order asked for. Each is the same whatever the others are.

        Raises PhotositeError when a picture cannot be used and the configuration refuses, or none can.
        """
        height, width = self.config.crop_px
        size = max(1, BATCH_PIXELS // (height * width * self.config.frames))
        remaining = iter(indices)
        while some := tuple(islice(remaining, size)):
            yield from self._batch(some)

    def _batch(self, indices: Iterable[int]) -> Iterator[Sample]:
        drawn = [self._clean(index) for index in indices]
        electrons, settings = np.empty((len(drawn), self.config.frames, *self.config.crop_px), np.float32), []
        for place, (one, _, signal, _) in enumerate(drawn):
            ratios = np.array(one.exposure_ratios)[:, np.newaxis, np.newaxis]
            # In double precision, rounded once, without arrays in between.
            np.multiply(signal, one.setting.reference_electrons / ratios, out=electrons[place], casting="same_kind")
            x, y = one.window
            settings += [FrameSetting(one.setting.stages, Seeds(one.body_seed, frame), x, y) for frame in one.frame_seeds]
        electrons = electrons.reshape(-1, *self.config.crop_px)
        noisy = expose_frame_stack(self.device, electrons, settings)
        spread = frame_stack_moments(self.device, electrons, settings)[1] if self.config.variance else None
        first = 0
        for one, picture, signal, crop in drawn:
            frames = slice(first, first + self.config.frames)
            first += self.config.frames
            yield self._sample(one, picture, signal, crop, noisy[frames], None if spread is None else spread[frames])

    def _clean(self, index: int) -> tuple[Recipe, tuple[str, CleanImage] | None, np.ndarray, Crop | None]:
        """Recipe, picture by name, signal (frames, height, width) and crop of a sample; without a picture a flat signal."""
        for attempt in range(MOST_ATTEMPTS):
            one = recipe(self.config, index, attempt)
            if not self.config.needs_pictures:
                return one, None, np.full((1, *self.config.crop_px), one.level, np.float32), None
            try:
                name, picture = self._picture(one)
                return one, (name, picture), *self._patch(one, picture, name)
            except PhotositeError as error:
                if self.config.on_problem == "refuse":
                    raise
                drew = self.problems.setdefault(str(error), [])
                if drew[-1:] != [index]:
                    drew.append(index)
                told = error
        raise PhotositeError(
            f"none of {MOST_ATTEMPTS} pictures drawn for it can be used; the last one: {told}", part=f"sample {index}"
        )

    def _picture(self, one: Recipe) -> tuple[str, CleanImage]:
        """Name within its collection and content of the picture that the recipe draws."""
        camera = one.setting.camera
        seen = (one.collection, next(place for place, known in enumerate(self.config.noise.seen_by()) if known is camera))
        if seen not in self._sources:
            self._sources[seen] = open_collection(self.config.pictures, one.collection, camera)
        name = picture_name(self._sources[seen].names(), one.group)
        if self._last is None or self._last[0] != (seen, one.group):
            self._last = (seen, one.group), self._sources[seen].read(name, one.group.generator("source"))
        return f"{one.collection}/{name}", self._last[1]

    def _patch(self, one: Recipe, picture: CleanImage, name: str) -> tuple[np.ndarray, Crop]:
        cfa, size = one.setting.camera.cfa, self.config.crop_px
        if self.config.mode != "burst":
            crop = choose_crop(picture, size, cfa, one.place, one.augmentation, name)
            return cut_patch(picture, crop, cfa)[np.newaxis], crop
        if picture.cfa is not None:
            raise PhotositeError(
                "is a mosaic, which cannot be moved by parts of a pixel; give pictures with R, G, B", part=name
            )
        reach = margin_px(self.config)
        around = tuple(side + 2 * reach for side in size)
        crop = choose_crop(picture, around, cfa, one.place, one.augmentation, name)
        planes = crop.of(picture.signal)
        frames = np.stack([mosaic_of(moved(planes, offset, reach), cfa) for offset in one.offsets_px])
        inner = Crop(crop.top + reach, crop.left + reach, crop.height - 2 * reach, crop.width - 2 * reach, one.augmentation)
        return frames, inner

    def _sample(self, one: Recipe, picture, signal: np.ndarray, crop: Crop | None, noisy, spread) -> Sample:
        setting, black_dn = one.setting, one.setting.black_level_dn
        white_dn, known = setting.white_level_dn, picture[1] if picture else None
        clean_dn = np.float32(black_dn) + np.minimum(signal, np.float32(1.0)) * np.float32(white_dn - black_dn)
        published = setting.camera.color_matrix
        return Sample(
            index=one.index,
            mode=self.config.mode,
            noisy_dn=noisy,
            clean_dn=np.broadcast_to(clean_dn, noisy.shape),
            variance_dn2=spread,
            cfa=setting.camera.cfa,
            bit_depth=setting.bit_depth,
            black_level_dn=black_dn,
            white_level_dn=white_dn,
            gain_dn_per_e=setting.gain_dn_per_e,
            read_noise_dn=setting.read_noise_dn,
            white_balance=known.white_balance if known else (1.0, 1.0, 1.0),
            color_matrix=known.color_matrix if known else published and published.xyz_to_camera,
            camera=setting.label,
            iso=setting.iso,
            exposure_ratios=one.exposure_ratios,
            offsets_px=one.offsets_px,
            frame_seeds=one.frame_seeds,
            body_seed=one.body_seed,
            source=picture[0] if picture else "",
            crop=(crop.top, crop.left) if crop else (0, 0),
            augmentation=crop.augmentation.name if crop else "none",
        )


def margin_px(config: DataSet) -> int:
    """Pixels of the picture that are needed around a crop: what a burst's shifts and their splines reach."""
    return config.burst.reach_px + SPLINE_PX if config.mode == "burst" else 0


def moved(planes: np.ndarray, offset_px: tuple[float, float], reach: int) -> np.ndarray:
    """Planes (height, width, channels) moved by parts of a pixel, without the `reach` pixels around: cubic splines, >= 0.

    offset_px: what stands at (y, x) comes to (y + offset, x + offset).
    """
    inside = (slice(reach, planes.shape[0] - reach), slice(reach, planes.shape[1] - reach))
    if not any(offset_px):
        return planes[inside]
    from scipy import ndimage

    parts = [ndimage.shift(planes[..., channel], offset_px, order=3, mode="nearest")[inside] for channel in range(3)]
    return np.maximum(np.stack(parts, axis=-1), 0.0).astype(np.float32)
