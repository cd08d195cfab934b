"""Writes docs/stress.md from the worst inputs that `make stress` left in build/benchmarks, and keeps those beside it.

python docs/make_stress.py [FOLDER]

The chart needs matplotlib.
"""

import json
import shutil
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parent
PAGE, KEPT = DOCS / "stress.md", DOCS / "images" / "benchmarks" / "stress.json"
CHART, LEAST = KEPT.with_suffix(".png"), 1e-4  # share of a bound that smaller ones count as in the chart
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
- A bound in ulps follows from the roundings of the computation. Behind a lens a shot promises its tolerance, 0.1 σ, or what
  its [error budget](error_budget.md) states where that is more, for 99.9 % of its photosites: **of its promise** is their
  error in that unit, at most 1, and the search climbs on it. The column in σ has the single worst photosite of all.

`python -m stress.bits` runs the same inputs on one device after the other and compares the bits.

{count} cases, {tried:,} inputs, {seconds} s of processor time a case, {device}.

| case | functions of kernels | worst [ulp] | bound | worst [σ] | bound | of its promise | inputs | at, among others |
|---|---|---|---|---|---|---|---|---|
{rows}

![The worst of each case as a share of its bound](images/benchmarks/stress.png)

Cases without any error stand at 10⁻⁴.

## Where the bounds come from

{reasons}

## What was found

- The steepest step of a patch at the right end of a map of radii left out every second pair of columns. Named test:
  `test_a_step_inside_the_last_patch_of_a_row_is_seen`.
- A place in the scene was one number of float32: at the border of light and black 3·10⁻⁴ of the light was misplaced at
  column 6,000 of a scene of 1.1 to 2.7 pixels per photosite, 327 σ in black beside extremes, and 2.4 σ in scenes of fewer
  pixels (`projection_places`). Places are in fixed point, with 0.004 σ
  (`test_places_far_from_the_corner_are_as_exact_as_near_it`,
  `test_places_in_a_coarse_scene_far_from_the_corner_are_as_exact_as_near_it`). Where a lens distorts or anything moves, the
  displacement is a number of its own: 2·10⁻⁷ of it is left, 10⁻⁵ pixels of 90 photosites, where 5·10⁻⁴ were
  (`test_displaced_places_far_from_the_corner_are_as_exact_as_near_it`).
- The veil's 232 ulps came from an axis between halves of photosites, which no sensor has and float32 rounds; the search
  draws none (`test_a_veil_far_from_the_axis_is_as_exact_as_the_fall_off`).
- Fog of an alpha below 10⁻⁷ lost its light, 3,000 σ where that is bright: 1 − e^−x is a series for small x. Parts of a
  denormal alpha are rounded, 2,500 σ: the light of a part is its share of the depth
  (`test_fog_of_a_tiny_alpha_keeps_its_light`).
- The 1.9 σ of a penumbra and the 0.8 σ of stripes behind an edge (`occlusion`) were those of their truth: slanted edges and
  waves, which squares of half a photosite do not hold. Against the squares they are off by 0.01 and 0.1 σ, where the budget
  states 1.6 (`test_a_slanted_edge_of_squares_is_as_exact_as_an_upright_one`,
  `test_stripes_of_squares_are_told_by_the_budget`).
- Behind a round aperture the rims of bright squares over black were off by 9 σ: weights of squares were means over parts of
  them. They are exact (`test_the_rim_of_a_bright_light_over_black_is_sharp`).
- A lamp of one pixel in a scene finer than the photosites was copied as sharp where its circle was below 0.3 photosites,
  since one pixel counts in no quantile of the light: 2.6 to 7 σ in searches, up to 1,100 σ of 10⁷ electrons. It is blurred
  where its light shows in the dark, and gathered from the scene's pixels where no samples divide them
  (`test_a_single_lamp_in_the_dark_is_blurred_however_small_its_circle`). Below 0.004 scene pixels circles were gathered as
  of 0.004, 89 σ of such a lamp.
- The truth itself lost all light at circles of denormal radii (`test_the_truth_of_the_smallest_circle_is_that_of_none`).
- A scene of one pixel per photosite does not tell where in its pixel a lamp is. The reference path and the fast ones take
  its light for smooth and agree to 10⁻⁴ σ. A square of light of that size differs from it by up to 1,400 σ of 10⁷ electrons
  at radii of 0.05 to 8 photosites, which the budget states: sharp as a limit of the input
  (`test_a_lamp_of_one_pixel_per_photosite_is_told_to_be_unknown_inside_it`), blurred as edges of its spot.
- Where no samples divide the scene's pixels, the rim of a lamp of 2·10⁷ electrons was off by 12 σ where it ends in the dark:
  rectangles of the aperture have its moments, not its rim. Tiles that lamps reach take up to four times as many
  (`test_rectangles_end_the_spot_of_a_lamp_within_their_law`,
  `test_tiles_that_a_lamp_reaches_take_more_rectangles_and_no_others`).
- Black and white squares that samples mix are off by up to 2.5 times what 99 % of grey ones keep below, which the budget stated
  1.7 times: 0.27 σ at 20,000 electrons where it stated 0.19. It states it three times
  (`test_black_and_white_squares_that_samples_mix_keep_what_is_told`).
- Instants were planned for a border whose noise is that of a tenth of the light beside it. Where a path ends a little beyond a
  photosite in the dark, that photosite has the noise of the dark: 1.3 σ after a path of 5 photosites at 17,000 e⁻ in 40
  instants. They lie denser at the ends of a path, and count bends of the light at bright pixels
  (`test_a_path_that_ends_in_the_dark_keeps_what_its_plan_promises`).
- Rows of the scene under a span of photosites were blended at the places of pixels and read between them, where the image
  turns along the span: 37 σ of 1.6·10⁶ electrons over black at a roll of 0.3°, 2 σ of 2·10⁵ at 0.01°.
  A pan counted as a shift to 10⁻³ photosites, whatever the light: 1.4 σ of 2·10⁵. Each photosite reads at its own place, places
  along a span are in fixed point, and an image is a shift to 5 % of the allowed error
  (`test_bright_pixels_over_black_keep_what_is_told_where_the_camera_turns_a_little`).
- The 6,000 ulps of `projection` were those of denormal light, which float32 holds to 1.4·10⁻⁴⁵ before it is counted in
  electrons.
- Lamps out of focus where no samples divide the scene's pixels were off by 50 σ at 3·10⁵ e⁻ where 28 were stated. They are
  drawn one by one, right to 0.003 σ of 3·10⁷ e⁻ (`test_lamps_out_of_focus_keep_the_tolerance`); what 512 chords of the truth
  leave of such lamps is 0.3 σ. Behind layers, of depth maps and behind blades they go through samples. Their rims count in
  the noise of the light around them: 9,400 σ were found beside a patch of light where 943 were stated
  (`test_a_lamp_in_the_dark_counts_in_its_noise_whatever_else_is_lit`). In 12 × 16 photosites a lamp was the brightest light
  itself, 9.7 σ where 1.5 were stated (`test_a_lamp_that_is_the_brightest_light_of_a_tiny_frame_is_a_lamp`).
- Such tiny frames of a pixel per photosite, where a blur of up to 0.4 photosites is left out, do not tell where in its pixel
  a lamp is either: 3.2 σ of 100 e⁻ where 1.6 were stated. They state it as others do
  (`test_a_lamp_that_is_the_brightest_light_of_a_tiny_frame_is_told_to_be_unknown_inside_it`).
- Instants whose distance fits that of pixels meet all bends of the light at one phase, and their errors add: 0.129 σ of
  noise on a diagonal of 6 photosites in 73 instants where 0.1 is promised, 0.05 in 75. Counts are chosen by what they leave of
  random pixels (`test_noise_on_a_diagonal_keeps_what_its_plan_promises`). Pixels finer or coarser than photosites are not
  looked at.
- Where few electrons asked for few points of the aperture, 32 of them corrected what layers hide of each other: 0.19 σ of 60 e⁻
  at the ends of penumbrae of 10 photosites where 0.09 were stated. There are 64 at least
  (`test_a_correction_has_points_enough_past_the_end_of_a_penumbra`).
- Running sums down a column, each times a weight, did not cancel: 3.4 σ in black that shares columns with lights of 10⁷ e⁻.
  They are read as differences, which are 0 where nothing was added, and their roundings do not add up
  (`test_the_dark_beside_lights_of_ten_million_electrons_stays_dark`). Open: the sums themselves are numbers of float32. In dim
  light, not black, below 8 rows of 1.4·10⁷ e⁻ each, 0.18, 0.58 and 2.0 σ are left behind circles of 8, 3 and 0.5
  photosites, where there were up to 7.5 σ.
- Rays through samples of half a photosite took circles of less than half a photosite for points: 2.8 σ behind the edge of a
  nearer surface where 0.56 were stated, 0.2 since
  (`test_circles_inside_a_photosite_blur_behind_the_edge_of_a_nearer_surface`).
- An aperture had as few rectangles up to half a photosite as for no blur: rims of single bright pixels over black were off by
  1.6 times what was stated, 0.8 since
  (`test_rims_of_single_bright_pixels_over_black_keep_what_is_told_of_rectangles`).
- One sample per photosite of a scene of four or more pixels spread a lamp over it: 23.9 σ at the rim of a spot of 13 photosites
  where 14.8 were stated, and 4.2 where 2.0 were, past a slanted rim. They are stated
  (`test_a_small_lamp_in_the_corner_of_a_photosite_keeps_what_is_told_of_its_rim`).
- Single bright pixels behind eight rectangles of the aperture were off by 1.13 times what was stated, a sixth of them bright
  (`test_single_bright_pixels_gathered_by_eight_rectangles_keep_what_is_told_of_them`).
- Squares of shares of crosstalk were below the range of float32: 10³⁵ e⁻ through a share of 10⁻³³ had no variance.
  Shares are taken twice.
- Which four radii lie around a place on the middle of a pixel is rounded: where one of the neighbours belongs to another
  surface the search of `projection_radius` compared different ones. It leaves such places out.
- The edge of a dark layer before a bright one is a step in the noise of the dark, which neither layer has by itself: 0.37 σ at
  592 e⁻ in 15 instants where 0.1 is promised. What is seen of layers at rest and at the
  end of their path counts, too (`test_edges_of_a_dark_layer_before_a_bright_one_count_in_the_noise_of_the_dark`).
- Layers that a pan of half a photosite makes drift by less than counts are composited within photosites, right to 0.001 σ at
  5 e⁻; the means over photosites that `drifting_layers` compares are 0.6 σ from that, and are compared with means.
- Single bright pixels of half a photosite over black that move on diagonals left up to 0.21 σ where 0.1 is promised
  (`layer_phases`). A path that slants past the corner of a pixel sees little light of it in its middle, too, where
  instants were sparse: they are as many as corners need
  (`test_a_slanting_path_past_corners_of_lights_keeps_what_its_plan_promises`).
- Open: behind kernels by distance the wide tail of the light is that of the sharp picture, which nothing occludes. Layers
  that hide each other lack the tail's share times the covariance of cover and light over it. Of two textured layers at 33 e⁻
  (`test_layers_out_of_focus_have_their_covariance`) the tail has 5.8, 3.7, 2.5 and 1.3 % at tolerances of 0.3, 0.1, 0.05 and
  0.02 σ, and 0.24, 0.091, 0.059 and 0.031 σ are left, where the terms state 0.24, 0.074, 0.042 and 0.017: what is promised
  holds from 0.1 σ on.
"""


def number(value: float | None) -> str:
    """A figure with three digits, or none."""
    return "" if value is None else f"{value:.3g}"


def row(name: str, record: dict[str, Any]) -> str:
    """A line of the table."""
    kernels = ", ".join(f"`{kernel}`" for kernel in record["kernels"]) or "those of `kernels/*.h`"
    worst = {key: value for key, value in record["worst"].items() if not isinstance(value, str) or value[:1].isalpha()}
    told = [f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}" for key, value in worst.items()][:SHOWN]
    told += [f"{key} {value}" for key, value in record["worst"].items() if key not in worst][:1]
    figures = [number(record[key]) for key in ("ulps", "most_ulps", "sigma", "most_sigma", "promises")]
    return f"| `{name}` | {kernels} | {' | '.join(figures)} | {record['tried']:,} | {'; '.join(told)} |"


def share_of_bound(record: dict[str, Any]) -> float:
    """The worst error of a case as a share of its bound, the largest of its units."""
    bounds = {"ulps": record["most_ulps"], "sigma": record["most_sigma"], "promises": 1.0}
    kept = {unit: most for unit, most in bounds.items() if record[unit] is not None and most is not None}
    return max((record[unit] / most if most else float(record[unit] > 0.0) for unit, most in kept.items()), default=0.0)


def draw(records: dict[str, Any]) -> None:
    """Write the chart: a point for each case, the largest share on top; what stands right of 1 is a fault."""
    from matplotlib.figure import Figure

    shares = sorted((max(share_of_bound(record), LEAST), name) for name, record in records.items())
    figure = Figure(figsize=(6.4, 0.17 * len(shares) + 0.8), layout="constrained")
    axis = figure.subplots()
    colors = ["#c8102e" if share > 1.0 else "#1a5468" for share, _ in shares]
    axis.hlines(range(len(shares)), LEAST, [share for share, _ in shares], colors=colors, linewidth=1.0)
    axis.scatter([share for share, _ in shares], range(len(shares)), c=colors, s=14, zorder=3)
    axis.axvline(1.0, color="#8a6d3b", linewidth=1.0)
    axis.set_yticks(range(len(shares)), [name for _, name in shares], fontsize=7)
    axis.set(xscale="log", xlim=(0.8 * LEAST, 3.0), ylim=(-0.7, len(shares) - 0.3), xlabel="worst error found / bound")
    if shares[-1][0] > 2.0:
        axis.set_xlim(right=2.0 * shares[-1][0])
    axis.spines[["top", "right"]].set_visible(False)
    figure.savefig(CHART, dpi=120)


def main() -> None:
    """Copy the figures, draw the chart and write the page."""
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
    draw(records)
    print(f"wrote {PAGE}")


if __name__ == "__main__":
    main()
