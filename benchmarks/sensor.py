"""The fused sensor kernel beside its peers, all in one run.

Contestants take turns, so that a load on the machine meets all of them. Every contestant's frame is checked against the model's
mean and variance. The picture lies in memory (Photosite: on the device) before the clock starts, and the codes lie there when
it stops.
"""

import importlib
from collections.abc import Callable, Iterable

import numpy as np
from measuring.contest import Contestant
from measuring.page import without_absent_stages
from measuring.record import Record, Row
from measuring.run import Run
from measuring.work import CHAIN, ELD, LIGHT, ONE_READ_NOISE, Sensor, ramp
from peers import floor, photosite
from peers.photosite import Missing

from simulator.device import Device, devices, open_device
from simulator.sensor.stages.registry import STAGES

# An example of every optional stage, to measure what it adds to the chain.
EXAMPLES = {
    "prnu": {"sigma": 0.01},
    "dark_current": {"rate_e_per_s": 10.0, "time_s": 1.0},
    "dsnu": {"sigma_e": 2.0},
    "hot_pixels": {"share": 1e-3, "rate_e_per_s": 1000.0, "time_s": 1.0},
    "dead_pixels": {"share": 1e-4},
    "full_well": {"capacity_e": 1.66e5},
    "conversion_gain": {"ratio": 2.0},
    "read_noise_before_gain": {"sigma_e": 4.0},
    "random_telegraph_noise": {"share": 0.01, "amplitude_e": 10.0},
    "column_offset": {"sigma_dn": 0.5},
    "row_noise": {"sigma_dn": 0.5},
    "banding": {"amplitude_dn": 0.5, "period_px": 37.0},
    "read_noise_after_gain": {"sigma_dn": 0.932},
    "color_bias": {"offsets_dn": (-1.9, 0.3, 1.2, 4.1)},
    "nonlinearity": {"errors_dn": (0.0, 1.0, 2.0, 1.0, 0.0)},
    "digital_gain": {"factor": 1.5},
}
ALWAYS = {"photon_shot_noise", "analog_gain", "adc"}
ASKED_EVERY = 120  # with every stage [Mpixel/s]

TEXT = """\
{size} photosites. The bar for the ELD model in NumPy is the faster of two ways to draw Tukey-lambda noise:
`scipy.stats.tukeylambda.rvs`, which most would write, and its quantile function by hand in float32. Light: means from 50 to
50,000 e⁻ (daylight), 1 to 1,000 (dusk), 0.1 to 30 (night), in ramps. The picture is in memory (Photosite: on the device) before
the clock starts, and the codes are there when it stops. Every frame is checked: mean error in σ and variance over that of the
model stand in the JSON.
"""
STAGES_TEXT = """\
CPU time of the kernel with one stage added to Poisson and ADC (= 1), dusk, {size} photosites. A stage that is absent is
compiled out; the last verdicts compare with a page from which its lines are deleted, and with a kernel that draws one Philox
block alone.
"""
CONTESTS = {
    "Poisson and two read noises": (CHAIN, {"numpy_chain": 20.0}),
    "ELD model": (ELD, {"numpy_eld": 25.0, "torch_eld": 8.0}),
    "Poisson and one read noise": (ONE_READ_NOISE, {"getframes_camera": 16.0, "galsim_ccd": 16.0}),
}


def peers_of(modules: Iterable[str], mean_e: np.ndarray, sensor: Sensor, record: Record) -> dict[str, list[Contestant]]:
    """Contestants of peers/<module>.py, by module; a note for each whose package is missing."""
    there = {}
    for module in modules:
        try:
            found = importlib.import_module(f"peers.{module}")
        except ImportError as error:
            record.note(f"peers/{module}.py: {error}")
            continue
        many = getattr(found, "contestants", None)
        there[module] = many(mean_e, sensor) if many else [found.contestant(mean_e, sensor)]
    return there


def with_ratios(rows: list[Row]) -> list[Row]:
    """Rows with their times over those of the first."""
    first = rows[0]
    for row in rows:
        row["ratio"], row["cpu_ratio"] = row["best_s"] / first["best_s"], row["cpu_s"] / first["cpu_s"]
    return rows


def judge_peers(record: Record, what: str, rows: dict[str, list[Row]], asked: dict[str, float]) -> None:
    """Compare the least ratio over the light levels with what is asked of it; rows: of each peer."""
    for name, found in rows.items():
        wall, cpu = sorted(row["ratio"] for row in found), sorted(row["cpu_ratio"] for row in found)
        figure = f"{wall[0]:.1f} to {wall[-1]:.1f} x in time, {cpu[0]:.1f} to {cpu[-1]:.1f} x in CPU time"
        record.judge(f"{what}, against {name}", figure, f"{asked[name]:g} x in time", wall[0] >= asked[name])


def measure_sensor(run: Run) -> Record:
    """Whole frames beside peers, at three levels of light."""
    record = Record("sensor", "The sensor", TEXT, chart="rates")
    megapixels = run.pick(0.2, 4.0, 12.0)
    pictures = {name: ramp(megapixels, *limits) for name, limits in LIGHT.items()}
    height, width = pictures["dusk"].shape
    record.facts["size"] = f"{width} x {height}"
    for title, (sensor, modules) in CONTESTS.items():
        theirs: dict[str, list[Row]] = {}
        others: dict[str, list[Row]] = {}
        asked: dict[str, float] = {}
        for light, picture in pictures.items():
            ours = [photosite.on_device(picture, sensor, info) for info in devices()]
            peers = peers_of(modules, picture, sensor, record)
            asked |= {one.name: modules[module] for module, many in peers.items() for one in many}
            contestants = [*ours, *(one for many in peers.values() for one in many)]
            timings = run.contest(f"{title}, {light}", contestants)
            rows = []
            for one in contestants:
                timing, (mean_error, variance) = timings[one.name].summary(), sensor.check(one.codes(), picture)
                rate = width * height / 1e6 / timing["best_s"]
                more = {"mpixel_per_s": rate, "mean_error": mean_error, "variance": variance, "contest": title, "light": light}
                rows.append(record.add(f"{title}, {light}", one.name, timing, **more))
            for row in with_ratios(rows)[1:]:
                (theirs if row["name"] in asked else others).setdefault(row["name"], []).append(row)
        judge_peers(record, title, theirs, asked)
        for name, rows in others.items():
            worst = max(max(row["cpu_ratio"], 1 / row["cpu_ratio"]) for row in rows)
            what = f"{title}, {name} against the default device"
            record.judge(what, f"factor {worst:.2f} in CPU time", "2", worst <= 2)
    return record


def measure_stages(run: Run) -> Record:
    """Price of each optional stage, of absent ones, and the floor under the kernel."""
    columns = {"name": ["stage", ""], "cpu_ratio": ["CPU time", ".2f"]}
    record = Record("stages", "Price of a stage", STAGES_TEXT, columns=columns)
    picture = ramp(run.pick(0.2, 3.0, 12.0), *LIGHT["dusk"])
    record.facts["size"] = "{1} x {0}".format(*picture.shape)
    info = devices()[0]
    device = open_device(info.label)

    def contest(case: str, contestants: list[Contestant]) -> list[Row]:
        timings = run.contest(case, contestants)
        return with_ratios([record.add(case, one.name, timings[one.name].summary()) for one in contestants])

    have = {}
    for stem in sorted(STAGES.keys() - ALWAYS):
        try:
            have[stem] = photosite.make(stem, **EXAMPLES.get(stem, {}))
        except (Missing, TypeError) as problem:
            record.note(f"price of {stem}: {problem}")
    base = photosite.stages_of(Sensor(full_well_e=1e9, gain_dn_per_e=CHAIN.gain_dn_per_e))
    settings = {"none": [], **{stem: [stage] for stem, stage in have.items()}, "every stage": list(have.values())}
    stages = [photosite.contestant(picture, [*base, *more], device, name) for name, more in settings.items()]
    rate = picture.size / 1e6 / contest("stages", stages)[-1]["best_s"]
    record.judge("every stage at once", f"{rate:.0f} Mpixel/s", f"{ASKED_EVERY} Mpixel/s", rate >= ASKED_EVERY)
    _judge_absent_stages(record, picture, device, contest)
    floors = [
        photosite.on_device(picture, CHAIN, info),
        floor.contestant(picture, device, True, "one Philox block between reading and writing"),
        floor.contestant(picture, device, False, "reading 4 bytes and writing 2"),
    ]
    share = contest("floor under Poisson and two read noises", floors)[1]["cpu_ratio"]
    record.judge("Philox alone, share of the chain's CPU time", f"{100 * share:.0f} %", "to be shown", True)
    return record


def _judge_absent_stages(
    record: Record, picture: np.ndarray, device: Device, contest: Callable[[str, list[Contestant]], list[Row]]
) -> None:
    """The chain of Poisson and two read noises against a page without any other stage."""
    stages = photosite.stages_of(CHAIN)
    pair = [
        photosite.contestant(picture, stages, device, "absent stages under #if"),
        photosite.contestant(
            picture, stages, photosite.DeletedStages(device, without_absent_stages), "absent stages deleted from the page"
        ),
    ]
    cost = 1 / contest("absent stages", pair)[1]["cpu_ratio"] - 1
    same = bool(np.array_equal(pair[0].codes(), pair[1].codes()))
    figure = f"{100 * cost:+.1f} %, {'same' if same else 'OTHER'} codes"
    what = "absent stages, in CPU time of the kernel without them"
    record.judge(what, figure, "nothing measurable (2 %)", same and cost < 0.02)
