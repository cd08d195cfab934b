"""Samples for the tests of data sets: every field set, each a function of its index alone, no device needed."""

import dataclasses
from typing import Any

import numpy as np

from data_gen.samples.sample import Sample
from simulator.sensor.camera.cfa import CfaName

COLOR_MATRIX = ((1.0405, -0.3755, -0.1270), (-0.5461, 1.3787, 0.1793), (-0.1040, 0.2015, 0.6785))  # Nikon D850, LibRaw
ISOS = (100, 400, 1600)


def toy_sample(
    index: int,
    height: int = 24,
    width: int = 32,
    frames: int = 1,
    cfa: CfaName = "RGGB",
    variance: bool = True,
    **changes: Any,
) -> Sample:
    """A ramp with noise; codes below black and at white occur."""
    draw = np.random.Generator(np.random.Philox(key=11, counter=index))
    clean = np.linspace(500.0, 9000.0, height * width, dtype=np.float32).reshape(height, width)
    clean = np.repeat(clean[np.newaxis], frames, axis=0)
    ratios = tuple(float(ratio) for ratio in draw.uniform(1.0, 300.0, frames))
    gain = 0.09563 * ISOS[index % 3] / 100
    mean = 512.0 + (clean - 512.0) / np.array(ratios, np.float32)[:, None, None]
    variance_dn2 = np.maximum(mean - 512.0, 0.0) * np.float32(gain) + np.float32(9.0)
    noisy = np.clip(np.rint(draw.normal(mean, np.sqrt(variance_dn2))), 0, 16383).astype(np.uint16)
    noisy[:, 0, :4] = 0, 1, 511, 16383
    fields = dict(
        index=index,
        mode="single" if frames == 1 else "burst",
        noisy_dn=noisy,
        clean_dn=clean,
        variance_dn2=variance_dn2.astype(np.float32) if variance else None,
        cfa=cfa,
        bit_depth=14,
        black_level_dn=512.0,
        white_level_dn=16383,
        gain_dn_per_e=gain,
        read_noise_dn=3.0,
        white_balance=(2.1, 1.0, 1.57),
        color_matrix=COLOR_MATRIX,
        camera=("sony_a7s2", "nikon_d850")[index % 2],
        iso=ISOS[index % 3],
        exposure_ratios=ratios,
        offsets_px=tuple((0.25 * frame, -0.5 * frame) for frame in range(frames)),
        frame_seeds=tuple(1000 * index + frame for frame in range(frames)),
        body_seed=7,
        source=f"ramp/{index:04d}.png",
        crop=(4 * index, 8),
        augmentation="flip_x",
    )
    return Sample(**(fields | changes))


def same(one: Sample, other: Sample) -> bool:
    """Whether two samples agree in every field and bit."""
    for field in dataclasses.fields(Sample):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
            if a.dtype != b.dtype or not np.array_equal(a, b):
                return False
        elif type(a) is not type(b) or a != b:
            return False
    return True
