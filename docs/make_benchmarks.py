"""Writes docs/benchmarks.md from the figures that `make benchmark` left in build/benchmarks, and keeps those beside it.

python docs/make_benchmarks.py [FOLDER]
"""

import json
import shutil
import sys
from pathlib import Path

DOCS = Path(__file__).resolve().parent
PAGE, FIGURES = DOCS / "benchmarks.md", DOCS / "images" / "benchmarks"
CHARTED, PLAIN = ("sensor", "poisson", "pairs", "defocus"), ("live", "raw", "photograph", "motion")
FILES = (*(f"{name}.{kind}" for name in CHARTED for kind in ("json", "png")), *(f"{name}.json" for name in PLAIN))
INTRODUCTION = """\
# Benchmarks

Made by `python docs/make_benchmarks.py` from what `make benchmark` measured; the figures are those of one run, in
`docs/images/benchmarks/*.json`. Run it on your machine: ratios differ with processor and load.

- Contestants take turns in one process, so that other programs disturb all of them alike. The time is the best of the run;
  CPU time is the median over all cores and hardly depends on other programs. On free cores the ratio of times to a peer
  that uses one core is the ratio of CPU times multiplied by the number of cores.
- Every contestant's frame is checked: mean error in σ and variance over that of the model stand in the JSON.
- The picture is in memory (Photosite: on the device) before the clock starts, and the codes are there when it stops.
- NumPy, SciPy, getframes and GalSim use one core, as they do for their users; PyTorch and Photosite use all.
- Light: means from 50 to 50,000 e⁻ (daylight), 1 to 1,000 (dusk), 0.1 to 30 (night), in ramps.
"""
SENSOR = """
## The sensor

{size} photosites on {cores} cores of {processor}, load {load:.1f} at the end.

![Million photosites per second of Photosite and its peers](images/benchmarks/sensor.png)

The bar for the ELD model in NumPy is the faster of two ways to draw Tukey-lambda noise: `scipy.stats.tukeylambda.rvs`, which
most would write, and its quantile function by hand in float32.

| what | measured | asked | |
|---|---|---|---|
{verdicts}

### Price of a stage

CPU time of the kernel with one stage added to Poisson and ADC (= 1), {light}. A stage that is absent is compiled out.

| stage | CPU time |
|---|---|
{prices}
"""
POISSON = """
## Poisson: error against time

Total variation distance to the exact distribution (SciPy, float64) and relative error of the variance, computed from the
kernel's own arithmetic for 30 means from 0 to 10⁶ e⁻, not sampled; time of one count in CPU time, Philox and normal number
included. NumPy's sampler is exact.

![Distance and variance error against the mean, and distance against time](images/benchmarks/poisson.png)

| sampler | means [e⁻] | worst distance | worst error of the variance | CPU ns per count |
|---|---|---|---|---|
{rows}
"""


def sensor_text(record: dict) -> str:
    """The section on whole frames."""
    prices = next(section for section in record["sections"] if section["title"] == "price of each stage")
    machine, (width, height) = record["machine"], record["photosites"]
    return SENSOR.format(
        size=f"{width} x {height}",
        cores=machine["cores"],
        processor=machine["processor"],
        load=machine["load"][0],
        verdicts=verdict_rows(record),
        light=prices["light"],
        prices="\n".join(f"| {row['name'].removeprefix('with ')} | {row['cpu_ratio']:.2f} |" for row in prices["rows"][1:]),
    )


def poisson_text(record: dict) -> str:
    """The section on Poisson samplers."""
    lines = []
    for name in dict.fromkeys(row["sampler"] for row in record["rows"]):
        mine = [row for row in record["rows"] if row["sampler"] == name]
        distance, variance = (max(abs(row[key]) for row in mine) for key in ("distance", "variance_error"))
        times = [row["ns_per_count"] for row in mine]
        time = f"{min(times):.1f} to {max(times):.1f}" if max(times) > min(times) else f"{times[0]:.1f}"
        errors = "exact | exact" if name == "NumPy" else f"{distance:.1e} | {variance:.1e}"
        lines.append(f"| {name} | {mine[0]['mean_e']:.2g} to {mine[-1]['mean_e']:.2g} | {errors} | {time} |")
    return POISSON.format(rows="\n".join(lines))


PAIRS = """
## Pairs for denoisers

{title}. A patch is a mosaic of {size} photosites, cut from the pictures of the sensor
benchmark; it goes from mean electrons in memory to codes in memory. Peers make one patch after the other, which a core's cache
holds. "64 at once" is one call of `simulator.sensor.frame_stack` for 64 patches, "1 at once" one call
for each. Load {load:.1f} at the
end: above the number of cores, the times hold what other programs took, and PyTorch's threads lose more by it than others.

![Million photosites per second of Photosite and its peers, on patches](images/benchmarks/pairs.png)

| pairs per second | {lights} |
|---|{rules}
{rows}

| what | measured | asked | |
|---|---|---|---|
{verdicts}
"""


def verdict_rows(record: dict) -> str:
    """Lines of a table of verdicts, and of what was left out."""
    rows = []
    for verdict in record["verdicts"]:
        word = "reached" if verdict["reached"] else "**missed**"
        rows.append(f"| {verdict['what']} | {verdict['figure']} | {verdict['asked']} | {word} |")
    return "\n".join(rows + [f"| {note} | left out | | |" for note in record.get("notes", [])])


def pairs_text(record: dict) -> str:
    """The section on patches."""
    sections, (width, height) = record["sections"], record["photosites"]
    names = [row["name"] for row in sections[0]["rows"]]
    rows = [[f"{row['pairs_per_s']:.0f}" for row in section["rows"]] for section in sections]
    return PAIRS.format(
        title=sections[0]["title"],
        size=f"{width} x {height}",
        load=record["machine"]["load"][0],
        lights=" | ".join(section["light"] for section in sections),
        rules="---|" * len(sections),
        rows="\n".join(f"| {name} | {' | '.join(column)} |" for name, *column in zip(names, *rows, strict=True)),
        verdicts=verdict_rows(record),
    )


LIVE = """
## Live pairs and a training step

Batches of {batch} pairs of 4 x 256 x 256 from `data_gen.torch` feed three convolutions of 16 channels, on the CPU: about
the least that trains a denoiser, so that the loader's share is near its greatest. A step waits for its batch, then trains.
PyTorch and PoCL use all {cores} cores, so what a worker saves in waiting it takes from the network: the last column says
what a step costs in all. Pictures of the data set are read and cut beforehand. Load {load:.1f} at the end.

| batches | workers | step [ms] | waiting | step over the network alone |
|---|---|---|---|---|
{rows}
"""

LIVE_PHOTOGRAPHS = """
## Live pairs from photographs

4 x 128 x 128 from a folder of JPEGs of 24 megapixels, in shuffled epochs without a network. The NumPy loop
(`benchmarks/peers/numpy_pairs.py`) decodes each picture once in each worker, cuts, and draws Poisson and normal numbers. Both
take turns. The first epoch starts the workers and decodes.

| pairs | workers | first epoch [1/s] | later epochs [1/s] | over the loop |
|---|---|---|---|---|
{rows}
"""


def live_text(record: dict) -> str:
    """The section on training steps."""
    rows = [
        f"| {row['name']} | {row['workers']} | {1e3 * row['step_s']:.0f} | {row['share']:.1%} | {row['over_alone']:.2f} |"
        for row in record["rows"]
    ]
    machine, left_out = record["machine"], [f"| left out: {note} | | | | |" for note in record["notes"]]
    lines = "\n".join(rows + left_out)
    text = LIVE.format(batch=record["batch"], cores=machine["cores"], load=machine["load"][0], rows=lines)
    photographs = [
        f"| {row['name']} | {row['workers']} | {row['first']:.0f} | {row['later']:.0f} | {row['over_loop']:.2f} |"
        for row in record.get("photographs", [])
    ]
    return text + (LIVE_PHOTOGRAPHS.format(rows="\n".join(photographs)) if photographs else "")


RAW = """
## Writing raw files

{size} photosites; a plain write is written beside and renamed like the others, and is on the disk when it returns.

| | best [s] | median [s] |
|---|---|---|
{rows}

| what | measured | asked, at most | |
|---|---|---|---|
{verdicts}
"""


def raw_text(record: dict) -> str:
    """The section on raw files."""
    rows = [f"| {row['name']} | {row['best_s']:.3f} | {row['median_s']:.3f} |" for row in record["rows"]]
    width, height = record["photosites"]
    return RAW.format(size=f"{width} x {height}", rows="\n".join(rows), verdicts=verdict_rows(record))


DEFOCUS = """
## The lens blur

{size} photosites on {cores} cores, RGGB; processor time hardly depends on other programs. Load {load:.1f} at the end.

| one radius [px] | processor time [s] | over the sensor kernel |
|---|---|---|
{radii}

A wall that tilts from focus to a radius of 16 photosites behind disks of radius 6 on the other side; error against rays through
the lens in a window with edges, in units of the noise of 2,000 e⁻. SciPy sees one picture with its depth, as its users do.
Mitsuba (`scalar_rgb`, `thinlens`) renders both surfaces in the window; its times are scaled to the frame by the number of
photosites, and the time at equal error comes from the power law through its two longest renders.

![Run time against p99 of the error](images/benchmarks/defocus.png)

| method | time [s] | processor time [s] | p99 of abs(z) | rms |
|---|---|---|---|---|
{rows}

| what | measured | asked | |
|---|---|---|---|
{verdicts}
"""


def seconds(time_s: float) -> str:
    """A time with one decimal, or none from 100 s on."""
    return f"{time_s:.1f}" if time_s < 100 else f"{time_s:,.0f}"


def defocus_text(record: dict) -> str:
    """The section on the lens blur."""
    radii = [
        f"| {row['radius_px']:g} | {row['cpu_s']:.2f} | {row['cpu_s'] / row['sensor_cpu_s']:.1f} |" for row in record["radii"]
    ]
    rows = [
        f"| {row['name']} | {seconds(row['best_s'])} | {seconds(row['cpu_s'])} | {row['p99']:.2f} | {row['rms']:.2f} |"
        for row in record["rows"]
    ]
    machine, (width, height) = record["machine"], record["photosites"]
    return DEFOCUS.format(
        size=f"{width} x {height}",
        cores=machine["cores"],
        load=machine["load"][0],
        radii="\n".join(radii),
        rows="\n".join(rows),
        verdicts=verdict_rows(record),
    )


PHOTOGRAPH = """
## Whole photographs

The scene of `make demo`, the Middlebury motorcycle with its measured depth, on {size} photosites and {cores} cores; second
call in a process, best of the run, unless a row is a process of its own with warm caches. Load {load:.1f} at the end.

| | time [s] | processor time [s] | over the ideal lens |
|---|---|---|---|
{lenses}

| window of 512 x 512 | whole frame [s] | window [s] | its share, half as much again, and 10 ms [s] |
|---|---|---|---|
{crops}

| process, or sharp frame of a chart | time [s] |
|---|---|
{times}

| large frame [Mpixel] | time [s] | peak of memory [GB] | stated by `explain` [GB] |
|---|---|---|---|
{large}

| what | measured | asked, at most | |
|---|---|---|---|
{verdicts}
"""


def photograph_text(record: dict) -> str:
    """The section on whole photographs."""
    rows, machine, (width, height) = record["rows"], record["machine"], record["photosites"]
    lenses = [
        f"| {row['name']} | {row['best_s']:.2f} | {row['cpu_s']:.2f} | {row.get('ratio', 1.0):.1f} |"
        for row in [*rows["photograph"], *rows.get("lens", [])]
    ]
    crops = [f"| {row['name']} | {row['whole_s']:.2f} | {row['window_s']:.3f} | {row['most_s']:.3f} |" for row in rows["crop"]]
    times = [f"| {row['name']} | {row['best_s']:.2f} |" for row in [*rows["start"], *rows["end to end"], *rows["again"]]]
    large = [
        f"| {row['megapixels']:.0f} | {row['time_s']:.1f} | {1e-9 * row['peak_bytes']:.2f} | {1e-9 * row['stated_bytes']:.2f} |"
        for row in rows["large"]
    ]
    return PHOTOGRAPH.format(
        size=f"{width} x {height}",
        cores=machine["cores"],
        load=machine["load"][0],
        lenses="\n".join(lenses),
        crops="\n".join(crops),
        times="\n".join(times),
        large="\n".join(large),
        verdicts=verdict_rows(record),
    )


MOTION = """
## Motion blur

Paths of 20 photosites on {cores} cores, processor time, which hardly depends on other programs. Load {load:.1f} at the end.

Run time against error, {error_size} photosites without colour filter: squares of 5 photosites, dark to bright; a nearer layer
of disks and bars moves before one at rest. The error is against sums in float64 over {instants} instants, {points} points of
aperture and time where the lens blurs, in units of the noise of 2,000 e⁻. Peers accumulate frames in float32 on one core:
shifted by `scipy.ndimage.shift`, by slices of arrays, or blurred by FFT before they move. Behind the lens a frame is one
point of the aperture at one instant.

| scene | method | time [s] | processor time [s] | p99.9 of abs(z) | rms |
|---|---|---|---|---|---|
{errors}

Whole shots in colour, second call in a process, beside the same shot at rest; tolerance 0.1 σ:

| shot | Mpixel | time [s] | processor time [s] | over rest |
|---|---|---|---|---|
{prices}

| what | measured | asked, at most | |
|---|---|---|---|
{verdicts}
"""


def motion_text(record: dict) -> str:
    """The section on what moves."""
    rows, machine, points = record["rows"], record["machine"], record["reference_points"]
    errors = [
        f"| {row['scene']} | {row['name']} | {row['best_s']:.3f} | {row['cpu_s']:.3f} | {row['p99_9']:.2f} | {row['rms']:.3f} |"
        for row in rows["error"]
    ]
    prices = [
        f"| {row['name']} | {row['megapixels']:g} | {row['best_s']:.2f} | {row['cpu_s']:.2f} | {row['cpu_s_ratio']:.1f} |"
        for row in [*rows["sharp"], *rows["blurred"]]
    ]
    return MOTION.format(
        cores=machine["cores"],
        load=machine["load"][0],
        error_size="{} x {}".format(*record["error_photosites"]),
        instants=f"{points['sharp']:,}",
        points=f"{points['blurred']:,}",
        errors="\n".join(errors),
        prices="\n".join(prices),
        verdicts=verdict_rows(record),
    )


def main() -> None:
    """Copy the figures and write the page."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS.parent / "build" / "benchmarks"
    FIGURES.mkdir(parents=True, exist_ok=True)
    for name in FILES:
        shutil.copyfile(folder / name, FIGURES / name)
    texts = {"sensor": sensor_text, "pairs": pairs_text, "live": live_text, "poisson": poisson_text, "raw": raw_text}
    texts |= {"defocus": defocus_text, "photograph": photograph_text, "motion": motion_text}
    records = {name: json.loads((FIGURES / f"{name}.json").read_text(encoding="utf-8")) for name in texts}
    PAGE.write_text(INTRODUCTION + "".join(text(records[name]) for name, text in texts.items()), encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
