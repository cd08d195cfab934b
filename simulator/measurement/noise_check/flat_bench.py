"""Simulated camera test bench: frames of a uniformly lit sensor and dark frames, saved as DNG files."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from simulator.color.spectra import WAVELENGTHS_NM, illuminant, luminance_cd_m2
from simulator.errors import require
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import Plan, plan
from simulator.pipeline.shot import Shot
from simulator.pipeline.simulate import simulate
from simulator.raw.dng.writer import write_dng
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene
from simulator.sensor.camera.camera import Camera, Window
from simulator.sensor.camera.cfa import BAYER
from simulator.sensor.seeds import Seeds
from simulator.sensor.sensor_plan import SensorPlan

BODY_SEED = 1288
NARROW_NM = 0.1  # from the peak of a narrow light to its ends


@dataclass(frozen=True)
class UniformLight:
    """A scene of uniform radiance.

    spectrum_w_m2_sr_nm: (wavelengths,), linear between its entries. wavelengths_nm: ascending [nm].
    """

    spectrum_w_m2_sr_nm: np.ndarray
    wavelengths_nm: np.ndarray = field(default_factory=lambda: WAVELENGTHS_NM)

    def load(self) -> Scene:
        """Make the scene; its white is that of equal energy, so that a narrow band does not divide by zero."""
        planes = np.ones((2, 2, 1), dtype=np.float32)
        grid_nm = self.wavelengths_nm
        return Scene(planes, self.spectrum_w_m2_sr_nm[np.newaxis], grid_nm, np.ones(grid_nm.size), interpolation="nearest")

    def scaled(self, factor: float) -> "UniformLight":
        """The same light, stronger by this factor."""
        return replace(self, spectrum_w_m2_sr_nm=factor * self.spectrum_w_m2_sr_nm)


def white_light() -> UniformLight:
    """Return daylight (D55) of 1 cd/m^2."""
    light = illuminant("D55")
    return UniformLight(light / luminance_cd_m2(light))


def narrow_light(wavelength_nm: float) -> UniformLight:
    """Light of one wavelength, a triangle of NARROW_NM at half its height, of 5 mW m^-2 sr^-1."""
    peak_w_m2_sr_nm = 5e-3 / NARROW_NM
    return UniformLight(np.array([0.0, peak_w_m2_sr_nm, 0.0]), wavelength_nm + NARROW_NM * np.array([-1.0, 0.0, 1.0]))


def bench_camera(camera: Camera, width: int, height: int) -> Camera:
    """Return the camera with a window near the sensor's middle that keeps the sensor's own filter pattern.

    Raises PhotositeError for a camera that bins, since its raw files do not hold single photosites, and for other patterns.
    """
    rule = "single photosites are measured; leave binning out, or set it to null"
    require(camera.binning is None, "camera.binning", camera.binning, rule)
    bayer = "planes of a Bayer pattern or of no filter are measured; name another camera"
    require(camera.cfa in (*BAYER, "MONO"), "camera.cfa", camera.cfa, bayer)
    once = "single readings are measured; leave hdr_readout out, or set it to null"
    require(camera.hdr_readout is None, "camera.hdr_readout", "given", once)
    width, height = min(width, camera.width_px), min(height, camera.height_px)
    x, y = ((camera.width_px - width) // 4 * 2, (camera.height_px - height) // 4 * 2)
    return replace(camera, window=Window(x, y, width, height))


@dataclass(frozen=True)
class FlatBench:
    """Simulates flat and dark frames at one setting of a camera and saves them in a folder.

    The light passes an f/4 lens without cos^4 falloff, so that the mean number of photons is the same for every photosite.
    """

    camera: Camera
    iso: int
    exposure_time_s: float
    light: UniformLight
    folder: Path
    device: str | None = None

    def shot(self, factor: float, seed: int) -> Shot:
        """Return the shot in this multiple of the light; factor 0 is a dark frame."""
        lens = ThinLens(50.0, 4.0, cos4=False)
        exposure, seeds = Exposure(self.exposure_time_s, self.iso), Seeds(BODY_SEED, seed)
        return Shot(self.light.scaled(factor), lens, exposure, self.camera, seeds)

    def take(self, name: str, factor: float, seed: int) -> Path:
        """Simulate a frame and save it as NAME.dng. Raises PhotositeError."""
        path = self.folder / f"{name}.dng"
        write_dng(simulate(self.shot(factor, seed), device=self.device), path)
        return path

    @cached_property
    def planned(self) -> Plan:
        """The plan at factor 1."""
        return plan(self.shot(1.0, 0))

    @property
    def sensor(self) -> SensorPlan:
        """The sensor's part of the plan at factor 1."""
        return self.planned.sensor

    @cached_property
    def illuminance_per_radiance(self) -> float:
        """Irradiance on the sensor over radiance of the scene, on the optical axis [sr]."""
        return self.sensor.irradiance.effective_solid_angle_sr

    @cached_property
    def electrons(self) -> np.ndarray:
        """Mean photoelectrons of a photosite per colour channel at factor 1, (channels,) [e-]."""
        area_s = self.sensor.exposure.collecting_area_um2 * self.exposure_time_s
        return self.planned.optics.weights[0].astype(np.float64) * self.illuminance_per_radiance * area_s

    @cached_property
    def photons(self) -> float:
        """Mean photons on the whole area of a photosite at factor 1, whatever its fill factor (EMVA 1288: mu_p)."""
        scene = self.planned.optics.scene
        per_um2_s_sr = electron_radiance_weights(scene, scene.wavelengths_nm, np.ones((scene.wavelengths_nm.size, 1)))[0, 0]
        return per_um2_s_sr * self.illuminance_per_radiance * self.camera.pixel_pitch_um**2 * self.exposure_time_s

    @cached_property
    def luminous_exposure_lx_s(self) -> float:
        """Luminous exposure H of the sensor at factor 1 [lx s] (ISO 12232)."""
        luminance = float(luminance_cd_m2(self.light.spectrum_w_m2_sr_nm, self.light.wavelengths_nm))
        return luminance * self.illuminance_per_radiance * self.exposure_time_s

    @cached_property
    def saturation_e(self) -> float:
        """Electrons that reach the white level, by the camera file [e-]."""
        return self.sensor.electrons_at_white()

    def factor_of(self, share: float) -> float:
        """Light factor that brings the most sensitive colour to this share of saturation."""
        return share * self.saturation_e / float(self.electrons.max())
