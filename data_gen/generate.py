"""From recipes to samples: pictures are read and cut, and the noise of a batch of frames is drawn in one launch."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice

import numpy as np

from data_gen.moving_frames import Light, MovingFrames, expose_moving
from data_gen.recipe.dataset_config import DataSet
from data_gen.recipe.recipe import Recipe, choose_picture, draw_recipe
from data_gen.samples.sample import Sample
from data_gen.sources.collections import open_collection
from data_gen.sources.decoded_pictures import DecodedPictures
from data_gen.sources.patches import AUGMENTATIONS, Augmentation, Crop, choose_crop, cut_patch
from data_gen.sources.photographs import Photographs
from data_gen.sources.procedural import Procedural
from data_gen.sources.source import Picture, PictureSource, apply_cfa
from simulator.config.random_streams import RandomStream
from simulator.device import Device
from simulator.errors import PhotositeError
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack, frame_stack_moments
from simulator.sensor.seeds import Seeds

MOST_ATTEMPTS = 100  # pictures drawn for one sample before the collection counts as unusable
SPLINE_PX = 8  # distance at which the border changes a cubic spline by less than 10^-4 (the prefilter's pole is -0.27)
KEPT_BYTES = 2**28  # of pictures in memory, for the next crop of one: 21 drawings of 1024 x 1024, or a single larger picture
MOST_PICTURES = 64  # in use at a time in an epoch of several crops of each
PHOTOGRAPH_BYTES = 75_000_000  # decoded, of 25 megapixels
BATCH_PIXELS = 2**22  # of one kernel launch, 16 mosaics of 512 x 512; larger batches miss the cache and are slower per pixel

Clean = np.ndarray | MovingFrames  # clean frames of a sample


class Generator:
    """Makes samples of a data set.

    problems: for each message about a picture that could not be used, the indices of the samples that had drawn it.
    """

    def __init__(
        self,
        config: DataSet,
        device: Device,
        sources: dict[tuple[str, int], PictureSource] | None = None,
        decoded: DecodedPictures | None = None,
    ) -> None:
        """Take a configuration and the device that draws its noise.

        sources: collections that are already open, by name and index of the camera; those opened later are added.
        decoded: where collections that are opened here keep decoded pictures; None: nowhere.
        """
        self.config, self.device = config, device
        self.problems: dict[str, list[int]] = {}
        self._sources = {} if sources is None else sources
        self._decoded = decoded if decoded is None or config.crops_per_picture > 1 else decoded.keeping_used()
        self._cameras = {id(camera): place for place, camera in enumerate(config.noise.list_cameras())}
        self._read: dict[tuple[tuple[str, int], RandomStream], Picture] = {}  # in the order of their last use

    def samples(self, indices: Iterable[int]) -> Iterator[Sample]:
        """Make the samples of these indices, in this order. A sample does not depend on which others are made.

        Raises PhotositeError when a picture cannot be used and the configuration refuses, or none can.
        """
        height, width = self.config.crop_px
        size = max(1, BATCH_PIXELS // (height * width * self.config.frames))
        remaining = iter(indices)
        while batch := tuple(islice(remaining, size)):
            yield from self._make_batch(batch)

    def _make_batch(self, indices: Iterable[int]) -> Iterator[Sample]:
        """Make samples whose noise is drawn in one kernel launch."""
        drawn = [self._draw_clean(index) for index in indices]
        stacked = np.empty((len(drawn), self.config.frames, *self.config.crop_px), np.float32)
        settings: list[FrameSetting] = []
        for place, (one, _, clean, _) in enumerate(drawn):
            ratios = np.array(one.exposure_ratios)[:, np.newaxis, np.newaxis]
            # Computed in double precision and rounded once, without a temporary array.
            np.multiply(_signal(clean), one.setting.reference_electrons / ratios, out=stacked[place], casting="same_kind")
            x, y = one.window
            settings += [FrameSetting(one.setting.stages, Seeds(one.body_seed, frame), x, y) for frame in one.frame_seeds]
        electrons = stacked.reshape(-1, *self.config.crop_px)
        noisy = expose_frame_stack(self.device, electrons, settings)
        variance_dn2 = frame_stack_moments(self.device, electrons, settings)[1] if self.config.variance else None
        first = 0
        for one, picture, clean, crop in drawn:
            frames = slice(first, first + self.config.frames)
            first += self.config.frames
            variance = None if variance_dn2 is None else variance_dn2[frames]
            yield self._assemble(one, picture, clean, crop, noisy[frames], variance)

    def _draw_clean(self, index: int) -> tuple[Recipe, tuple[str, Picture] | None, Clean, Crop | None]:
        """Draw the clean signal of a sample: recipe, picture with its name, clean frames and crop.

        Modes without pictures get a flat signal and no crop. A picture that cannot be used is noted in `problems`, and another
        is drawn in its place.
        """
        reason: PhotositeError | None = None
        for attempt in range(MOST_ATTEMPTS):
            one = draw_recipe(self.config, index, attempt)
            if not self.config.needs_pictures:
                return one, None, np.full((1, *self.config.crop_px), one.level, np.float32), None
            try:
                name, picture = self._read_picture(one)
                return one, (name, picture), *self._cut_frames(one, picture, name)
            except PhotositeError as error:
                if self.config.on_problem == "refuse":
                    raise
                drew = self.problems.setdefault(str(error), [])
                if drew[-1:] != [index]:
                    drew.append(index)
                reason = error
        raise PhotositeError(
            f"none of {MOST_ATTEMPTS} pictures drawn for it can be used; the last one: {reason}", part=f"sample {index}"
        )

    def _read_picture(self, one: Recipe) -> tuple[str, Picture]:
        """Read the picture that the recipe draws; return its name within its collection and its content."""
        camera = one.setting.camera
        key = (one.collection, self._cameras[id(camera)])
        if key not in self._sources:
            self._sources[key] = open_collection(
                self.config.pictures, one.collection, camera, self._decoded, self.device.info.label
            )
        name = choose_picture(self._sources[key].names(), one.group)
        picture = self._read.pop((key, one.group), None)
        if picture is None:
            picture = self._sources[key].read(name, one.group.generator("source"))
            self._forget_pictures((KEPT_BYTES if self.config.crops_per_picture > 1 else 0) - picture.held_bytes)
        self._read[key, one.group] = picture
        return f"{one.collection}/{name}", picture

    def _forget_pictures(self, left_bytes: int) -> None:
        """Forget the pictures that were not used for longest, until the others hold no more than so many bytes."""
        while self._read and sum(each.held_bytes for each in self._read.values()) > left_bytes:
            del self._read[next(iter(self._read))]

    def _cut_frames(self, one: Recipe, picture: Picture, name: str) -> tuple[Clean, Crop]:
        """Cut the mosaics (frames, height, width) of a sample from its picture; return them and the crop."""
        cfa, size = one.setting.camera.cfa, self.config.crop_px
        others = AUGMENTATIONS if self.config.augment else ()
        if one.moving is not None:
            sensor_rows = one.setting.camera.height_px
            reach = one.moving.reach_px(*size)
            planes, inner = self._cut_around(one, picture, name, reach, others)
            setting = one.setting
            electrons, dark_e = setting.reference_electrons, setting.read_noise_dn / setting.gain_dn_per_e
            light = [Light(electrons / ratio, dark_e) for ratio in one.exposure_ratios]
            frames = expose_moving(self.device, planes, reach, one.moving, (one.window[1], sensor_rows), cfa, light)
            return frames, inner
        if self.config.mode != "burst":
            crop = choose_crop(picture, size, cfa, one.place, one.augmentation, name, others)
            return cut_patch(picture, crop, cfa)[np.newaxis], crop
        reach = margin_px(self.config)
        planes, inner = self._cut_around(one, picture, name, reach, others)
        return np.stack([apply_cfa(shift_planes(planes, offset, reach), cfa) for offset in one.offsets_px]), inner

    def _cut_around(
        self, one: Recipe, picture: Picture, name: str, reach: int, others: Sequence[Augmentation]
    ) -> tuple[np.ndarray, Crop]:
        """Cut planes with a border on all sides [px] from a picture; return them and the crop without the border."""
        if picture.cfa is not None:
            raise PhotositeError(
                "is a mosaic, which cannot be moved by parts of a pixel; give pictures with R, G, B", part=name
            )
        (height, width), cfa = self.config.crop_px, one.setting.camera.cfa
        around = height + 2 * reach, width + 2 * reach
        crop = choose_crop(picture, around, cfa, one.place, one.augmentation, name, others)
        inner = Crop(crop.top + reach, crop.left + reach, crop.height - 2 * reach, crop.width - 2 * reach, crop.augmentation)
        return crop.of(picture), inner

    def _assemble(
        self,
        one: Recipe,
        picture: tuple[str, Picture] | None,
        clean: Clean,
        crop: Crop | None,
        noisy_dn: np.ndarray,
        variance_dn2: np.ndarray | None,
    ) -> Sample:
        """Put a sample together from its recipe, its clean signal and its noisy codes."""
        setting, black_dn = one.setting, one.setting.black_level_dn
        white_dn, known = setting.white_level_dn, picture[1] if picture else None
        moved = clean if isinstance(clean, MovingFrames) else None

        def codes(signal: np.ndarray) -> np.ndarray:
            return np.float32(black_dn) + np.minimum(signal, np.float32(1.0)) * np.float32(white_dn - black_dn)

        published = setting.camera.color_matrix
        return Sample(
            index=one.index,
            mode=self.config.mode,
            noisy_dn=noisy_dn,
            clean_dn=np.broadcast_to(codes(_signal(clean)), noisy_dn.shape),
            variance_dn2=variance_dn2,
            cfa=setting.camera.cfa,
            bit_depth=setting.bit_depth,
            black_level_dn=black_dn,
            white_level_dn=white_dn,
            gain_dn_per_e=setting.gain_dn_per_e,
            read_noise_dn=setting.read_noise_dn,
            white_balance=known.white_balance if known else (1.0, 1.0, 1.0),
            color_matrix=known.color_matrix if known else None if published is None else published.xyz_to_camera,
            camera=setting.label,
            iso=setting.iso,
            exposure_ratios=one.exposure_ratios,
            offsets_px=one.offsets_px if moved is None else moved.offsets_px,
            frame_seeds=one.frame_seeds,
            body_seed=one.body_seed,
            source=picture[0] if picture else "",
            crop=(crop.top, crop.left) if crop else (0, 0),
            augmentation=crop.augmentation.name if crop else "none",
            sharp_dn=None if moved is None else codes(moved.sharp),
            flow_px=None if moved is None else moved.flow_px,
            mid_exposure_s=None if moved is None else moved.mid_exposure_s,
            poses_deg=None if moved is None else moved.poses_deg,
            exposure_time_s=None if one.moving is None else one.moving.exposure_s,
            readout_time_s=None if one.moving is None else one.moving.readout_s,
        )


def _signal(clean: Clean) -> np.ndarray:
    """Return the signal of clean frames, (frames, height, width) float32."""
    return clean.signal if isinstance(clean, MovingFrames) else clean


def picture_window(config: DataSet, decoded: DecodedPictures) -> int:
    """Return how many pictures can be in use at a time without being read again for the next crop, at least 1, at most 64."""
    camera, found = config.noise.list_cameras()[0], [MOST_PICTURES]
    for name in config.pictures:
        source = open_collection(config.pictures, name, camera)
        if isinstance(source, Photographs):
            found.append(decoded.limit_bytes // (2 * PHOTOGRAPH_BYTES))
        elif isinstance(source, Procedural):
            found.append(KEPT_BYTES // (12 * source.width_px * source.height_px))
        else:
            found.append(1)
    return max(1, min(found))


def margin_px(config: DataSet) -> int:
    """Width of the border [px] that a burst needs around its crop for shifts and spline interpolation; else 0.

    What a moving camera needs is drawn for each sample.
    """
    return config.burst.reach_px + SPLINE_PX if config.mode == "burst" and config.motion is None else 0


def shift_planes(planes: np.ndarray, offset_px: tuple[float, float], reach: int) -> np.ndarray:
    """Shift planes (height, width, 3) by fractions of a pixel with cubic splines, >= 0; cut `reach` pixels off each side.

    offset_px: y and x; the content of pixel (y, x) moves to (y + offset_px[0], x + offset_px[1]).
    """
    inside = (slice(reach, planes.shape[0] - reach), slice(reach, planes.shape[1] - reach))
    if not any(offset_px):
        return planes[inside]
    from scipy import ndimage

    parts = [ndimage.shift(planes[..., channel], offset_px, order=3, mode="nearest")[inside] for channel in range(3)]
    return np.maximum(np.stack(parts, axis=-1), 0.0).astype(np.float32)
