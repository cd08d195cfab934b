"""Camera numbers that raw files do not contain: pixel pitch, spectral response, full well above the ADC's range."""

from typing import Any

from simulator.config import camera_data, length_um, response_name
from simulator.measurement.calibration.camera_yaml import Assumed
from simulator.measurement.calibration.frame_sorting import Frame

FULL_FRAME_MM = 36.0
STAND_IN = "sony_a7s2"  # camera whose response stands in for a Bayer sensor when none is given
_GREY = {  # a monochrome sensor: half of the photons from 400 to 700 nm
    "wavelengths": {"start": "400 nm", "step": "100 nm"},
    "peak_quantum_efficiency": 0.5,
    "relative": [[1], [1], [1], [1]],
}


def assumed_numbers(
    name: str, frame: Frame, base: str | None = None, pixel_pitch: str | None = None, response: str | None = None
) -> Assumed:
    """Collect the numbers from options and a base camera, options first.

    name: "Maker Model". frame: any frame of the camera. base, response: names or paths. pixel_pitch: length with its unit.
    Raises PhotositeError for an unknown name and for a quantity that is not a length.
    """
    make, _, model = name.partition(" ")
    known: dict[str, Any] = camera_data(base, "--base") if base else {}
    curves: dict[str, Any]
    if response:
        curves, of_curves = {"file": response_name(response, "--response")}, f"--response {response}"
    elif "response" in known:
        curves, of_curves = known["response"], f"--base {base}"
    elif frame.cfa == "MONO":
        curves, of_curves = _GREY, "quantum efficiency 0.5 from 400 to 700 nm; give --response or --base"
    else:
        curves, of_curves = {"file": STAND_IN}, f"that of {STAND_IN} as a stand-in; give --response or --base"
    if pixel_pitch:
        pitch, of_pitch = f"{length_um(pixel_pitch, '--pixel-pitch'):g} um", f"--pixel-pitch {pixel_pitch}"
    elif "pixel_pitch" in known:
        pitch, of_pitch = known["pixel_pitch"], f"--base {base}"
    else:
        pitch = f"{1e3 * FULL_FRAME_MM / frame.size[1]:.4g} um"
        of_pitch = f"a sensor {FULL_FRAME_MM:g} mm wide; give --pixel-pitch or --base"
    well = known.get("stages", {}).get("full_well", {}).get("capacity")
    sources = {"response": of_curves, "pixel_pitch": of_pitch, "full_well": f"--base {base}"}
    return Assumed(make, model or make, pitch, curves, well, sources)
