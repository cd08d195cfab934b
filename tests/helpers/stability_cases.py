"""Cameras and exposures of every kind for test_stability.py, and the codes that each can give at most and at least."""

import math
from dataclasses import dataclass

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from scipy import stats

from helpers.camera_builders import small_camera
from helpers.scene_builders import band_scene
from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.shot import Shot
from simulator.sensor.camera.camera import IsoSetting
from simulator.sensor.camera.cfa import CfaName
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.registry import STAGES
from simulator.sensor.stages.stage import Stage

WIDTH, HEIGHT = 40, 30
LENS = ThinLens(50.0, 8.0, cos4=False)
TAIL = 1e-12  # probability beyond which a code counts as stray; the long run draws 4e6 numbers
SIGMAS = 7.1  # the normal numbers reach 6.7 (kernels/normal.h)
EXPONENTIAL = 22.3  # the exponentially distributed ones reach 22 (kernels/uniform.h)

QUICK = settings(max_examples=120, deadline=None, derandomize=True, database=None)
FEW = settings(max_examples=40, deadline=None, derandomize=True, database=None)  # of complete cases and bodies
LONG = settings(max_examples=3000, deadline=None, derandomize=True, database=None)


def powers(low: float, high: float) -> st.SearchStrategy[float]:
    """Numbers from 10^low to 10^high, evenly drawn in the exponent."""
    return st.floats(low, high).map(lambda power: 10.0**power)


def or_none(strategy: st.SearchStrategy[float]) -> st.SearchStrategy[float]:
    """Sometimes absent: 0."""
    return st.one_of(st.just(0.0), strategy)


@dataclass(frozen=True)
class Case:
    """A camera, an exposure and a scene whose radiance rises from `radiance` over `decades`."""

    radiance: float
    decades: float
    time_s: float
    iso: int
    gain: float
    bits: int
    black: float
    before_e: float
    after_dn: float
    well_e: float
    dark_e_per_s: float
    noisy: bool

    def shot(self, cfa: CfaName = "MONO", seed: int = 1) -> Shot:
        """The shot of this case; absent stages are those with a number of 0."""
        read_dn = math.hypot(self.before_e * self.gain, self.after_dn)
        stages = {"full_well": (self.well_e,)} if self.well_e else {}
        if self.noisy:
            stages["photon_shot_noise"] = ()
            if self.dark_e_per_s:
                stages["dark_current"] = (self.dark_e_per_s,)
        camera = small_camera(
            WIDTH,
            HEIGHT,
            cfa=cfa,
            bit_depth=self.bits,
            black_level_dn=self.black,
            iso_table={self.iso: IsoSetting(self.gain, read_dn if self.noisy else 0.0)},
            read_noise_after_gain_dn=self.after_dn if self.noisy else 0.0,
            stages={stem: STAGES[stem](*values) for stem, values in stages.items()},
        )
        scene = band_scene(np.sort(self.picture(), axis=1), math.inf)
        return Shot(scene, LENS, Exposure(self.time_s, self.iso), camera, Seeds(frame=seed))

    def picture(self) -> np.ndarray:
        """Plane weights (HEIGHT, WIDTH), rising to the right, the first column without light."""
        row = self.radiance * 10.0 ** np.linspace(0.0, self.decades, WIDTH)
        row[0] = 0.0
        return np.broadcast_to(row, (HEIGHT, WIDTH))


@st.composite
def cases(draw: st.DrawFn, noisy: bool = True, complete: bool = False) -> Case:
    """Draw a case. complete: no number is 0, and dark electrons take the code of their largest range: one kernel serves all."""
    bits = draw(st.integers(8, 16))
    black = draw(st.one_of(st.just(0.0), st.floats(0.0, min(4096.0, 2.0**bits - 2.0), width=32)))
    exponent = draw(st.floats(-12.0, 12.0))
    before, after, well, dark = draw(
        st.sampled_from([(1, 1, 1, 1), *([] if complete else [(0, 0, 0, 0), (1, 0, 1, 0), (0, 1, 0, 0)])])
    )  # present or not
    time_s = draw(powers(-6.0, math.log10(3600.0)))
    dark_e_per_s = draw(powers(0.75, 2.4)) / time_s if complete else dark * draw(powers(-4.0, 5.0))
    return Case(
        radiance=10.0**exponent,
        decades=draw(st.floats(0.0, min(6.0, 12.0 - exponent))),
        time_s=time_s,
        iso=draw(st.integers(25, 4_000_000)),
        gain=draw(powers(-3.0, 3.0)),
        bits=bits,
        black=black,
        before_e=before * draw(powers(-3.0, 3.0)),
        after_dn=after * draw(powers(-3.0, 3.0)),
        well_e=well * draw(powers(0.0, 7.0)),
        dark_e_per_s=dark_e_per_s,
        noisy=noisy,
    )


def count_range(mean: np.ndarray | np.float64) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest count of a Poisson number of this mean, but for less than TAIL (Bernstein's inequality)."""
    nats = math.log(1.0 / TAIL)
    return mean - np.sqrt(2.0 * nats * mean), mean + nats / 3.0 + np.sqrt(nats**2 / 9.0 + 2.0 * nats * mean)


def code_range(case: Case, mean_electrons: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest code that a photosite of this case can have, in float64."""
    mean = mean_electrons.astype(np.float64)
    low, high = count_range(mean)
    dark_low, dark_high = count_range(np.float64(case.dark_e_per_s * case.time_s))
    well = case.well_e or math.inf
    noise = SIGMAS * (case.before_e * case.gain + case.after_dn)
    rounding = 0.5 + 1e-5 * 2**case.bits
    low = case.gain * np.minimum((1 - 1e-5) * low + dark_low, well) + case.black - noise - rounding
    high = case.gain * np.minimum((1 + 1e-5) * high + dark_high, well) + case.black + noise + rounding
    return np.clip(low, 0, 2**case.bits - 1), np.clip(high, 0, 2**case.bits - 1)


@dataclass(frozen=True)
class Body:
    """Numbers of the other stages; every one is present."""

    prnu: float
    dead: float
    hot: tuple[float, float]
    dsnu_e: float
    ratio: float
    spread: float
    traps: tuple[float, float]
    column_dn: float
    row_dn: float
    banding: tuple[float, float]
    tukey_lambda: float
    bias_dn: tuple[float, float, float, float]
    errors_dn: tuple[float, ...]
    digital: float

    def stages(self, case: Case) -> tuple[Stage, ...]:
        """All stages in no order, those of the case among them."""
        make = STAGES
        return (
            make["prnu"](self.prnu),
            make["photon_shot_noise"](),
            make["dead_pixels"](self.dead),
            make["dark_current"](case.dark_e_per_s, case.time_s),
            make["hot_pixels"](*self.hot, case.time_s),
            make["full_well"](case.well_e),
            make["dsnu"](self.dsnu_e),
            make["conversion_gain"](self.ratio),
            make["read_noise_before_gain"](case.before_e, self.spread),
            make["random_telegraph_noise"](*self.traps),
            make["column_offset"](self.column_dn),
            make["row_noise"](self.row_dn),
            make["banding"](*self.banding),
            make["read_noise_after_gain"](case.after_dn, self.tukey_lambda),
            make["color_bias"](self.bias_dn),
            make["nonlinearity"](self.errors_dn, 2.0**case.bits - 1 - case.black),
            make["digital_gain"](self.digital, case.black),
        )

    def code_range(self, case: Case, mean: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Least and greatest code, by intervals through the chain in float64; EXPONENTIAL is the end of such numbers."""
        low, high = (count_range(mean * max(0.0, 1 + side * SIGMAS * self.prnu))[end] for end, side in enumerate((-1, 1)))
        dark = count_range(np.float64(case.dark_e_per_s * case.time_s))
        low = 0.0 * low + np.maximum(dark[0], 0.0)  # a dead photosite
        high = (1 + 1e-5) * (high + dark[1] + count_range(np.float64(EXPONENTIAL * self.hot[1] * case.time_s))[1])
        read_e = case.before_e * math.exp(self.spread * (SIGMAS - self.spread)) * SIGMAS
        around_e = SIGMAS * self.dsnu_e * self.ratio + read_e + EXPONENTIAL * self.traps[1]
        tail = stats.tukeylambda.isf(stats.norm.sf(SIGMAS), self.tukey_lambda) / stats.tukeylambda.std(self.tukey_lambda)
        around_dn = SIGMAS * (self.column_dn + self.row_dn) + self.banding[0] + 1.02 * tail * case.after_dn
        around_dn += max(map(abs, self.bias_dn)) + max(map(abs, self.errors_dn)) + 0.5 + 1e-5 * 2**case.bits
        ends = []
        for electrons, side in ((low, -1.0), (high, 1.0)):
            level = case.gain * (self.ratio * np.minimum(electrons, case.well_e) + side * around_e) + side * around_dn
            code = np.clip(level + case.black, 0.0, 2**case.bits - 1)
            ends.append(np.clip(case.black + self.digital * (code - case.black) + side, 0.0, 2**case.bits - 1))
        return ends[0], ends[1]


def bodies(complete: bool = False) -> st.SearchStrategy[Body]:
    """Draw the numbers of the other stages. complete: each has an effect, so that one kernel serves all bodies."""
    often = (lambda strategy: strategy) if complete else or_none
    least, dn = (1e-3 if complete else 0.0), often(powers(-2.0, 2.0))
    shapes = [-0.3, -0.044, 0.14, 0.25, *([] if complete else [0.0])]

    def factors(low: float, high: float) -> st.SearchStrategy[float]:
        return powers(low, high).filter(lambda factor: factor != 1.0 or not complete)

    def numbers(count: int, most: float) -> st.SearchStrategy[tuple[float, ...]]:
        return st.tuples(*[st.floats(-most, most)] * count).filter(lambda drawn: any(drawn) or not complete)

    return st.builds(
        Body,
        st.floats(least, 0.2),
        st.floats(least, 1.0),
        st.tuples(st.floats(least, 1.0), often(powers(-3.0, 8.0))),
        often(powers(-2.0, 3.0)),
        factors(0.0, 3.0),
        st.sampled_from([0.01, 0.2, 1.0]),
        st.tuples(st.floats(least, 1.0), often(powers(-2.0, 4.0))),
        dn,
        dn,
        st.tuples(dn, powers(math.log10(2.0), 5.0)),
        st.sampled_from(shapes),
        numbers(4, 10.0),
        numbers(4, 100.0),  # as many as in `every_effect`, which shares the build
        factors(-2.0, 3.0),
    )
