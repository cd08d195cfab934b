"""A study file: axes and their combinations, points that do not depend on each other, and mistakes told with their line."""

import itertools
import math
import re
import shlex
import tracemalloc
from dataclasses import dataclass

import pytest
from helpers.small_sweep import SHOT
from hypothesis import given
from hypothesis import strategies as st

from simulator.config import load_shot
from simulator.config.document import read_document
from simulator.config.document_merge import parse_override
from simulator.config.study_file import Study, load_study_file
from simulator.config.yaml_dialect import dump_flow
from simulator.errors import PhotositeError


@dataclass(frozen=True)
class Level:
    """A quantity of this test. area: measured rows and columns."""

    area: tuple[int, int] | None = None


def load(tmp_path, vary: str, more: str = "", shot: str = SHOT, settings=()) -> Study:
    (tmp_path / "s.yaml").write_text(shot)
    (tmp_path / "study.yaml").write_text(f"study: s\nshot: ./s.yaml\n{more}vary:\n{vary}\n")
    return load_study_file(tmp_path / "study.yaml", {"level": Level}, settings)


def values(study: Study) -> list[tuple]:
    return [tuple(point.values.values()) for point in study]


def test_entries_are_combined_and_what_stands_in_one_entry_goes_side_by_side(tmp_path):
    vary = "  - exposure.iso: [100, 200, 400]\n  - {lens.f_number: [f/2, f/4], exposure.time: [1/500 s, 1/125 s]}"
    study = load(tmp_path, vary)
    assert len(study) == 6 and study.dimensions == [(("exposure.iso",), 3), (("lens.f_number", "exposure.time"), 2)]
    pairs = [(2.0, 1 / 500), (4.0, 1 / 125)]
    taken = [(shot.exposure.iso, shot.lens.f_number, shot.exposure.time_s) for shot in (point.shot() for point in study)]
    assert taken == [(iso, *pair) for iso, pair in itertools.product([100, 200, 400], pairs)]


def test_groups_and_zips_nest(tmp_path):
    group = "group: [{exposure.iso: [100, 200]}, {lens.f_number: [f/2, f/4]}]"
    study = load(tmp_path, f"  - {{{group}, seeds.frame: [1, 2, 3, 4]}}\n  - exposure.time: [1 s, 2 s]")
    four = [(100, "f/2", 1), (100, "f/4", 2), (200, "f/2", 3), (200, "f/4", 4)]
    assert values(study) == [(*one, time) for one in four for time in ("1 s", "2 s")]
    assert study.dimensions == [(("exposure.iso", "lens.f_number", "seeds.frame"), 4), (("exposure.time",), 2)]
    side = load(tmp_path, f"  - zip: [{{{group}}}, {{group: [{{seeds.frame: [7, 8]}}, {{exposure.time: [1 s, 2 s]}}]}}]")
    assert values(side) == [(*one[:2], *two) for one, two in zip(four, itertools.product([7, 8], ["1 s", "2 s"]), strict=True)]
    opened = load(tmp_path, f"  - {group}")
    assert opened.dimensions == [(("exposure.iso",), 2), (("lens.f_number",), 2)]


def test_variants_set_several_keys_by_one_name(tmp_path):
    vary = """\
  - lens: {variants: {wide: {lens.focal_length: 24 mm, lens.f_number: f/2}, long: {lens.focal_length: 85 mm}}}
  - variants:
      sony: {}
      canon: {camera: canon_550d}"""
    study = load(tmp_path, vary)
    assert study.keys == ["lens", "variants"]
    shots = [point.shot() for point in study]
    assert [(shot.lens.focal_length_mm, shot.lens.f_number) for shot in shots] == [(24, 2)] * 2 + [(85, 4)] * 2
    assert [shot.camera.make for shot in shots] == ["Sony", "Canon"] * 2
    assert [point.name for point in study][:2] == ["lens-wide_variants-sony", "lens-wide_variants-canon"]


def test_settings_of_all_points_hold_for_another_camera_too(tmp_path):
    window = "set: {camera.window: {x: 0, y: 0, width: 64, height: 48}}\n"
    study = load(tmp_path, "  - camera: [sony_a7s2, canon_550d]", window, settings=["exposure.iso=200"])
    shots = [point.shot() for point in study]
    assert [(shot.camera.make, shot.camera.frame.width, shot.exposure.iso) for shot in shots] == [
        ("Sony", 64, 200),
        ("Canon", 64, 200),
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{from: 100, to: 25600, log2_step: 1}", [100 * 2**stop for stop in range(9)]),
        ("{from: 1600, to: 100, log2_step: 2}", [1600, 400, 100]),
        ("{from: 100, to: 500, step: 200}", [100, 300, 500]),
        ("{from: 100, to: 400, steps: 3, scale: log2}", [100, 200, 400]),
        ("{range: [100, 300, 100]}", [100, 200]),
    ],
)
def test_steps(tmp_path, text, expected):
    assert values(load(tmp_path, f"  - seeds.frame: {text}")) == [(value,) for value in expected]


def test_steps_keep_their_unit(tmp_path):
    study = load(tmp_path, "  - lens.focus_distance: {from: 1 m, to: 400 cm, step: 50 cm}")
    assert [point.shot().lens.focus_distance_m for point in study] == [1, 1.5, 2, 2.5, 3, 3.5, 4]


def draws(tmp_path, text: str) -> list[float]:
    study = load(tmp_path, f"  - lens.focus_distance: {text}")
    return [point.shot().lens.focus_distance_m for point in study]


def test_draws_repeat_and_stay_when_there_are_more_of_them(tmp_path):
    few = draws(tmp_path, "{random: uniform, from: 1 m, to: 1000 cm, count: 20, seed: 3}")
    more = draws(tmp_path, "{random: uniform, from: 1 m, to: 1000 cm, count: 30, seed: 3}")
    other = draws(tmp_path, "{random: uniform, from: 1 m, to: 1000 cm, count: 20, seed: 4}")
    assert more[:20] == few and len(set(more)) == 30 and not set(other) & set(few)
    assert all(1 <= value <= 10 for value in more)


def test_the_same_draw_is_the_same_quantile_of_each_distribution(tmp_path):
    """u = (uniform - 1) / 9; log-uniform is 10^u, normal its inverse cumulative distribution function."""
    from scipy.stats import norm

    shares = [(value - 1) / 9 for value in draws(tmp_path, "{random: uniform, from: 1 m, to: 10 m, count: 5, seed: 3}")]
    logs = draws(tmp_path, "{random: log_uniform, from: 1 m, to: 10 m, count: 5, seed: 3}")
    normals = draws(tmp_path, "{random: normal, mean: 5 m, sigma: 50 cm, count: 5, seed: 3}")
    assert [math.log10(value) for value in logs] == pytest.approx(shares, abs=1e-8)
    assert normals == pytest.approx([5 + 0.5 * norm.ppf(share) for share in shares], rel=1e-7)


def test_draws_are_rounded_where_whole_numbers_are_wanted(tmp_path):
    study = load(tmp_path, "  - seeds.frame: {random: uniform, from: 0, to: 1e6, count: 5, whole: true}")
    assert all(isinstance(value, int) for (value,) in values(study))


def test_a_point_stays_what_it_is_when_the_study_grows(tmp_path):
    small = load(tmp_path, "  - exposure.iso: [100, 200]\n  - lens.f_number: [f/2, f/4]")
    known = {point.name: point.shot().resolved for point in small}
    large = load(tmp_path, "  - exposure.iso: [400, 100, 200]\n  - lens.f_number: [f/2, f/2.8, f/4]")
    assert len(known) == 4
    assert {point.name: point.shot().resolved for point in large if point.name in known} == known


def test_every_point_has_its_own_noise_unless_asked(tmp_path):
    vary = "  - exposure.iso: [100, 200, 400]"
    frames = [point.shot().seeds.frame for point in load(tmp_path, vary)]
    assert len(set(frames)) == 3
    assert {point.shot().seeds.frame for point in load(tmp_path, vary, "same_noise: true\n")} == {40}
    own = load(tmp_path, vary + "\n  - seeds.frame: [5, 6]")
    assert [point.shot().seeds.frame for point in own] == [5, 6] * 3
    named = load(tmp_path, vary + "\n  - frame: {variants: {a: {}, b: {}}}")
    assert len({point.shot().seeds.frame for point in named}) == len(named) == 6


@pytest.mark.parametrize(
    ("stated", "settings", "base"),
    [
        ("{seeds: {body: 3}}", (), 0),
        ("{seeds.body: 3}", (), 40),
        ("{seeds.frame: 7}", (), 7),
        ("{seeds: {frame: 8, body: 3}}", (), 8),
        ("{seeds: {frame: 8}}", ["seeds.frame=9"], 9),
        ("{}", ["seeds={body: 1}"], 0),
        ("{}", ["seeds.frame=40"], 40),
    ],
)
def test_seeds_at_every_point_leave_each_its_own_noise(tmp_path, stated, settings, base):
    """The seed of a point is the shot's, with what is set at every point, plus a number that follows from its values alone."""
    vary = "  - exposure.iso: [100, 200, 400]"
    offsets = [point.shot().seeds.frame - 40 for point in load(tmp_path, vary)]
    study = load(tmp_path, vary, f"set: {stated}\n", settings=settings)
    frames = [point.shot().seeds.frame for point in study]
    assert frames == [(base + offset) % 2**32 for offset in offsets] and len(set(frames)) == 3
    same = load(tmp_path, vary, f"same_noise: true\nset: {stated}\n", settings=settings)
    assert {point.shot().seeds.frame for point in same} == {base}


def test_only_an_axis_that_states_the_frame_seed_decides_it(tmp_path):
    bodies = load(tmp_path, "  - seeds: [{body: 1}, {body: 2}]\n  - exposure.iso: [100, 200]")
    assert len({point.shot().seeds.frame for point in bodies}) == 4
    assert [point.shot().seeds.body for point in bodies] == [1, 1, 2, 2]
    whole = load(tmp_path, "  - seeds: [{body: 1, frame: 5}, {body: 2, frame: 6}]\n  - exposure.iso: [100, 200]")
    assert [point.shot().seeds.frame for point in whole] == [5, 5, 6, 6]
    mixed = load(tmp_path, "  - noise: {variants: {own: {}, fifth: {seeds.frame: 5}}}\n  - exposure.iso: [100, 200]")
    assert [point.shot().seeds.frame == 5 for point in mixed] == [False, False, True, True]
    with pytest.raises(PhotositeError, match="seeds.frame = many"):
        load(tmp_path, "  - exposure.iso: [100, 200]", "set: {seeds.frame: many}\n")


def test_names_are_file_names_and_differ(tmp_path):
    study = load(tmp_path, "  - lens.focus_distance: [1 m, infinity]\n  - exposure.time: [1/500 s, 2 s]")
    assert [point.name for point in study][:2] == ["focus_distance-1-m_time-1-500-s", "focus_distance-1-m_time-2-s"]
    many = ", ".join(f"{place}: {{variants: {{{'a' * 40}: {{}}, {'b' * 40}: {{}}}}}}" for place in ("one", "two"))
    names = [point.name for point in load(tmp_path, f"  - {{{many}}}\n  - {{three: {{variants: {{c/d: {{}}, c e: {{}}}}}}}}")]
    assert len(set(names)) == 4 and all("/" not in name and len(name) < 110 for name in names)


@pytest.mark.parametrize(
    ("vary", "plain"),
    [
        ("  - light: {variants: {low light: {}, low-light: {}, low/light: {}, high light: {}}}", "light-high-light"),
        ("  - scene.image: [a/1.png, a-1.png, a/2.png]", "image-a-2.png"),
        ('  - lens.model: ["100", 100, "null", null, "101"]', "model-101"),
        ("  - {body: {variants: {a b: {}, a-b: {}, c d: {}}}, seeds.frame: [1, 2, 3]}", "body-c-d_frame-3"),
    ],
)
def test_values_that_read_alike_in_a_file_name_get_names_of_their_own(tmp_path, vary, plain):
    """Those alone end in a hash, whatever the order; the others have the names that they have without them."""
    (tmp_path / "s.yaml").write_text(SHOT)
    (tmp_path / "study.yaml").write_text(f"study: s\nshot: ./s.yaml\nvary:\n{vary}\n  - exposure.time: [1/500 s, 2 s]\n")
    names = [point.name for point in Study(read_document(tmp_path / "study.yaml"), {})]
    assert len(set(names)) == len(names)
    assert [name for name in names if not re.fullmatch(r".*_[0-9a-f]{12}", name)] == [
        f"{plain}_time-1-500-s",
        f"{plain}_time-2-s",
    ]


def test_a_value_that_reads_as_the_next_key_does_not_make_names_alike(tmp_path):
    study = load(tmp_path, "  - one: {variants: {x: {}, x_two-y: {}}}\n  - two: {variants: {z: {}, y_two-z: {}}}")
    assert len({point.name for point in study}) == 4 and study[0].name == "one-x_two-z"
    plain = load(tmp_path, "  - my_time: {variants: {a: {}}}\n  - exposure.time: [1 s]")
    assert [point.name for point in plain] == ["my_time-a_time-1-s"]


def test_the_command_takes_the_same_shot_from_any_folder(tmp_path, monkeypatch):
    (tmp_path / "a.png").touch()
    vary = """\
  - scene: {variants: {flat: {}, picture: {scene: {image: a.png, luminance: 100 cd/m^2}}}}
  - exposure.time: [1/500 s]
  - camera: [ideal, canon_550d]"""
    study = load(tmp_path, vary, "set: {lens.model: 'a: b, c'}\n", SHOT + "sweep: {vary: {exposure.iso: [100, 200]}}\n")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    for point in study:
        program, command, shot, *options = shlex.split(point.command)
        assert (program, command, options[::2]) == ("photosite", "simulate", ["--set"] * (len(options) // 2))
        assert load_shot(shot, options[1::2]).resolved == point.shot().resolved


def test_a_text_that_begins_with_a_home_that_is_not_known_stands_in_the_command_as_written(tmp_path):
    """A picture in such a home is refused; the model of a lens is no file, though it looks like one."""
    (tmp_path / "a.png").touch()
    vary = "  - scene: {variants: {a: {scene: {image: IMAGE, luminance: 1 cd/m^2}}}}"
    with pytest.raises(
        PhotositeError, match=r"study.yaml:\d+: scene.image = ~nosuchuser/a.png: begins with the home of a user"
    ):
        load(tmp_path, vary.replace("IMAGE", "~nosuchuser/a.png"))
    point = next(iter(load(tmp_path, vary.replace("IMAGE", "a.png"), "set: {lens.model: ~nosuchuser/a.png}\n")))
    assert "lens.model=~nosuchuser/a.png" in point.command and str(tmp_path / "a.png") in point.command


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(min_size=1, max_size=5), inner, max_size=3),
    max_leaves=6,
)


@given(plain)
def test_any_value_can_stand_in_a_setting(value):
    assert parse_override(f"a.b={dump_flow(value)}")[1] == value


def test_points_with_the_same_light_stand_together(tmp_path):
    vary = "  - exposure.iso: [100, 200]\n  - lens.f_number: [f/2, f/4]\n  - variants: {a: {seeds.body: 1}, b: {seeds.body: 2}}"
    study = load(tmp_path, vary)
    assert [[study[index].values["lens.f_number"] for index in group] for group in study.by_light()] == [
        ["f/2"] * 4,
        ["f/4"] * 4,
    ]
    assert sorted(index for group in study.by_light() for index in group) == list(range(8))


def test_quantities_are_built_with_their_defaults(tmp_path):
    more = "measure:\n  a: {level: {area: [1, 2]}}\n  b: {level: [3, 4]}\n  c: level\n"
    study = load(tmp_path, "  - exposure.iso: [100]", more)
    assert study.measure == {"a": Level((1, 2)), "b": Level((3, 4)), "c": Level()}
    assert study.measured == {"a": {"level": {"area": [1, 2]}}, "b": {"level": {"area": [3, 4]}}, "c": {"level": {}}}


def test_what_is_written_into_the_folder_is_the_same_study(tmp_path):
    more = "measure:\n  a: {level: [1, 2]}\nset: {scene.image: a.png, scene.chart: null}\nkeep: [dng]\n"
    (tmp_path / "a.png").touch()
    study = load(tmp_path, "  - exposure.iso: [100, 200]", more)
    from simulator.config import dump_yaml

    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "study.yaml").write_text(dump_yaml(study.describe()))
    again = load_study_file(folder / "study.yaml", {"level": Level})
    assert [point.shot().resolved for point in again] == [point.shot().resolved for point in study]
    assert (again.measure, again.keep) == (study.measure, study.keep)
    assert study.describe()["resolved"]["shot"]["lens"]["focal_length"] == "50 mm"


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ("  - exposure.iso: []", "give a list of values"),
        ("  - exposure.iso: 100", "exposure.iso = 100: give a list of values"),
        ("  - 100", "vary = 100: an entry is a mapping"),
        ("  - exposure.iso: [100]\n  - exposure.iso: [200]", "exposure.iso: is varied twice"),
        ("  - exposure.iso: [100, 200, 100]", "exposure.iso = 100: stands there twice"),
        ("  - {exposure.iso: [100, 200], lens.f_number: [f/2]}", "exposure.iso has 2, lens.f_number has 1"),
        ("  - exposure.iso: {from: 100, to: 300, log2_step: 1}", "1.58496 steps lead from one end to the other"),
        ("  - exposure.iso: {from: 100, to: 300}", "give one of steps, step and log2_step"),
        ("  - exposure.iso: {from: 100, to: 300, step: 1, steps: 4}", "give one of steps, step and log2_step"),
        ("  - exposure.iso: {from: 100, to: 300, stepp: 1}", "did you mean `step"),
        ("  - lens.focus_distance: {from: 1 m, to: 3, step: 1 m}", "give all of them a unit, or none"),
        ("  - lens.focus_distance: {from: 1 m, to: 3 s, step: 1 m}", "is a time"),
        ("  - lens.focus_distance: {random: uniform, from: 1 m, count: 3}", "uniform needs to"),
        ("  - lens.focus_distance: {random: normal, mean: 1 m, count: 3}", "normal needs sigma"),
        ("  - lens.focus_distance: {random: uniform, from: 3 m, to: 1 m, count: 3}", "give the least number first"),
        ("  - lens.focus_distance: {random: cauchy, from: 3 m, to: 1 m, count: 3}", "lens.focus_distance.random = cauchy"),
        ("  - {name: {variants: {a: {}}}}", "name is a column of the results; give the axis another name"),
        ("  - variants: {a: 3}", "variants.a = 3: a variant is a mapping"),
        ("  - variants: [1]", "give a mapping of names to settings"),
        ("  - body: {variants: {a: {}}, more: 1}", "body.more: stands beside variants"),
        ("  - lens.fnumber: [f/1]", "did you mean `f_number`?"),
        ("  - exposure.time: [1 s]\n  - lens.f_number: [f/x, f/2]", "lens.f_number = f/x"),
        ("  - exposure.time: [1 s]\n  - lens.f_number: [f/2, f/x]", "lens.f_number = f/x"),
        ("  - scene: {variants: {a: {scene: {image: b.png, luminance: 1 cd/m^2}}}}", "no such file"),
    ],
)  # fmt: skip
def test_a_mistake_is_told_with_its_line(tmp_path, vary, message):
    with pytest.raises(PhotositeError) as caught:
        load(tmp_path, vary)
    assert message in str(caught.value) and caught.value.line is not None
    assert str(tmp_path / "study.yaml") in str(caught.value)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("keep: [raw]\n", "keep.0 = raw"),
        ("measures: {}\n", "did you mean `measure`?"),
        ("measure: {a: {lebel: {}}}\n", "did you mean `level`?"),
        ("measure: {a: {level: {arae: [1, 2]}}}\n", "did you mean `area`?"),
        ("measure: {a: {level: [1]}}\n", "measure.a.level.area"),
        ("measure: {a.b: level}\n", "a label is letters"),
        ("measure: {lens: level}\n", "lens is a section of the shot"),
        ("measure: {a: 3}\n", "give one quantity"),
    ],
)
def test_a_mistake_in_what_is_measured_or_kept_is_told(tmp_path, more, message):
    with pytest.raises(PhotositeError, match=message.replace("?", r"\?")) as caught:
        load(tmp_path, "  - exposure.iso: [100]", more)
    assert caught.value.line is not None


def test_a_value_that_only_some_combinations_refuse_is_not_refused(tmp_path):
    # A 4000 mm lens cannot focus at 2 m.
    study = load(tmp_path, "  - lens.focal_length: [4000 mm, 50 mm]\n  - lens.focus_distance: [2 m, 100 m]")
    assert len(study) == 4
    with pytest.raises(PhotositeError, match=r"lens.focus_distance.* \(|focus_distance"):
        study[0].shot()


def test_a_million_points_are_not_made_up_front(tmp_path):
    study = load(tmp_path, "  - exposure.iso: [100, 200]\n  - seeds.frame: {range: [0, 500000]}")
    assert len(study) == 1_000_000
    assert study[999_999].values == {"exposure.iso": 200, "seeds.frame": 499_999}


MILLION = "{from: 1, to: 2, steps: 1000000}"
HUGE = "1" + 400 * "0"  # a whole number that no float holds


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ([f"a{place}: {MILLION}" for place in range(2)], "vary: gives 1000000000000 points; 10000000 are possible"),
        ([f"a{place}: {MILLION}" for place in range(60)], "vary: gives more than 10^18 points; 10000000 are possible"),
        (["group: [" + ", ".join(f"{{a{place}: {MILLION}}}" for place in range(4)) + "]\n    b: [1]"], "group: gives more"),
        (["seeds.frame: {range: [0, 1000000000]}"], "gives 1000000000 values; 10000000 are possible"),
        (["seeds.frame: {range: [0, 1" + 30 * "0" + "]}"], "gives more than 10^18 values; 10000000 are possible"),
        (["exposure.iso: {from: 100, to: 400, step: 1.0e-6}"], "3e+08 steps lead from one end to the other; 1000000 values"),
        (["exposure.iso: {from: 100, to: 400, step: 1.0e-320}"], "inf steps lead from one end to the other; 1000000 values"),
        (["exposure.iso: {from: 100, to: 400, log2_step: 1.0e-320}"], "inf steps lead from one end to the other"),
        (["exposure.iso: {from: 1.0e+300, to: 1.0e-300, log2_step: 1}"], "1993.16 steps lead from one end to the other"),
        ([f"exposure.iso: {{from: {HUGE}, to: 2, steps: 5}}"], "exposure.iso: is too large a number"),
        ([f"exposure.iso: {{from: 2, to: {HUGE}, step: 5}}"], "exposure.iso: is too large a number"),
        ([f"exposure.iso: {{random: uniform, from: 1, to: {HUGE}, count: 5}}"], "exposure.iso: is too large a number"),
        (["exposure.iso: {random: uniform, from: -1.5e+308, to: 1.5e+308, count: 5, whole: true}"], "lie too far apart"),
        (["exposure.iso: {random: log_uniform, from: 1.0e-300, to: 1.0e+300, count: 5}"], "lie too far apart"),
    ],
)  # fmt: skip
def test_more_values_than_are_possible_are_refused_before_they_are_made(tmp_path, vary, message):
    tracemalloc.start()
    with pytest.raises(PhotositeError) as caught:
        load(tmp_path, "\n".join(f"  - {one}" for one in vary))
    _, most_bytes = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert message in str(caught.value) and caught.value.line is not None and most_bytes < 10_000_000


def test_a_value_that_is_drawn_twice_is_found_among_many(tmp_path):
    with pytest.raises(PhotositeError, match="stands there twice"):
        load(tmp_path, "  - seeds.frame: {random: uniform, from: 0, to: 50000, count: 20000, whole: true}")
    sections = ", ".join(f"{{body: {place}}}" for place in (*range(100), 0))
    with pytest.raises(PhotositeError, match="seeds = .*body.* stands there twice"):
        load(tmp_path, f"  - seeds: [{sections}]")


def test_a_study_that_is_not_there_is_told_with_the_nearest_name():
    with pytest.raises(PhotositeError, match="study = .*: no such file in configs/studies"):
        load_study_file("nothing_like_it", {})
