"""A body whose photosites each stand for several of another body's: quick pictures with the statistics of the large frame."""

from dataclasses import replace

from simulator.errors import require
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import IsoSetting, Window
from simulator.sensor.camera.read_noise_model import ReadNoiseModel

BIT_DEPTH = 16  # of the codes, so that rounding adds as little to a mean as it does to the mean of many codes


def combine_photosites(camera: Camera, side: int) -> Camera:
    """Return the body of which each photosite stands for side x side photosites of `camera`; of side 1, `camera` itself.

    Electrons are those of the sum of side x side photosites of one colour, and a code is the mean of their codes, in 16 bits:
    2^(16 - bit depth) times as large. For even light, mean and variance of each code are those of the mean of the codes of
    side x side photosites (independent noises add, EMVA 1288 R4.0, 2.1; what a row or column shares is averaged over `side` of
    them). Near clipping they differ, since the mean of clipped codes is not the clipped mean. Tukey-lambda noise, and noise
    that differs between photosites, become normal. Crosstalk, whose reach is a few photosites, is left out. Of a sensor with
    optical black what light reaches is read out. The sensor loses the rows and columns that fill no photosite.
    Raises PhotositeError for a side below 1, of which the sensor or its window has less than two, and
    for a window of covered photosites alone.
    """
    require(side >= 1, "side", side, "give 1 photosite or more")
    if side == 1:
        return camera
    width_px, height_px = camera.width_px // side, camera.height_px // side
    rule = f"leaves {width_px} x {height_px} of the sensor's photosites; give a smaller one"
    require(min(width_px, height_px) >= 2, "side", side, rule)
    codes = 2.0 ** (BIT_DEPTH - camera.bit_depth)
    stages = {stem: stage.combined(side, codes) for stem, stage in camera.stages.items()}
    model = camera.read_noise_model
    return replace(
        camera,
        width_px=width_px,
        height_px=height_px,
        pixel_pitch_um=side * camera.pixel_pitch_um,
        bit_depth=BIT_DEPTH,
        black_level_dn=codes * camera.black_level_dn,
        white_level_dn=codes * (2**camera.bit_depth - 1 if camera.white_level_dn is None else camera.white_level_dn),
        iso_table={iso: _combine_setting(setting, side, codes) for iso, setting in camera.iso_table.items()},
        read_noise_after_gain_dn=codes * camera.read_noise_after_gain_dn / side,
        read_noise_spread=0.0,
        read_noise_model=None if model is None else _combine_model(model, side, codes),
        stages={stem: stage for stem, stage in stages.items() if stage is not None},
        window=_combine_window(_lit_part(camera), side) if camera.window or camera.optical_black else None,
        crosstalk=None,
        optical_black=None,
    )


def _combine_setting(setting: IsoSetting, side: int, codes: float) -> IsoSetting:
    """Return a line of the ISO table for the mean of side x side codes."""
    black_dn, white_dn, bias_dn = setting.black_level_dn, setting.white_level_dn, setting.color_bias_dn
    return IsoSetting(
        codes * setting.gain_dn_per_e / side**2,
        codes * setting.read_noise_dn / side,
        row_noise_dn=codes * setting.row_noise_dn / side**0.5,
        color_bias_dn=None if bias_dn is None else tuple(codes * bias for bias in bias_dn),  # type: ignore[arg-type]  # 4 of 4
        black_level_dn=None if black_dn is None else codes * black_dn,
        white_level_dn=None if white_dn is None else codes * white_dn,
    )


def _combine_model(model: ReadNoiseModel, side: int, codes: float) -> ReadNoiseModel:
    """Return the read noise of the sum of side x side photosites before the gain, and of the mean of their codes after it."""
    return replace(
        model,
        gain_at_iso_100_dn_per_e=codes * model.gain_at_iso_100_dn_per_e / side**2,
        before_gain_e=side * model.before_gain_e,
        after_gain_dn=codes * model.after_gain_dn / side,
    )


def _lit_part(camera: Camera) -> Window:
    """Return the part of the frame that light reaches. Raises PhotositeError where none does."""
    frame, active = camera.frame, camera.active
    x, y = max(frame.x, active.x), max(frame.y, active.y)
    width = min(frame.x + frame.width, active.x + active.width) - x
    height = min(frame.y + frame.height, active.y + active.height) - y
    rule = f"no light reaches it; give one that has a part of the active area, {active}"
    require(min(width, height) > 0, "camera.window", frame, rule)
    return Window(x, y, width, height)


def _combine_window(window: Window, side: int) -> Window:
    """Return the photosites that hold a window, from an even row and column on, so that its colours stay."""
    x, y = window.x // (2 * side) * 2, window.y // (2 * side) * 2
    return Window(x, y, max(window.width // side, 2), max(window.height // side, 2))
