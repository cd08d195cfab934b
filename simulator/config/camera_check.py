"""What a camera must be beyond the types of its keys."""

from simulator.errors import require
from simulator.sensor import STAGES
from simulator.sensor.camera import Camera


def check_camera(camera: Camera) -> None:
    """Check what the types of its keys leave open. Raises PhotositeError that begins with the key."""
    for key, value in (("width", camera.width_px), ("height", camera.height_px)):
        require(1 <= value <= 65535, f"camera.{key}", value, "give 1 to 65535 pixels")
    require(camera.pixel_pitch_um > 0, "camera.pixel_pitch", f"{camera.pixel_pitch_um:g} um", "give a pitch above 0 um")
    require(0 < camera.fill_factor <= 1, "camera.fill_factor", camera.fill_factor, "give a share above 0 and up to 1")
    channels = camera.response.quantum_efficiency.shape[1]
    rule = f"needs {1 if camera.cfa == 'MONO' else 3} values per line of response.relative, which has {channels}"
    require((channels == 1) == (camera.cfa == "MONO"), "camera.cfa", camera.cfa, rule)
    require(
        bool(camera.iso_table),
        "camera.iso_table",
        "{}",
        "give at least one line such as `100: {gain: 0.1 DN/e-, read_noise: 1 DN}`",
    )
    for iso, setting in camera.iso_table.items():
        require(iso > 0, "camera.iso_table", iso, "an ISO is above 0")
        require(
            setting.gain_dn_per_e > 0,
            f"camera.iso_table.{iso}.gain",
            f"{setting.gain_dn_per_e:g} DN/e-",
            "give a gain above 0 DN/e-",
        )
        rule = f"is below read_noise_after_gain = {camera.read_noise_after_gain_dn:g} DN, which is a part of it"
        enough = setting.read_noise_dn >= camera.read_noise_after_gain_dn
        require(enough, f"camera.iso_table.{iso}.read_noise", f"{setting.read_noise_dn:g} DN", rule)
    require(
        camera.read_noise_after_gain_dn >= 0, "camera.read_noise_after_gain", camera.read_noise_after_gain_dn, "is not negative"
    )
    STAGES["adc"](bit_depth=camera.bit_depth, black_level_dn=camera.black_level_dn)
    _check_window(camera)


def _check_window(camera: Camera) -> None:
    if (window := camera.window) is None:
        return
    fits = 0 <= window.x and 0 <= window.y and window.width >= 1 and window.height >= 1
    fits = fits and window.x + window.width <= camera.width_px and window.y + window.height <= camera.height_px
    value = f"{window.width} x {window.height} at ({window.x}, {window.y})"
    require(fits, "camera.window", value, f"must lie within the sensor's {camera.width_px} x {camera.height_px} photosites")
