"""Warn of settings that are valid but rarely intended."""

from simulator.pipeline.shot import Shot
from simulator.sensor.stages.full_well import FullWell


def shot_warnings(shot: Shot) -> list[str]:
    """Return a sentence for each level that clips where a photographer would not expect it; an empty list for none."""
    camera, setting = shot.camera, shot.camera.iso_setting(shot.exposure.iso)
    assert setting.black_level_dn is not None and setting.white_level_dn is not None  # iso_setting fills them in
    adc_range_e = (setting.white_level_dn - setting.black_level_dn) / setting.gain_dn_per_e
    warnings = []
    full_well = camera.stages.get("full_well")
    if isinstance(full_well, FullWell) and full_well.capacity_e > adc_range_e * 1.001:
        warnings.append(
            f"camera.stages.full_well.capacity = {full_well.capacity_e:.0f} e-: at ISO {shot.exposure.iso} the ADC is full at "
            f"{adc_range_e:.0f} e-, so highlights clip there"
        )
    if setting.black_level_dn < 4.0 * setting.read_noise_dn:
        warnings.append(
            f"camera.black_level = {setting.black_level_dn:g} DN: less than 4 sigma of the read noise "
            f"({setting.read_noise_dn:g} DN at ISO {shot.exposure.iso}), so the dark is clipped at code 0"
        )
    return warnings
