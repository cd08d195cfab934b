"""Writes docs/cameras.md and its charts from configs/cameras: what each camera holds, and where every number comes from.

python docs/make_cameras.py
"""

import math
import re
from itertools import takewhile
from pathlib import Path

from camera_colors import matrix_errors

from simulator.color.color_tables import CONFIGS
from simulator.config import load_camera, read_camera_document
from simulator.config.camera_file import list_sources
from simulator.sensor.camera.camera import Camera
from simulator.sensor.camera.camera_sections import IsoSetting

DOCS = Path(__file__).resolve().parent
PAGE, CHARTS = DOCS / "cameras.md", DOCS / "images" / "cameras"
INTRODUCTION = """\
# Cameras

Bodies whose noise and colours were measured, to be used by name, as in `camera: sony_a7s2`. Each section has a camera's
numbers with their sources. To see two of them side by side:

```
photosite compare sony_a7s2 nikon_d850 --out two.svg
```

Made by `make docs` from `configs/cameras/` and `configs/responses/`; edit those. The name behind the colon of a heading is
what `camera:` takes in a shot file.

- K is the system gain of EMVA 1288 [DN/e⁻]. The read noise is the total temporal noise of one photosite in the dark, row
  noise apart.
- Full scale is (white level − black level) / K, or the full well where that is less. Dynamic range is log₂ of full scale
  over read noise; without read noise, over the rounding error of 1/√12 DN.
- Between the ISO settings of a table gain, read noise and row noise are straight in log-log, Tukey λ is straight in ln ISO,
  and black and white level are those of the nearest setting. Nothing is interpolated across a switch of the conversion
  gain, and an ISO outside the settings is refused unless `camera.iso_range: extrapolate` is set.
- A Tukey λ of 0.14 is close to a normal distribution; smaller ones have longer tails.
- The DNG carries the colour matrix that is fitted to the response; `camera.color_matrix.in_dng: true` makes it carry the
  published one. Otherwise the published one is a check of the response: both are rated by the mean ΔE 2000 of the
  24 ColorChecker patches under D65.
- `camera: {base: sony_a7s2, typical: true}`, or `--set camera.typical=true`, adds dark current, PRNU, DSNU and hot pixels, the
  *typical stages* of each camera. No such figures of these bodies were found: they are those of a class of sensors, or chosen,
  as each source says, and off unless asked for. Dark current and warm pixels are those of a recent back-illuminated sensor, by
  the area of the photosite; sensors that are older or lit from the front may have several times more. The rates hold at −10 °C
  and are taken to the sensor's `temperature`; at 25 °C, the default, they are 26 times as high. `typical_stages: {prnu: null}`
  takes one away; `stages` of the same name replace it.
- *Measured*: taken from a measurement of this camera. *Derived*: arithmetic on such numbers. *Proxy*: numbers of a sibling.
  *Assumed*: chosen.
"""


def names() -> list[str]:
    """Cameras of the library."""
    return sorted(path.stem for path in (CONFIGS / "cameras").glob("*.yaml"))


def page() -> str:
    """Text of docs/cameras.md."""
    cameras = {name: load_camera(name) for name in names()}
    rows = ["| camera | sensor | photosites | pitch | bits | ISO | full scale | read noise | dynamic range |", "|" + "---|" * 9]
    rows += [_overview(name, camera) for name, camera in cameras.items()]
    sections = [_section(name, camera) for name, camera in cameras.items()]
    return "\n".join([INTRODUCTION, *rows, "", *sections])


def full_scale_e(camera: Camera, setting: IsoSetting) -> float:
    """Electrons at which a photosite saturates at this ISO [e-]."""
    adc_e = (setting.white_level_dn - setting.black_level_dn) / setting.gain_dn_per_e
    well = camera.stages.get("full_well")
    return adc_e if well is None else min(adc_e, well.capacity_e)


def dynamic_range_stops(camera: Camera, setting: IsoSetting) -> float:
    """log2 of full scale over read noise; over the rounding error of the ADC, 1/sqrt(12) DN, where there is no read noise."""
    floor_dn = setting.read_noise_dn or math.sqrt(1 / 12)
    return math.log2(full_scale_e(camera, setting) * setting.gain_dn_per_e / floor_dn)


def _overview(name: str, camera: Camera) -> str:
    settings = [camera.iso_setting(iso) for iso in camera.isos]
    noises = [setting.read_noise_dn / setting.gain_dn_per_e for setting in settings]
    width, height = camera.sensor_mm
    cells = [
        f"[{camera.make} {camera.model}](#{name})",
        f"{width:.1f} × {height:.1f} mm",
        f"{camera.width_px * camera.height_px / 1e6:.1f} M",
        f"{camera.pixel_pitch_um:g} µm",
        f"{camera.bit_depth}",
        f"{camera.isos[0]}–{camera.isos[-1]}",
        f"{full_scale_e(camera, settings[0]):.0f} e⁻",
        f"{max(noises):.2f}–{min(noises):.2f} e⁻",
        f"{dynamic_range_stops(camera, settings[0]):.1f} stops",
    ]
    return f"| {' | '.join(cells)} |"


def _section(name: str, camera: Camera) -> str:
    document = read_camera_document(name).data["camera"]
    lines = (CONFIGS / "cameras" / f"{name}.yaml").read_text(encoding="utf-8").splitlines()
    remark = " ".join(line.removeprefix("# ") for line in takewhile(lambda line: line.startswith("#"), lines))
    parts = [
        f'<a id="{name}"></a>\n',
        f"## {camera.make} {camera.model}: `{name}`\n",
        f"{remark}\n",
        f"![noise and dynamic range against ISO, quantum efficiency](images/cameras/{name}.png)\n",
        _facts(camera, load_camera(name, ["camera.typical=true"]) if "typical_stages" in document else None),
        _iso_lines(camera),
        "Sources:\n",
        *(f"- {what}: {text}" for what, text in sources(document)),
        "",
    ]
    return "\n".join(parts)


def _facts(camera: Camera, typical: Camera | None) -> str:
    peaks = [f"{value:.3f}" for value in camera.response.quantum_efficiency.max(axis=0)]
    facts = {
        "photosites": f"{camera.width_px} × {camera.height_px}, {camera.cfa}, {camera.pixel_pitch_um:g} µm",
        "ADC": f"{camera.bit_depth} bit",
        "peak quantum efficiency": ", ".join(peaks) + (" (red, green, blue)" if len(peaks) == 3 else ""),
    }
    if camera.readout_time_s is not None:
        facts["read-out"] = f"{1e3 * camera.readout_time_s:g} ms"
    if camera.conversion_gain is not None:
        ratio = "" if camera.conversion_gain.ratio is None else f", ratio {camera.conversion_gain.ratio:g}"
        facts["high conversion gain"] = f"from ISO {camera.conversion_gain.iso}{ratio}"
    if camera.read_noise_model is not None:
        model = camera.read_noise_model
        facts["read noise"] = f"{model.before_gain_e:g} e⁻ before the gain, {model.after_gain_dn:g} DN after it"
    elif camera.read_noise_after_gain_dn:
        facts["read noise after the gain"] = f"{camera.read_noise_after_gain_dn:g} DN, part of the total below"
    if "full_well" in camera.stages:
        facts["full well"] = f"{camera.stages['full_well'].capacity_e:.0f} e⁻"
    if typical is not None:
        facts["typical, off unless asked for"] = _typical(typical)
    if camera.color_matrix is not None:
        rows = "; ".join(" ".join(f"{value:.4f}" for value in row) for row in camera.color_matrix.xyz_to_camera)
        fitted, published = matrix_errors(camera)
        facts["published colour matrix"] = f"{rows} (XYZ to camera, D65)"
        facts["ColorChecker, mean ΔE 2000"] = f"{fitted:.1f} with the fitted matrix, {published:.1f} with the published one"
    return "\n".join(["| | |", "|---|---|", *(f"| {key} | {value} |" for key, value in facts.items()), ""])


def _typical(camera: Camera) -> str:
    """Typical stages of a camera that has them switched on."""
    dark, hot, prnu, dsnu = (camera.stages[stem] for stem in ("dark_current", "hot_pixels", "prnu", "dsnu"))
    celsius = round(dark.measured_at_k - 273.15)
    at = f"{celsius} °C".replace("-", "−")
    return (
        f"dark current {dark.rate_e_per_s:g} e⁻/s at {at}, PRNU {100 * prnu.sigma:g} %, DSNU {dsnu.sigma_e:g} e⁻, "
        f"hot pixels {100 * hot.share:g} % of {hot.rate_e_per_s:g} e⁻/s at {at}"
    )


def _iso_lines(camera: Camera) -> str:
    settings = {iso: camera.iso_setting(iso) for iso in camera.isos}
    shaped = any(setting.tukey_lambda is not None for setting in settings.values())
    rowed = any(setting.row_noise_dn for setting in settings.values())
    heads = ["ISO", "K [DN/e⁻]", "read noise [DN]", "[e⁻]"] + ["Tukey λ"] * shaped + ["row noise [DN]"] * rowed
    heads += ["black [DN]", "white [DN]", "full scale [e⁻]", "dynamic range [stops]"]
    rows = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for iso, setting in settings.items():
        cells = [f"{iso}", f"{setting.gain_dn_per_e:.5g}", f"{setting.read_noise_dn:.4g}"]
        cells.append(f"{setting.read_noise_dn / setting.gain_dn_per_e:.3g}")
        cells += [f"{setting.tukey_lambda:.3f}"] if shaped else []
        cells += [f"{setting.row_noise_dn:.3g}"] if rowed else []
        cells += [f"{setting.black_level_dn:g}", f"{setting.white_level_dn:g}"]
        cells += [f"{full_scale_e(camera, setting):.0f}", f"{dynamic_range_stops(camera, setting):.2f}"]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join([*rows, ""])


def sources(section: dict) -> list[tuple[str, str]]:
    """(keys, text) of every `source:` in a section and the sections in it, in Markdown."""
    return [
        (", ".join(f"`{key}`" for key in keys.split(", ") if key) or "all", _linked(text))
        for keys, text in list_sources(section)
    ]


def _linked(text: str) -> str:
    """Bare addresses and owner/name@commit as links."""
    text = re.sub(r"(?<![\w/(])([\w-]+/[\w-]+)@([0-9a-f]{7,12})\b", r"[\1@\2](https://github.com/\1/tree/\2)", text)
    return re.sub(r"(?<!\()https?://[^\s)]*[^\s).,:;]", r"<\g<0>>", text)


def main() -> None:
    """Write the page and the charts."""
    from camera_charts import write_chart

    from simulator.atomic_files import atomic_write

    CHARTS.mkdir(parents=True, exist_ok=True)
    with atomic_write(PAGE) as temporary:
        Path(temporary).write_text(page(), encoding="utf-8")
    for name in names():
        write_chart(load_camera(name), CHARTS / f"{name}.png")


if __name__ == "__main__":
    main()
