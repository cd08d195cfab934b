"""EMVA 1288 data sheet that a camera file states: the numbers of its stages, without a frame."""

import math

import numpy as np

from simulator.errors import require
from simulator.measurement.curves.code_response import sensor_alone
from simulator.measurement.emva1288.xml_sheet import DataSheet, derived_values
from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import SensorPlan
from simulator.units import Nanometres

SHORT_S = 1e-9  # exposure time without dark current worth mentioning
HALF = 0.5  # of saturation, at which the PRNU is stated
COLOR_NAMES = {"R": "red", "G": "green", "B": "blue", "MONO": "mono"}


def stated_sheet(camera: Camera, iso: int, wavelength_nm: Nanometres | None = None) -> DataSheet:
    """Return the EMVA 1288 data sheet of a camera at an ISO.

    wavelength_nm: of the light; None: that to which the camera responds most. QE, which contains the fill factor, is that of
    the colour that responds most to it; all curves are in the sheet. Temporal dark noise holds row noise. Saturation is that
    of the full well or of the ADC, whichever is lower; PRNU is that at half of it. DSNU, PRNU and dark current are left out
    where the camera has none.
    Raises PhotositeError for an ISO that the camera does not have, for a wavelength beyond its curves, and for a camera that
    combines readings or photosites.
    """
    for key, value in (("hdr_readout", camera.hdr_readout), ("binning", camera.binning)):
        rule = f"a data sheet is of single photosites and readings; leave {key} out, or set it to null"
        require(value is None, f"camera.{key}", "given", rule)
    sensor = sensor_alone(camera, iso, SHORT_S)
    gain, dark = sensor.gain_dn_per_e(), sensor.moments(0.0)
    saturation_e = min(sensor.capacity_e, (sensor.white_level_dn() - sensor.black_level_dn) / gain)
    curves_nm, efficiency = camera.response.wavelengths_nm, camera.fill_factor * camera.response.quantum_efficiency
    nm = float(curves_nm[np.argmax(efficiency.max(axis=1))]) if wavelength_nm is None else wavelength_nm
    reach = f"give {curves_nm[0]:g} to {curves_nm[-1]:g} nm, which the camera's response covers"
    require(curves_nm[0] <= nm <= curves_nm[-1], "--wavelength", f"{nm:g} nm", reach)
    stated = {
        "DSNU1288": math.sqrt(dark.fixed_variance) / gain,
        "PRNU1288": 100.0 * _prnu(sensor, HALF * saturation_e),
        "u_I_mean": (sensor_alone(camera, iso, 1.0 + SHORT_S).moments(0.0).mean - dark.mean) / gain,
    }
    values = {
        "width": float(camera.width_px),
        "height": float(camera.height_px),
        "pixel_size": camera.pixel_pitch_um,
        "bit_depth": float(camera.bit_depth),
        "wavelength": nm,
        "u_y_dark": dark.mean,
        "K": gain,
        "QE": 100.0 * max(float(np.interp(nm, curves_nm, curve)) for curve in efficiency.T),
        "sigma_y_dark": math.sqrt(dark.variance),
        "sigma_d": math.sqrt(max(dark.variance - 1.0 / 12.0, 0.0)) / gain,
        "u_e_sat": saturation_e,
        **{name: value for name, value in stated.items() if value > 0},
    }
    names = [COLOR_NAMES.get(letter, letter.lower()) for letter in camera.filter.letters] if camera.channels > 1 else ["mono"]
    curves = {name: 100.0 * curve for name, curve in zip(names, efficiency.T, strict=True)}
    texts = {"vendor": camera.make, "model": camera.model, "cfa": camera.cfa, "iso": str(iso)}
    return DataSheet(texts, derived_values(values), {"wavelength": curves_nm, **curves})


def _prnu(sensor: SensorPlan, electrons: float) -> float:
    """Return the PRNU at a mean of photoelectrons, relative."""
    dark, light = sensor.moments(0.0), sensor.moments(electrons)
    return math.sqrt(max(light.fixed_variance - dark.fixed_variance, 0.0)) / (light.mean - dark.mean)
