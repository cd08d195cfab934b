"""Signal of a grey patch from luminance to code, with formulas, and the sources of its noise by ISO."""

from collections.abc import Callable

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from simulator.command_line.shot_numbers import Fact
from simulator.pipeline.explain.grey_patch import GreyPatch
from simulator.pipeline.explain.noise_budget import NoiseBudget, noise_budget
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import Camera
from simulator.sensor.sensor_plan import SensorPlan

MOST_ISOS = 12
MOST_COLUMNS = 10_000  # wider than any terminal
# Names of noise sources in the tables; other stages are named by their stem.
NAMES = {
    "photon_shot_noise": "photon shot",
    "dark_current": "dark shot",
    "read_noise_before_gain": "read, before gain",
    "read_noise_after_gain": "read, after gain",
    "random_telegraph_noise": "telegraph",
    "row_noise": "rows",
    "adc": "rounding",
    "prnu": "PRNU",
    "dsnu": "DSNU",
}


def patch_facts(shot: Shot, sensor: SensorPlan, patch: GreyPatch) -> list[Fact]:
    """Return the quantities from the patch's luminance to its code and signal-to-noise ratio."""
    camera = shot.camera
    solid_angle_sr = shot.lens.irradiance_per_radiance_sr()
    area = f"{camera.pixel_pitch_um:g}^2 um^2" + (f" * {camera.fill_factor:g}" if camera.fill_factor < 1 else "")
    # That for which the line with most light collects it, with steady light and a global shutter the exposure time.
    open_s = patch.exposure_lx_s / patch.illuminance_lx if patch.illuminance_lx > 0 else shot.exposure.time_s
    facts = [
        Fact("luminance", f"{patch.luminance_cd_m2:.5g} cd/m^2", f"L = {patch.reflectance:g} * white's luminance"),
        Fact("illuminance on the sensor", f"{patch.illuminance_lx:.4g} lx", f"E = L * {solid_angle_sr:.4g} sr"),
        Fact("luminous exposure", f"{patch.exposure_lx_s:.4g} lx s", f"H = E t, t = {open_s:.5g} s"),
        Fact("photons on a photosite", f"{patch.photons:.1f}", f"t * {area} * integral E_lambda lambda / (h c)"),
    ]
    for color, mean_e in zip(channel_names(sensor.camera), map(float, patch.electrons), strict=True):
        budget = noise_budget(sensor, mean_e, shot.exposure.iso, shot.exposure.time_s)
        efficiency = mean_e / patch.photons if patch.photons > 0 else 0.0
        formula = f"photons * {efficiency:.4f}, the quantum efficiency for this light"
        facts.append(Fact(f"electrons, {color}", f"{mean_e:.1f} e-", formula))
        if budget.is_clipped:
            facts.append(Fact(f"code, {color}", f"{sensor.white_level_dn()} DN", "clipped"))
            continue
        formula = f"{budget.gain_dn_per_e:.5g} DN/e- * electrons + {sensor.moments(0.0).mean:g} DN at ISO {shot.exposure.iso}"
        facts.append(Fact(f"code, {color}", f"{budget.signal_dn + sensor.moments(0.0).mean:.1f} DN", formula))
        formula = f"sigma = {budget.sigma_dn:.4g} DN = {budget.sigma_e:.4g} e-"
        facts.append(Fact(f"signal to noise, {color}", f"{budget.snr:.2f}", formula))
    return facts


COLOR_NAMES = {"R": "red", "G": "green", "B": "blue", "C": "clear", "W": "white"}


def channel_names(camera: Camera) -> tuple[str, ...]:
    """Colours of the camera's channels."""
    return ("mono",) if camera.channels == 1 else tuple(COLOR_NAMES[letter] for letter in camera.filter.letters)


def shown_isos(shot: Shot) -> list[int]:
    """Return the camera's ISOs; of many, the whole stops from the lowest one and the shot's own."""
    isos = list(shot.camera.isos)
    if len(isos) <= MOST_ISOS:
        return sorted({*isos, shot.exposure.iso})

    def nearest_iso(wanted: float) -> int:
        return min(isos, key=lambda iso: abs(iso - wanted))

    stops = {nearest_iso(100 * 2.0**stop) for stop in range(-2, 16)}
    return sorted({*stops, shot.exposure.iso})


Column = tuple[str, list[str]]  # head, and a cell for each ISO


def budget_tables(title: str, budgets: list[NoiseBudget], out: Console) -> list[Table]:
    """Return shares of the temporal variance in percent by ISO and what they amount to, in as many tables as the console needs.

    Heads are folded before a table is divided; each part has the ISO, and no number is cut.
    """
    iso, exposure, shares, totals = _budget_columns(budgets)
    whole = _make_table(title, [iso, *exposure, *shares, *totals])
    if _least_width(whole, out) <= out.width:
        return [whole]
    parts: list[list[Column]] = [[]]
    for share in shares:
        if parts[-1] and _least_width(_make_table(title, [iso, *parts[-1], share]), out) > out.width:
            parts.append([])
        parts[-1].append(share)
    found = [_make_table(title if place == 0 else "and", [iso, *part]) for place, part in enumerate(parts) if part]
    return [*found, _make_table("Total noise of the patch", [iso, *exposure, *totals])]


def _least_width(table: Table, out: Console) -> int:
    """Columns of the screen that a table takes with its heads folded."""
    return out.measure(table, options=out.options.update(max_width=MOST_COLUMNS)).minimum


def _budget_columns(budgets: list[NoiseBudget]) -> tuple[Column, list[Column], list[Column], list[Column]]:
    """Return the ISO, the exposure, the shares of the sources in the temporal variance, and the totals."""
    sources = list(dict.fromkeys(name for budget in budgets for name in budget.shares))
    names = NAMES if "read_noise_before_gain" in sources else NAMES | {"read_noise_after_gain": "read"}  # measured as one

    def column(head: str, text: Callable[[NoiseBudget], str], if_clipped: str | None = None) -> Column:
        return head, [text(one) if if_clipped is None or not one.is_clipped else if_clipped for one in budgets]

    def share(source: str) -> Column:
        head = f"{names.get(source, source.replace('_', ' '))} %"
        return column(head, lambda one: f"{100 * one.shares.get(source, 0.0):.2f}", "clipped")

    exposure = [
        column("time [s]", lambda one: f"{one.time_s:.4g}"),
        column("signal [e-]", lambda one: f"{one.mean_electrons:.1f}"),
    ]
    totals = [
        column("sigma [DN]", lambda one: f"{one.sigma_dn:.4g}", "-"),
        column("sigma [e-]", lambda one: f"{one.sigma_e:.4g}", "-"),
        column("SNR", lambda one: f"{one.snr:.2f}", "-"),
        column("range [stops]", lambda one: f"{one.dynamic_range_stops:.2f}"),
        column("fixed [DN]", lambda one: f"{one.fixed_sigma_dn:.4g}", "-"),
    ]
    return column("ISO", lambda one: f"{one.iso}"), exposure, [share(source) for source in sources], totals


def _make_table(title: str, columns: list[Column]) -> Table:
    table = Table(title=escape(title))
    for head, _ in columns:
        table.add_column(escape(head), justify="right")
    for row in zip(*(cells for _, cells in columns), strict=True):
        table.add_row(*row)
    return table
