"""A small data set without files: toy pictures, one calibrated camera."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from data_gen.generate import Generator
from data_gen.recipe.camera_noise import CameraChoice, CameraNoise
from data_gen.recipe.dataset_config import DataSet
from data_gen.samples.sample import Sample
from data_gen.sources.source import CleanImage, PictureSource
from helpers.camera_builders import small_camera
from simulator.config.distributions import LogUniform
from simulator.device import Device
from simulator.errors import PhotositeError
from simulator.sensor.camera.camera import Camera, IsoSetting
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise

GAIN, READ_DN, BLACK_DN, WHITE_DN = 0.5, 3.0, 64.0, 1023


def toy_camera(**settings: Any) -> Camera:
    """10 bits, K = 0.5 DN/e- at ISO 100 and 1.0 at ISO 200, read noise 3 DN; the ADC saturates before the well."""
    table = {100: IsoSetting(GAIN, READ_DN), 200: IsoSetting(2 * GAIN, READ_DN)}
    stages = {"photon_shot_noise": PhotonShotNoise(), "full_well": FullWell(5000.0)}
    known = {"cfa": "RGGB", "bit_depth": 10, "black_level_dn": BLACK_DN, "iso_table": table, "stages": stages}
    return small_camera(96, 80, **(known | settings))


class ToyPictures:
    """Ramps of 64 x 64 pixels, each colour at another level. Names in `bad` cannot be read."""

    def __init__(self, count: int = 8, bad: tuple[str, ...] = ()) -> None:
        self.count, self.bad = count, bad
        self.read_names: list[str] = []

    def names(self) -> tuple[str, ...]:
        return tuple(f"{number:03d}" for number in range(self.count))

    def fingerprints(self) -> Iterator[str]:
        yield from ()

    def read(self, name: str, rng: np.random.Generator) -> CleanImage:
        self.read_names.append(name)
        if name in self.bad:
            raise PhotositeError(f"{name}: is broken")
        ramp = np.linspace(0.05, 0.95, 64)[np.newaxis, :, np.newaxis] * np.array([0.5, 1.0, 0.7]) * (1 + int(name)) / self.count
        planes = np.broadcast_to(ramp, (64, 64, 3)).astype(np.float32)
        return CleanImage(planes, None, (2.0, 1.0, 1.5), tuple(map(tuple, np.eye(3))))


def toy_config(camera: Camera | None = None, **settings: Any) -> DataSet:
    """Samples of 16 x 24 from toy pictures at ISO 100 and 200, ratio 1 to 16."""
    noise = CameraNoise({"toy": CameraChoice(camera or toy_camera())})
    known = {"noise": noise, "pictures": {"ramps": lambda camera: ToyPictures()}, "exposure_ratio": LogUniform((1.0, 16.0))}
    return DataSet(**({"count": 20, "crop_px": (16, 24)} | known | settings))


def toy_samples(
    device: Device, config: DataSet, indices: Iterable[int] | None = None, source: PictureSource | None = None
) -> tuple[list[Sample], Generator]:
    """Samples of a configuration, and the generator that made them."""
    if source is not None:
        config = replace(config, pictures={"ramps": lambda camera: source})
    generator = Generator(config, device)
    return list(generator.samples(range(config.count) if indices is None else indices)), generator


def at_iso(config: DataSet, iso: int) -> DataSet:
    """The same at one ISO."""
    cameras = {name: replace(choice, iso=iso) for name, choice in config.noise.cameras.items()}
    return replace(config, noise=replace(config.noise, cameras=cameras))
