"""Throughput of the fused sensor kernel beside the same chain in NumPy, from one run.

The chain: Poisson shot noise, full well, Gaussian read noise before and after the gain, gain, black level, rint,
clip, cast to uint16. NumPy draws with Generator.poisson and standard_normal(float32), both single-threaded, as
they are. Times are the best of several, without building kernels; the picture is on the device already.

    python benchmarks/sensor.py [--megapixels 12] [--out build/benchmark_sensor.json]
"""

import argparse
import dataclasses
import json
import math
import platform
import time
from functools import partial
from pathlib import Path

import numpy as np

from simulator.config import load_shot
from simulator.device import devices, open_device
from simulator.fused import stage_order
from simulator.planner import plan
from simulator.readout import sense
from simulator.sensor.camera import Window

SHOT = Path(__file__).parent.parent / "configs" / "shots" / "flat_field.yaml"
FRAMES = {  # mean electrons: log-uniform between these per photosite, in smooth ramps as pictures have them
    "daylight (50 to 50,000 e-)": (50.0, 5e4),
    "dusk (1 to 1,000 e-)": (1.0, 1e3),
    "night (0.1 to 30 e-)": (0.1, 30.0),
}
REPEATS = 5


def ramp(width: int, height: int, low: float, high: float) -> np.ndarray:
    """Mean electrons rising in log steps from left to right: (height, width) float32."""
    row = np.exp(np.linspace(math.log(low), math.log(high), width))
    return np.broadcast_to(row, (height, width)).astype(np.float32)


def numpy_chain(mean_e: np.ndarray, stages: dict, rng: np.random.Generator) -> np.ndarray:
    """The same chain as a NumPy user writes it."""
    electrons = rng.poisson(mean_e).astype(np.float32)
    np.minimum(electrons, np.float32(stages["full_well"].capacity_e), out=electrons)
    electrons += np.float32(stages["read_noise_before_gain"].sigma_e) * rng.standard_normal(mean_e.shape, dtype=np.float32)
    electrons *= np.float32(stages["analog_gain"].gain_dn_per_e)
    electrons += np.float32(stages["read_noise_after_gain"].sigma_dn) * rng.standard_normal(mean_e.shape, dtype=np.float32)
    electrons += np.float32(stages["adc"].black_level_dn)
    np.rint(electrons, out=electrons)
    np.clip(electrons, 0, stages["adc"].max_code, out=electrons)
    return electrons.astype(np.uint16)


def expose(planned, device, mosaic, codes) -> None:
    """One frame through the fused kernel."""
    sense(planned, device, mosaic, codes, frame_seed=1)
    device.finish()


def best_time(work) -> float:
    """Least of several timings [s]; the first one warms up."""
    times = []
    for _ in range(REPEATS + 1):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return min(times[1:])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--megapixels", type=float, default=12.0)
    parser.add_argument("--out", type=Path, default=Path("build/benchmark_sensor.json"))
    options = parser.parse_args()
    shot = load_shot(SHOT)
    height = int(math.sqrt(options.megapixels * 1e6 * 3 / 4)) // 4 * 4
    width = height * 4 // 3
    camera = dataclasses.replace(shot.camera, width_px=width, height_px=height, window=Window(0, 0, width, height))
    planned = plan(dataclasses.replace(shot, camera=camera))
    stages = {stage.stem: stage for stage in planned.stages}
    unit = {
        **stages,
        "irradiance": type(stages["irradiance"])(1.0, 0.0, 0.0, 0.0),
        "exposure": type(stages["exposure"])(1.0, 1.0),
    }
    planned = dataclasses.replace(planned, stages=tuple(unit[stem] for stem in stage_order() if stem in unit))
    rng = np.random.default_rng(1)
    megapixels = width * height / 1e6
    rows = []
    for name, (low, high) in FRAMES.items():
        mean_e = ramp(width, height, low, high)
        numpy_rate = megapixels / best_time(partial(numpy_chain, mean_e, stages, rng))
        for info in devices():
            device = open_device(info.label)
            mosaic, codes = device.upload(mean_e), device.empty(mean_e.shape, np.uint16)
            rate = megapixels / best_time(partial(expose, planned, device, mosaic, codes))
            rows.append(
                {
                    "frame": name,
                    "device": info.label,
                    "mpixel_per_s": rate,
                    "numpy_mpixel_per_s": numpy_rate,
                    "ratio": rate / numpy_rate,
                }
            )
    print(f"{width} x {height} photosites; Mpixel/s, best of {REPEATS}")
    print(f"{'frame':28}{'device':66}{'fused':>8}{'NumPy':>8}{'ratio':>8}")
    for row in rows:
        print(
            f"{row['frame']:28}{row['device'][:64]:66}{row['mpixel_per_s']:8.0f}{row['numpy_mpixel_per_s']:8.1f}{row['ratio']:8.1f}"
        )
    options.out.parent.mkdir(parents=True, exist_ok=True)
    options.out.write_text(
        json.dumps(
            {
                "machine": platform.processor() or platform.machine(),
                "numpy": np.__version__,
                "width": width,
                "height": height,
                "rows": rows,
            },
            indent=1,
        )
    )
    print(f"wrote {options.out}")


if __name__ == "__main__":
    main()
