"""A small U-Net learns to denoise from generated pairs, from the published noise model itself, and from plain Gaussian noise.

    python examples/denoiser.py [--out build/denoiser] [--steps 1400] [--seeds 3]

All networks see the same clean patches in the same order and begin with the same weights. They are tested on other scenes under
the published model in NumPy (published_noise.py). Writes denoiser.json, curve.png and pictures.png. Needs PyTorch, matplotlib
and scikit-image: the extras `torch`, `report` and `demo`.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress

from simulator.atomic_files import atomic_write
from simulator.device import Device, open_device
from simulator.errors import PhotositeError

BATCH, HELD_OUT_PAIRS, WATCHED = 8, 48, 12
THREADS = 1  # two that wait for each other on busy cores take ten times as long


def run(out: Path, steps: int, seeds: int, device: Device, progress: Progress) -> dict:
    """Train all arms once for each seed. Returns curves and PSNR on the pairs held out, in plain data, by noise and seed.

    Raises PhotositeError when PyTorch or scikit-image is missing.
    """
    try:
        import torch
    except ImportError:
        raise PhotositeError("PyTorch is missing; pip install 'photosite[torch,report,demo]'") from None
    from denoiser_figures import write_pictures
    from denoiser_pairs import HELD_OUT, PUBLISHED, TRAINED_ON, batches, held_out_pairs, held_out_set, photographs, training_set
    from denoiser_training import denoised, psnr_db, trained

    torch.set_num_threads(THREADS)
    there = {name: photographs(files, out / name) for name, files in (("seen", TRAINED_ON), ("held_out", HELD_OUT))}
    test = held_out_pairs(held_out_set(there["held_out"]), device, HELD_OUT_PAIRS)
    noisy = test.noisy[PUBLISHED]
    found = {
        "steps": steps,
        "watched": WATCHED,
        "noisy": psnr_db(noisy, test.clean).tolist(),
        "isos": test.isos.tolist(),
        "runs": [],
    }
    task = progress.add_task("training", total=steps * seeds)
    for seed in range(1, seeds + 1):
        pairs = batches(training_set(seed, there["seen"]), device, BATCH)
        arms = trained(pairs, steps, seed, test.first(WATCHED), lambda: progress.advance(task))
        pictures = {arm.noise: denoised(arm.network, noisy) for arm in arms}
        for arm in arms:
            psnr = psnr_db(pictures[arm.noise], test.clean).tolist()
            found["runs"].append({"noise": arm.noise, "seed": seed, "curve": arm.curve, "psnr_db": psnr})
        write_numbers(out, found)
        if seed == 1:
            write_pictures(out / "pictures.png", test, pictures)
    return found


def write_numbers(out: Path, found: dict) -> None:
    """Write denoiser.json."""
    with atomic_write(out / "denoiser.json") as beside:
        beside.write_text(json.dumps(found) + "\n", encoding="utf-8")


def table(found: dict) -> dict[str, tuple[float, float]]:
    """Mean PSNR over the pairs held out and seeds, and its standard deviation over seeds, by the noise that was learned."""
    by_noise: dict[str, list[float]] = {}
    for one in found["runs"]:
        by_noise.setdefault(one["noise"], []).append(float(np.mean(one["psnr_db"])))
    return {name: (float(np.mean(values)), float(np.std(values, ddof=len(values) > 1))) for name, values in by_noise.items()}


def differences(found: dict, first: str, second: str) -> np.ndarray:
    """PSNR of one arm less that of another, mean over the pairs held out, for each seed [dB]."""
    mean = {(one["noise"], one["seed"]): np.mean(one["psnr_db"]) for one in found["runs"]}
    return np.array([mean[first, seed] - mean[second, seed] for name, seed in mean if name == first])


def main() -> int:
    """Run the example; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/denoiser"), help="folder for numbers and pictures")
    parser.add_argument("--steps", type=int, default=1400, help="of each training")
    parser.add_argument("--seeds", type=int, default=3, help="trainings of each network")
    options = parser.parse_args()
    began = time.monotonic()
    try:
        with Progress(console=Console(stderr=True)) as progress:
            found = run(options.out, options.steps, options.seeds, open_device(), progress)
        from denoiser_figures import write_curve

        write_curve(options.out / "curve.png", found)
        found["seconds"] = time.monotonic() - began
        write_numbers(options.out, found)
    except PhotositeError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(f"noisy: {np.mean(found['noisy']):.2f} dB")
    for name, (mean, spread) in table(found).items():
        print(f"learned from {name}: {mean:.2f} dB, {spread:.2f} over seeds")
    first, *others = table(found)
    for second in others:
        print(f"{first} less {second}: " + ", ".join(f"{value:+.3f}" for value in differences(found, first, second)) + " dB")
    print(f"{found['seconds']:.0f} s; look at {options.out / 'curve.png'} and {options.out / 'pictures.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
