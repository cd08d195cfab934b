"""Fixtures: the device under test, and a bench that runs single kernels, headers and stages."""

import numpy as np
import pytest

from simulator.device import expanded, open_device
from simulator.scene import Scene
from simulator.sensing import FrameSetting, Part, sense
from simulator.sensor import STAGES
from simulator.sensor.adc import Adc
from simulator.sensor.analog_gain import AnalogGain
from simulator.sensor.camera import Camera, IsoSetting, SpectralResponse
from simulator.sensor.seeds import Seeds
from simulator.stage import Stage


class FixedScene:
    """A scene that is already there."""

    def __init__(self, scene: Scene):
        self.scene = scene

    def load(self) -> Scene:
        return self.scene


def band_scene(planes, depth_m=2.0, **settings) -> FixedScene:
    """Planes (height, width[, bands]); each band is equal-energy light over a third of 400-700 nm, or all of it."""
    planes = np.asarray(planes, dtype=np.float32)
    planes = planes[..., None] if planes.ndim == 2 else planes
    wavelengths = np.arange(400.0, 701.0, 10.0)
    edges = np.linspace(400.0, 701.0, planes.shape[2] + 1)
    spectra = np.stack([(wavelengths >= low) & (wavelengths < high) for low, high in zip(edges[:-1], edges[1:], strict=True)])
    return FixedScene(Scene(planes, 1e-3 * spectra, wavelengths, np.ones(31), depth_m=depth_m, **settings))


def test_camera(width=64, height=48, cfa="MONO", **settings) -> Camera:
    """A small camera whose colours see separate thirds of the spectrum, with unit quantum efficiency."""
    wavelengths = np.arange(400.0, 701.0, 10.0)
    thirds = np.stack([wavelengths >= 601, (wavelengths >= 501) & (wavelengths < 601), wavelengths < 501], axis=-1)
    efficiency = np.ones((31, 1)) if cfa == "MONO" else thirds.astype(float)
    defaults = {
        "make": "Photosite",
        "model": "test",
        "width_px": width,
        "height_px": height,
        "pixel_pitch_um": 5.0,
        "cfa": cfa,
        "bit_depth": 16,
        "black_level_dn": 0.0,
        "response": SpectralResponse(wavelengths, efficiency),
        "iso_table": {100: IsoSetting(1.0, 0.0)},
        "stages": {},
    }
    return Camera(**{**defaults, **settings})


test_camera.__test__ = False


NUMBERS = {  # of every stage that a camera file can switch on, all with an effect
    "banding": (2.0, 30.0),
    "column_offset": (1.5,),
    "dark_current": (3.0, 2.0),
    "dead_pixels": (0.01,),
    "digital_gain": (1.25, 300.0),
    "dsnu": (2.0,),
    "full_well": (20000.0,),
    "hot_pixels": (0.02, 300.0, 2.0),
    "nonlinearity": ((0.0, 20.0, -10.0, 0.0), 40000.0),
    "photon_shot_noise": (),
    "prnu": (0.02,),
    "random_telegraph_noise": (0.05, 30.0),
    "row_noise": (1.0,),
}


def every_stage() -> dict[str, Stage]:
    """One of each stage that a camera file can switch on."""
    return {stem: stage(*NUMBERS[stem]) for stem, stage in STAGES.items() if stage.in_camera_stages}


class Bench:
    """Runs parts of the chain on one device."""

    def __init__(self, device):
        self.device = device

    def header(
        self, include: str, expression: str, arrays: dict[str, np.ndarray], defines=None, dtype=np.float32, function=""
    ) -> np.ndarray:
        """`expression` of a kernel header (and a function), evaluated at every element of 1-D arrays named as in it."""
        kinds = {"float32": "float", "uint32": "uint"}
        names = ", ".join(f"global const {kinds[str(a.dtype)]} *{n}_" for n, a in arrays.items())
        reads = " ".join(f"const {kinds[str(a.dtype)]} {n} = {n}_[i];" for n, a in arrays.items())
        source = (
            f'#include "{include}"\n{function}\nkernel void probe({names}, global {kinds[np.dtype(dtype).name]} *result) '
            f"{{ const size_t i = get_global_id(0); {reads} result[i] = {expression}; }}"
        )
        count = len(next(iter(arrays.values())))
        result = self.device.empty((count,), dtype)
        kernel = self.device.build(expanded(source), "probe", defines or {})
        buffers = {f"{name}_": self.device.upload(array) for name, array in arrays.items()}
        self.device.run(kernel, (count,), None, result=result, **buffers)
        return self.device.download(result, (count,), dtype)

    def sensor(
        self, mean_electrons, *stages: Stage, frame_seed=1, body_seed=2, x=0, y=0, gain=1.0, bits=16, black=0.0
    ) -> np.ndarray:
        """Codes of the fused kernel for these mean electrons (height, width), with only the stages given."""
        chain = {stage.stem: stage for stage in (AnalogGain(gain), Adc(bits, black), *stages)}
        setting = FrameSetting(tuple(chain.values()), Seeds(body_seed, frame_seed), x, y)
        # Not through `capture`, which refuses more electrons than any light gives: the kernel must saturate there.
        means = np.ascontiguousarray(mean_electrons, np.float32)
        codes = self.device.empty(means.shape, np.uint16)
        sense(self.device, self.device.upload(means), codes, means.shape, [setting], Part.WHOLE)
        return self.device.download(codes, means.shape, np.uint16)


@pytest.fixture(scope="session")
def device():
    """The device under test: $PHOTOSITE_DEVICE or the default."""
    return open_device()


@pytest.fixture(scope="session")
def bench(device):
    """Runs parts of the chain."""
    return Bench(device)
