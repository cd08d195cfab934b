"""Photometry of a shot: luminance, illuminance, exposure, photons and electrons of a grey patch."""

from dataclasses import dataclass, replace

import numpy as np

from simulator.color.spectra import luminance_cd_m2
from simulator.errors import require
from simulator.pipeline.shot import Shot
from simulator.scene.electron_radiance import electron_radiance_weights
from simulator.scene.scene import Scene


@dataclass(frozen=True)
class GreyPatch:
    """A neutral, diffuse surface in the scene's light, sharp, on the optical axis.

    reflectance: of the surface. luminance_cd_m2: its luminance. illuminance_lx: on the sensor. exposure_lx_s: luminous
    exposure H. photons: that fall on a photosite's collecting area within the wavelengths of the camera's response.
    electrons: (channels,) mean photoelectrons per photosite, of red, green, blue or of the one channel.
    """

    reflectance: float
    luminance_cd_m2: float
    illuminance_lx: float
    exposure_lx_s: float
    photons: float
    electrons: np.ndarray


def grey_patch(shot: Shot, scene: Scene, reflectance: float, collected: float = 1.0) -> GreyPatch | None:
    """Predict the exposure of a patch of this reflectance; None when the scene states no luminance of white.

    scene: of the shot, as it was read. collected: share of the light of the nominal time that the shutter lets through, of the
        line with most of it (`LightComponent.most`). A flash is not counted.

    E = L * (irradiance per radiance), H = E t, and with the collecting area A of a photosite
    photons = A t (E / L) integral L_lambda lambda / (h c) dlambda; electrons the same with the quantum efficiency inside.
    Raises PhotositeError for a reflectance outside 0 to 1.
    """
    require(
        0 <= reflectance <= 1, "patch", f"{reflectance:g}", "give a reflectance from 0 to 1; 0.18 is the grey of photographers"
    )
    white_cd_m2 = getattr(shot.scene, "luminance_cd_m2", None)
    if white_cd_m2 is None:
        return None
    response, camera = shot.camera.response, shot.camera
    per_radiance_sr, time_s = shot.lens.irradiance_per_radiance_sr(), collected * shot.exposure.time_s
    illuminance_lx = reflectance * white_cd_m2 * per_radiance_sr
    gathered = reflectance * per_radiance_sr * camera.pixel_pitch_um**2 * camera.fill_factor * time_s
    every_photon = np.ones((len(response.wavelengths_nm), 1))
    return GreyPatch(
        reflectance=reflectance,
        luminance_cd_m2=reflectance * white_cd_m2,
        illuminance_lx=illuminance_lx,
        exposure_lx_s=illuminance_lx * time_s,
        photons=float(_electron_radiance(scene, white_cd_m2, response.wavelengths_nm, every_photon)[0]) * gathered,
        electrons=_electron_radiance(scene, white_cd_m2, response.wavelengths_nm, response.quantum_efficiency) * gathered,
    )


def _electron_radiance(scene: Scene, white_cd_m2: float, wavelengths_nm: np.ndarray, efficiency: np.ndarray) -> np.ndarray:
    """Return the electron radiance of a white surface per channel, (channels,) [e- s^-1 um^-2 sr^-1]."""
    light = scene.illuminant[np.newaxis, :]
    scale = white_cd_m2 / float(luminance_cd_m2(light[0], scene.wavelengths_nm))
    white = replace(scene, spectra_w_m2_sr_nm=light * scale, planes=np.ones((1, 1, 1), np.float32))
    return electron_radiance_weights(white, wavelengths_nm, efficiency)[0]
