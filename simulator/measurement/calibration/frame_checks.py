"""Checks of a set of calibration frames: each message names the files it is about and what to do."""

from simulator.errors import PhotositeError
from simulator.measurement.calibration.frame_sorting import Frame, IsoFrames
from simulator.measurement.calibration.iso_measurement import IsoMeasurement

FLICKER = 0.02  # relative difference of the means of a pair of flats


def problems(groups: list[IsoFrames]) -> tuple[list[IsoFrames], list[str]]:
    """Return the ISO settings that can be measured, and messages to the user about all ISO settings.

    Raises PhotositeError, with the same messages, when none can be measured.
    """
    good, notes = [], []
    for group in groups:
        missing = _missing(group)
        notes += missing or []
        notes += _flat_notes(group) + _dark_notes(group)
        if not missing:
            good.append(group)
    if not good:
        raise PhotositeError("no ISO can be measured: it takes two dark frames and a pair of flats.\n  " + "\n  ".join(notes))
    return good, notes


def _missing(group: IsoFrames) -> list[str]:
    """Return the reasons why an ISO cannot be measured; an empty list where it can."""
    found, at = [], f"ISO {group.iso}"
    if len(group.short_darks) < 2:
        have = _names(group.short_darks)
        found.append(f"{at} is left out: {have or 'no dark frame'}; give two dark frames or more of one exposure time")
    if not group.usable_pairs:
        have = _names([frame for pair in group.flat_pairs for frame in pair] + group.lone_flats)
        rule = "give two flats of one exposure time whose mean lies below 70 % of white and that clip nowhere"
        found.append(f"{at} is left out: no usable pair of flats ({have or 'none there'}); {rule}")
    elif group.is_clipped_at_zero and len({pair[0].time_s for pair in group.usable_pairs}) < 2:
        rule = "a camera without pedestal needs flats of two or more exposure times"
        found.append(f"{at} is left out: the codes of {group.short_darks[0].path} end at 0; {rule}")
    return found


def _flat_notes(group: IsoFrames) -> list[str]:
    notes, at = [], f"ISO {group.iso}"
    for frame in group.lone_flats:
        notes.append(
            f"{frame.path}: the only flat left at {at}, {frame.time_s:g} s; it takes two alike, so it is not used for K"
        )
    for first, second in group.flat_pairs:
        means = [frame.mean_dn - frame.black_level_dn for frame in (first, second)]
        change = abs(means[0] - means[1]) / max(max(means), 1e-9)
        if change > FLICKER:
            rule = "flickering light, or files of two levels; use steady light and the same settings for both"
            notes.append(f"{first.path}, {second.path}: their means differ by {100 * change:.1f} %: {rule}")
        if first.clips or second.clips:
            share = 100 * max(first.high_share, second.high_share)
            notes.append(f"{first.path}, {second.path}: {share:.3g} % of the codes clip; used for the white level, not for K")
        if first.ends_at_zero or second.ends_at_zero:
            share = 100 * max(first.zero_share, second.zero_share)
            rule = "the noise is cut off there, so they are not used for K; give them more light"
            notes.append(f"{first.path}, {second.path}: {share:.3g} % of the codes are 0: {rule}")
    return notes


def _dark_notes(group: IsoFrames) -> list[str]:
    notes = []
    if group.is_clipped_at_zero:
        rule = "no pedestal, so half of the noise is cut off; read noise is taken from the flats, black from the files"
        notes.append(f"ISO {group.iso}: codes of {_names(group.short_darks)} end at 0: {rule}; DSNU and shape are not told")
    whole = [frame.path for frames in group.unclipped_darks.values() for frame in frames]
    lost = [frame for frames in group.darks.values() for frame in frames if frame.path not in whole]
    if lost and len(group.darks) > 1:
        rule = "not used for the dark current; give frames of other exposure times whose codes end at neither"
        notes.append(f"ISO {group.iso}: codes of {_names(lost)} reach 0 or white: {rule}")
    for frame in _leaking(group):
        rule = "light leak, or no dark frame; cover lens and viewfinder, or name the folder flat"
        notes.append(f"{frame.path}: brighter than the other dark frames of ISO {group.iso}: {rule}")
    return notes


def _leaking(group: IsoFrames) -> list[Frame]:
    """Return dark frames whose mean lies far above the darkest of the same exposure time, which suggests a light leak."""
    found = []
    for frames in group.darks.values():
        lowest = min(frame.mean_dn for frame in frames)
        spread = max(0.002 * (frames[0].white_level_dn - frames[0].black_level_dn), 2.0)
        found += [frame for frame in frames if frame.mean_dn > lowest + spread]
    return found


def findings(measured: list[IsoMeasurement]) -> list[str]:
    """Return messages about measured numbers that look wrong or could not be determined."""
    notes = []
    for one in measured:
        if one.gain_p < 1e-4:
            planes = ", ".join(f"{name} {part.value:.5g}" for name, part in one.gain_by_plane.items())
            rule = "the camera scales them digitally, or a plane is not linear; K is their mean"
            notes.append(f"ISO {one.iso}: the colour planes have different gains ({planes} DN/e-): {rule}")
        if one.frames.is_clipped_at_zero:
            continue
        sigma_dn, black_dn = one.dark.read_noise_dn.value, one.dark.black_level_dn
        if one.dark.shape is None:
            notes.append(f"ISO {one.iso}: read noise {sigma_dn:.2f} DN is too small against a code to have a shape")
        level = one.frames.short_darks[0].black_level_dn
        if abs(black_dn - level) > max(1.0, 0.5 * sigma_dn):
            rule = "the measured one is written; if light leaked into the dark frames, both are wrong"
            notes.append(
                f"ISO {one.iso}: black of the dark frames lies at {black_dn:.2f} DN, the files say {level:g} DN: {rule}"
            )
    return notes


def _names(frames: list[Frame]) -> str:
    return ", ".join(frame.path for frame in frames)
