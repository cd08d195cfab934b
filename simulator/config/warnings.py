"""Warn of settings that are valid but rarely intended, and of frames that show nothing."""

import math

import numpy as np

from simulator.pipeline.shot import Shot
from simulator.raw.disk_arrays import in_blocks
from simulator.raw.raw_image import Raw
from simulator.sensor.stages.full_well import FullWell

WIDE_AIRY_DISK_PX = 4.0  # photosites across the Airy disk from which a lens without diffraction is far too sharp
MOST_PHOTOSITES = 2**20  # of a frame that are looked at, about
CLIPPED_SHARE = 0.99  # of the photosites, from which a frame counts as wholly clipped


def shot_warnings(shot: Shot) -> list[str]:
    """Return a sentence for each setting that has an effect which a photographer would not expect; an empty list for none.

    A level clips below the ADC's range or in the dark, or diffraction is off though the lens spreads light over more than
    WIDE_AIRY_DISK_PX photosites.
    """
    camera, setting = shot.camera, shot.camera.iso_setting(shot.exposure.iso)
    assert setting.black_level_dn is not None and setting.white_level_dn is not None  # iso_setting fills them in
    warnings = []
    full_well = camera.stages.get("full_well")
    if isinstance(full_well, FullWell):
        warnings += _wells_beyond_the_adc(shot, full_well)
    if setting.black_level_dn < 4.0 * setting.read_noise_dn:
        warnings.append(
            f"camera.black_level = {setting.black_level_dn:g} DN: less than 4 sigma of the read noise "
            f"({setting.read_noise_dn:g} DN at ISO {shot.exposure.iso}), so the dark is clipped at code 0"
        )
    lens = shot.lens
    airy_px = lens.airy_diameter_um() / camera.pixel_pitch_um if lens.forms_image and lens.psf is None else 0.0
    if airy_px > WIDE_AIRY_DISK_PX and not lens.has_diffraction:
        key, value, _ = lens.smaller_aperture(1.0)
        switch = "lens.pinhole.diffraction" if key.startswith("lens.pinhole") else "lens.diffraction"
        warnings.append(
            f"{key} = {value}: its Airy disk is {airy_px:.0f} photosites wide, but {switch} = false, so the picture is sharper "
            f"than light allows; write {switch}: true"
        )
    return warnings


def _wells_beyond_the_adc(shot: Shot, full_well: FullWell) -> list[str]:
    """Return a sentence for each photodiode whose well holds more than the ADC reads at the least gain of its readings."""
    camera, readout, warnings = shot.camera, shot.camera.hdr_readout, []
    gains, wells = ((1.0,), (1.0,)) if readout is None else (readout.gains, readout.full_wells)
    diodes = (0,) if readout is None else readout.diode_of
    for diode in sorted(set(diodes)):
        least, place = min((gains[place], place) for place, own in enumerate(diodes) if own == diode)
        widest = camera.iso_setting(least * shot.exposure.iso)
        black_dn, white_dn = widest.levels_dn
        adc_range_e, capacity_e = (white_dn - black_dn) / widest.gain_dn_per_e, wells[place] * full_well.capacity_e
        if capacity_e > adc_range_e * 1.001:
            which = f" of photodiode {diode + 1}" if len(set(diodes)) > 1 else ""
            warnings.append(
                f"camera.stages.full_well.capacity = {capacity_e:.0f} e-{which}: at ISO {least * shot.exposure.iso:g} the ADC "
                f"is full at {adc_range_e:.0f} e-, so highlights clip there"
            )
    return warnings


def frame_warnings(raw: Raw) -> list[str]:
    """Return a sentence for a frame that shows nothing, wholly clipped or black, with the exposure time that would mend it.

    A large frame is judged by photosites evenly spread over it, in all colours.
    """
    step = 2 * math.isqrt(raw.dn.size // MOST_PHOTOSITES) + 1  # odd: even steps would meet one colour alone
    clean, electrons = (_every(step, plane[raw.active]) for plane in (raw.noise_free_dn, raw.mean_electrons))
    share = float(np.mean(clean >= raw.white_level_dn - 0.5))
    span_dn = raw.white_level_dn - raw.black_level_dn
    peak_dn = raw.gain_dn_per_e * float(electrons.max())  # dark current is no signal
    value, full_e = (
        f"exposure.time = {raw.exposure_time_s:g} s",
        span_dn / raw.gain_dn_per_e if raw.gain_dn_per_e > 0 else math.inf,
    )
    light_e = float(np.percentile(electrons, 99.0))
    fix = "change exposure.time, the aperture or scene.luminance"
    if 0 < full_e < math.inf and light_e > 0:
        fix = f"with {raw.exposure_time_s * full_e / light_e:.2g} s the brightest hundredth would reach white; {fix}"
    if share >= CLIPPED_SHARE:
        return [f"{value}: {100 * share:.3g} % of the photosites clip, the frame shows nothing; {fix}"]
    if peak_dn < raw.dark_noise_dn:
        signal = f"no photosite's signal ({peak_dn:.2g} DN at most)"
        return [f"{value}: {signal} reaches the noise in the dark ({raw.dark_noise_dn:.2g} DN), the frame is black; {fix}"]
    return []


def _every(step: int, plane: np.ndarray) -> np.ndarray:
    """Return every step-th photosite of a plane in both directions."""
    return np.concatenate([block[::step, ::step].copy() for block in in_blocks(plane, step)])
