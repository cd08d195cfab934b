"""Writes docs/stress.md from the worst inputs that `make stress` left in build/benchmarks, and keeps those beside it.

python docs/make_stress.py [FOLDER]
"""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
PAGE, KEPT = DOCS / "stress.md", DOCS / "images" / "benchmarks" / "stress.json"
SHOWN = 4  # inputs of a worst case
TEXT = """\
# Stress

Made by `python docs/make_stress.py` from what `make stress` found; the figures are those of one run, in
`docs/images/benchmarks/stress.json`.

Each kernel runs beside the same in float64 (NumPy, SciPy, closed forms), on inputs that a search makes worse: hypothesis
draws them, and a hill climb starts from the worst it drew. The inputs are pictures of extremes (denormals, 10⁻³⁸ to 10³⁸,
lights over black, alternating pixels) and numbers of stages, lens and motion, often a switch point of the plan or one ulp
beside it. `benchmarks/stress/` has the cases, `python -m stress --help` (with `PYTHONPATH=tests:benchmarks`) the options.

- An **ulp** is the last place of float32 of the result, or of the terms where these cancel. A number that is lost (NaN,
  infinity) counts as infinitely wrong, one that float32 cannot hold is left out.
- **σ** is the noise of the photosite itself: shot noise of its electrons and 1 e⁻ of read noise, up to 10⁷ e⁻.
- What stands above its bound is a fault that is known and open.
- A bound in ulps follows from the roundings of the computation. Behind a lens or in motion the shot's tolerance is 0.1 σ,
  which is a promise for 99.9 % of the photosites, while the table has the single worst of all that were searched.

`python -m stress.bits` runs the same inputs on one device after the other and compares the bits.

{count} cases, {tried:,} inputs, {seconds} s of processor time a case, {device}.

| case | kernels | worst [ulp] | bound | worst [σ] | bound | inputs | at, among others |
|---|---|---|---|---|---|---|---|
{rows}

## Where the bounds come from

{reasons}

## What was found

- The steepest step of a patch at the right end of a map of radii left out every second pair of columns. Named test:
  `test_a_step_inside_the_last_patch_of_a_row_is_seen`.
- A place in the scene was one number of float32: at the border of light and black 3·10⁻⁴ of the light was misplaced at column
  6,000 of a scene of 1.1 to 2.7 pixels per photosite, 327 σ in black beside extremes, and 2.4 σ in scenes of fewer pixels
  (`projection_places`). Places are in fixed point, with 0.004 σ
  (`test_places_far_from_the_corner_are_as_exact_as_near_it`,
  `test_places_in_a_coarse_scene_far_from_the_corner_are_as_exact_as_near_it`). Where a lens distorts or anything moves, the
  displacement is a number of its own: 2·10⁻⁷ of it is left, 10⁻⁵ pixels of 90 photosites, where 5·10⁻⁴ were
  (`test_displaced_places_far_from_the_corner_are_as_exact_as_near_it`).
- The veil's 232 ulps came from an axis between halves of photosites, which no sensor has and float32 rounds; the search draws
  none (`test_a_veil_far_from_the_axis_is_as_exact_as_the_fall_off`).
- Fog of an alpha below 10⁻⁷ lost its light, 3,000 σ where that is bright: 1 − e^−x is a series for small x
  (`test_fog_of_a_tiny_alpha_keeps_its_light`).
- The 1.9 σ of a penumbra (`occlusion`) were those of its truth: a slanted edge, which squares of half a photosite do not
  hold. Against the squares it is off by 0.01 σ (`test_a_slanted_edge_of_squares_is_as_exact_as_an_upright_one`).
- Behind a round aperture the rims of bright squares over black were off by 9 σ: weights of squares were means over parts of
  them. They are exact (`test_the_rim_of_a_bright_light_over_black_is_sharp`).
- Open: a lamp of one pixel, 10,000 times as bright as 1,000 e⁻ around it, in a scene of one pixel per photosite is spread
  from samples of light that is smooth between pixels. A square of light of that size differs from it by 50 to 400 σ at radii
  of 0.8 to 8 photosites (52 σ at 8, where the error budget states 110 σ). A circle of 0.3 photosites counts as sharp there,
  and with two pixels per photosite, too, whatever the lamp: 900 and 1,100 σ.
- Open: where pixels move one by one (`swept_vectors`), places are searched in numbers of float32, and the mean over a path of
  5 photosites at 10,500 e⁻ is off by 0.9 σ beside extremes.
"""


def number(value: float | None) -> str:
    """A figure with three digits, or none."""
    return "" if value is None else f"{value:.3g}"


def row(name: str, record: dict[str, Any]) -> str:
    """A line of the table."""
    kernels = ", ".join(f"`{kernel}`" for kernel in record["kernels"]) or "functions of `kernels/*.h`"
    worst = {key: value for key, value in record["worst"].items() if not isinstance(value, str) or value[:1].isalpha()}
    told = [f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}" for key, value in worst.items()][:SHOWN]
    told += [f"{key} {value}" for key, value in record["worst"].items() if key not in worst][:1]
    figures = [number(record[key]) for key in ("ulps", "most_ulps", "sigma", "most_sigma")]
    return f"| `{name}` | {kernels} | {' | '.join(figures)} | {record['tried']:,} | {'; '.join(told)} |"


def main() -> None:
    """Copy the figures and write the page."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else DOCS.parent / "build" / "benchmarks"
    KEPT.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(folder / "stress.json", KEPT)
    records = json.loads(KEPT.read_text(encoding="utf-8"))
    text = TEXT.format(
        count=len(records),
        seconds=", ".join(f"{value:g}" for value in sorted({record["seconds"] for record in records.values()})),
        tried=sum(record["tried"] for record in records.values()),
        device=next(iter(records.values()))["device"],
        rows="\n".join(row(name, record) for name, record in records.items()),
        reasons="\n".join(f"- `{name}`: {record['why']}." for name, record in records.items()),
    )
    PAGE.write_text(text, encoding="utf-8")
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
