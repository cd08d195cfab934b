"""Dials: which settings a metered exposure gets. Truth: exposure = t / N^2 / white, written out by hand."""

import math

import pytest

from simulator.errors import PhotositeError
from simulator.exposure.dials import AutoIso, Body, Dials, ExposureSolver, Settings

ISOS = (100, 200, 400, 800, 1600)
BODY = Body(
    solid_angle_sr=lambda f_number: 1.0 / f_number**2,
    white_e=lambda iso: 1e5 * 100 / iso,
    f_number_for=lambda sr: 1.0 / math.sqrt(sr),
    isos=ISOS,
    has_iso=lambda iso: not 800 < iso < 1600,
    widest=2.0,
    hand_held_s=1 / 64,
)
FREE = Dials("free")


def solve(mode, wanted_s, f_number=4.0, time_s=0.0, auto=None, dials=FREE):
    """Solve for the light that needs this time [s] at f/4 and ISO 100."""
    wanted = wanted_s / 16.0 / 1e5
    return ExposureSolver(mode, wanted, Settings(time_s, f_number, 100), dials, auto, BODY).solve()


def exposure(settings: Settings) -> float:
    """Time at f/4 and ISO 100 of the same exposure [s]."""
    return settings.time_s * 16 / settings.f_number**2 * settings.iso / 100


def test_aperture_priority_chooses_the_time():
    found = solve("aperture_priority", 1 / 50)
    assert found.settings == Settings(pytest.approx(1 / 50), 4.0, 100)
    assert found.deviation_stops == pytest.approx(0.0, abs=1e-12) and found.limits == ()
    assert solve("aperture_priority", 1 / 50, f_number=8.0).settings.time_s == pytest.approx(4 / 50)


def test_shutter_priority_chooses_the_aperture():
    found = solve("shutter_priority", 1 / 50, time_s=1 / 200)
    assert found.settings == Settings(1 / 200, pytest.approx(2.0), 100) and found.limits == ()
    assert solve("shutter_priority", 1 / 50, time_s=1 / 3).settings.f_number == pytest.approx(4 * math.sqrt(50 / 3))


@pytest.mark.parametrize(
    ("mode", "wanted_s", "settings", "limit", "stops"),
    [
        ("aperture_priority", 300.0, {}, "longest time", math.log2(30 / 300)),
        ("aperture_priority", 1e-6, {}, "shortest time", math.log2(1 / 8000 / 1e-6)),
        ("shutter_priority", 1.0, {"time_s": 1 / 100}, "widest aperture", math.log2(4 / 100)),
        ("shutter_priority", 1e-6, {"time_s": 1 / 100}, "narrowest aperture", math.log2(0.01 * 16 / 22**2 / 1e-6)),
        ("manual", 1.0, {"time_s": 1 / 100, "auto": AutoIso()}, "highest ISO", math.log2(16 / 100)),
        ("manual", 1.0, {"time_s": 4.0, "auto": AutoIso()}, "lowest ISO", 2.0),
        ("manual", 1.0, {"time_s": 1 / 100, "auto": AutoIso(highest=300)}, "highest ISO", math.log2(3 / 100)),
    ],
)
def test_the_limit_that_binds_is_named_and_the_deviation_is_what_it_costs(mode, wanted_s, settings, limit, stops):
    found = solve(mode, wanted_s, **settings)
    assert found.limits == (limit,)
    assert found.deviation_stops == pytest.approx(stops)
    assert math.log2(exposure(found.settings) / wanted_s) == pytest.approx(stops)


def test_auto_iso_rises_where_the_time_gets_too_long():
    auto = AutoIso(longest_s=1 / 100)
    assert solve("aperture_priority", 1 / 200, auto=auto).settings == Settings(pytest.approx(1 / 200), 4.0, 100)
    found = solve("aperture_priority", 1 / 30, auto=auto)
    assert found.settings.iso == 333 and found.settings.time_s == pytest.approx(1 / 100, rel=2e-3)
    assert exposure(found.settings) == pytest.approx(1 / 30)
    dark = solve("aperture_priority", 10.0, auto=auto)
    assert dark.settings == Settings(pytest.approx(10 / 16), 4.0, 1600)  # the ISO is spent, so that the time gets longer
    on_dial = solve("aperture_priority", 1 / 30, auto=auto, dials=Dials())
    assert on_dial.settings.iso == 400 and abs(on_dial.deviation_stops) <= 1 / 6 + 1e-9


def test_an_iso_that_was_not_measured_is_not_chosen():
    """Between 800 and 1600 the body has none; truth: 1000 is nearer to 800, 1300 to 1600, in stops."""
    for wanted_iso, iso in ((700, 700), (1000, 800), (1300, 1600)):
        found = solve("manual", wanted_iso / 100, time_s=1.0, auto=AutoIso())
        assert found.settings.iso == iso and found.limits == ()
        assert found.deviation_stops == pytest.approx(math.log2(iso / wanted_iso), abs=1e-9)


def test_shutter_priority_raises_the_iso_when_the_aperture_is_open():
    found = solve("shutter_priority", 1 / 50, time_s=1 / 800, auto=AutoIso())
    assert found.settings == Settings(1 / 800, 2.0, 400) and found.limits == ()
    assert found.deviation_stops == pytest.approx(0.0)


@pytest.mark.parametrize(("wanted_s", "time_s"), [(1 / 30, 3 / 100), (1 / 120, 1 / 120), (1 / 100, 1 / 100), (1 / 51, 1 / 100)])
def test_times_are_whole_periods_of_the_lamps_and_the_iso_takes_the_rest(wanted_s, time_s):
    """50 Hz mains: lamps flicker at 100 Hz. t = floor(t / P) P from a period on; time * gain is kept."""
    found = solve("aperture_priority", wanted_s, auto=AutoIso(longest_s=1 / 25, mains_hz=50.0))
    assert found.settings.time_s == pytest.approx(time_s)
    assert exposure(found.settings) == pytest.approx(wanted_s, rel=0.5 / 100)  # a whole ISO
    assert found.limits == ()


def test_the_programme_opens_first_and_then_shares_the_stops():
    """Hand-held limit 1/64 s: darker than f/2 at 1/64 s all is open; brighter, time and aperture share each stop."""
    assert solve("programme", 1 / 8).settings == Settings(pytest.approx(1 / 32), 2.0, 100)
    edge = 4 / 64  # f/2 at 1/64 s
    for stops in (2, 4, 6):
        found = solve("programme", edge / 2**stops)
        assert found.settings.f_number == pytest.approx(2.0 * 2 ** (stops / 4))
        assert found.settings.time_s == pytest.approx(1 / 64 / 2 ** (stops / 2))
    assert solve("programme", 1e-12).limits == ("narrowest aperture", "shortest time")
    assert solve("programme", 1e6).limits == ("longest time", "widest aperture")


def test_auto_holds_the_time_by_hand_and_raises_the_iso():
    found = solve("auto", 1 / 2, auto=AutoIso())  # 1/8 s at f/2: three stops too long
    assert found.settings == Settings(pytest.approx(1 / 64), 2.0, 800)


def test_dials_stop_at_true_thirds_or_whole_stops():
    for wanted_s in (0.0123, 0.4, 3.0):
        found = solve("aperture_priority", wanted_s, dials=Dials())
        thirds = 3 * math.log2(found.settings.time_s)
        assert thirds == pytest.approx(round(thirds)) and abs(found.deviation_stops) <= 1 / 6 + 1e-9
        whole = solve("aperture_priority", wanted_s, dials=Dials("whole"))
        assert math.log2(whole.settings.time_s) % 1 == pytest.approx(0.0) and abs(whole.deviation_stops) <= 0.5
    aperture = solve("shutter_priority", 1 / 50, time_s=1 / 7, dials=Dials()).settings.f_number
    assert 6 * math.log2(aperture) == pytest.approx(round(6 * math.log2(aperture)))


def test_limits_are_marks_and_the_open_aperture_is_on_every_dial():
    assert solve("aperture_priority", 1e3, dials=Dials()).settings.time_s == 32.0  # marked 30
    assert solve("aperture_priority", 1e-9, dials=Dials()).settings.time_s == 2.0**-13  # marked 1/8000
    assert solve("shutter_priority", 1e-9, time_s=1.0, dials=Dials()).settings.f_number == pytest.approx(2**4.5)  # marked 22
    assert Dials().f_number(1.0, 1.9, []) == 1.9
    assert Dials().f_number(1.94, 1.9, []) == 1.9


def test_darkness_without_end_ends_at_the_limits():
    for mode, settings in (("aperture_priority", {}), ("shutter_priority", {"time_s": 1.0}), ("programme", {}), ("auto", {})):
        for dials in (FREE, Dials()):
            found = solve(mode, math.inf, auto=AutoIso(mains_hz=60.0), dials=dials, **settings)
            assert found.deviation_stops == -math.inf and "highest ISO" in found.limits
            assert found.settings.iso == 1600


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Dials(shortest_s=0.0), "exposure.dials.shortest"),
        (lambda: Dials(longest_s=math.inf), "exposure.dials.shortest"),
        (lambda: Dials(shortest_s=2.0, longest_s=1.0), "exposure.dials.shortest"),
        (lambda: Dials(widest=0.3), "exposure.dials.widest"),
        (lambda: Dials(widest=8.0, narrowest=4.0), "exposure.dials.narrowest"),
        (lambda: AutoIso(highest=0), "exposure.auto_iso.highest"),
        (lambda: AutoIso(longest_s=0.0), "exposure.auto_iso.longest"),
        (lambda: AutoIso(mains_hz=-50.0), "exposure.auto_iso.mains"),
    ],
)
def test_dials_without_sense_are_refused(make, message):
    with pytest.raises(PhotositeError, match=message):
        make()
