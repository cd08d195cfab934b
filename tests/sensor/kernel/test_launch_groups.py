"""Frames share a build of a kernel where they have the same of the stages that it runs."""

import numpy as np
import pytest

from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, form_launch_groups, join_rare_variants
from simulator.sensor.kernel.noise_free import STAGES
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.photon_shot_noise import PhotonShotNoise
from simulator.sensor.stages.poisson_variants import PoissonVariant
from simulator.sensor.stages.prnu import Prnu

PLAIN = (AnalogGain(2.0), Adc(12, 64.0))


@pytest.mark.parametrize(
    ("stems", "numbers"),
    [
        (KernelPart.WHOLE.stems, [3, 4, 4, 4]),
        (KernelPart.CHARGE.stems, [0, 1, 1]),
        (KernelPart.READOUT.stems, [3, 4]),
        (STAGES, [3, 4]),
    ],
)
def test_stages_that_a_kernel_does_not_run_need_no_build(stems, numbers):
    """A plain frame, one with PRNU, one with a full well, one with column offsets; gain, black and white level are numbers."""
    settings = [FrameSetting((*PLAIN, *more)) for more in ((), (Prnu(0.01),), (FullWell(1000.0),), (ColumnOffset(1.0),))]
    groups = list(form_launch_groups(settings, stems, 2**16))
    assert sorted(group.numbers.shape[1] for group in groups) == numbers
    assert sorted(place for group in groups for place in group.places) == [0, 1, 2, 3]


@pytest.fixture
def builds(bench, monkeypatch):
    """Files and macros of the kernels that are asked for."""
    asked, kernel = [], bench.device.kernel

    def ask(name, defines, file=None):
        asked.append((name, tuple(sorted(map(str, defines.items())))))
        return kernel(name, defines, file)

    monkeypatch.setattr(bench.device, "kernel", ask)
    return asked


def test_a_frame_that_begins_or_ends_within_a_pair_of_rows_takes_the_build_of_any(bench, builds):
    light = np.geomspace(0.1, 1e4, 70 * 97).reshape(70, 97)
    whole = bench.sensor(light, PhotonShotNoise(), Prnu(0.01))
    one = set(builds)
    for first, last in ((1, 70), (0, 69), (3, 4), (4, 5), (1, 64)):
        assert np.array_equal(bench.sensor(light[first:last], PhotonShotNoise(), Prnu(0.01), y=first), whole[first:last])
    assert set(builds) == one


def test_a_small_frame_takes_one_build_whatever_its_light(bench, builds):
    light = np.geomspace(0.1, 1e4, 512 * 512).reshape(512, 512)
    whole = bench.sensor(light, PhotonShotNoise())
    large = len(set(builds))
    builds.clear()
    for first in (0, 128, 256, 384):
        part = bench.sensor(light[first : first + 64], PhotonShotNoise(), y=first)
        assert np.array_equal(part, whole[first : first + 64])
    assert len(set(builds)) == 1 < large


LARGE, ALL, SMALL, BRIGHT = PoissonVariant.LARGE, PoissonVariant.ALL, PoissonVariant.SMALL, PoissonVariant.BRIGHT


@pytest.mark.parametrize(
    ("photosites", "joined"),
    [
        ({BRIGHT: 10}, set()),
        ({BRIGHT: 2**15, SMALL: 1}, set()),
        ({BRIGHT: 2**15 - 1, SMALL: 1}, {BRIGHT, SMALL}),
        ({BRIGHT: 2**20, SMALL: 1}, set()),
        ({BRIGHT: 2**20, SMALL: 1, ALL: 1}, {SMALL}),
        ({BRIGHT: 2**20, SMALL: 2**14, LARGE: 2**14}, {SMALL, LARGE}),
        ({BRIGHT: 2**15, SMALL: 2**14, LARGE: 2**14}, {BRIGHT, SMALL, LARGE}),
        ({BRIGHT: 2**15, SMALL: 2**14, LARGE: 2**14, ALL: 2**20}, {BRIGHT, SMALL, LARGE}),
        ({BRIGHT: 2**15 + 1, ALL: 1}, set()),
    ],
)
def test_variants_are_joined_where_the_saved_launches_take_longer(photosites, joined):
    variants = np.array([list(photosites)] * 2)
    sizes = np.array([list(photosites.values()), [0] * len(photosites)])
    found = join_rare_variants(variants, sizes)
    assert [set(np.unique(found[variants == one])) for one in photosites] == [
        {ALL if one in joined else one} for one in photosites
    ]


def test_rare_variants_take_the_build_of_all_means_and_have_the_same_codes(bench, builds):
    light = np.geomspace(0.1, 1e4, 256 * 256).reshape(256, 256)
    whole = bench.sensor(light, PhotonShotNoise())
    assert sum(name == "sensor" for name, _ in set(builds)) == 1
    for first in (0, 64, 128, 192):  # uniform light, in frames of the size of which the code is chosen for its means
        tall = np.concatenate([light[first : first + 64]] * 4)
        assert np.array_equal(bench.sensor(tall, PhotonShotNoise(), y=first)[:64], whole[first : first + 64])
    assert sum(name == "sensor" for name, _ in set(builds)) > 1
