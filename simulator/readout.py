"""Executes the fused sensor kernel, tile by tile in the variant that each tile needs."""

import numpy as np

from simulator import tiles
from simulator.device import Device
from simulator.fused import POISSON_SWITCH_E, SMALL_MEANS_E, PoissonMeans, sensor_defines
from simulator.planner import Plan


def sense(planned: Plan, device: Device, mosaic, codes, frame_seed: int) -> None:
    """Enqueue the fused kernel, for each tile the variant that can count the electrons expected there.

    Which variant a tile gets changes its speed, never its codes.
    """
    frame = planned.frame
    defines, parameters = sensor_defines(planned.stages)
    columns, rows = tiles.edges(frame.width, device.row_px), tiles.edges(frame.height, tiles.TILE_HEIGHT)
    means = _poisson_means(planned, device, mosaic, columns, rows)
    buffer = device.upload(parameters)
    for variant in PoissonMeans:
        for (width, height), corners in tiles.group_by_shape(columns, rows, means == variant).items():
            device.run(
                device.kernel("sensor", {**defines, "POISSON_MEANS": int(variant)}),
                (width, height, len(corners)),
                (width, 1, 1),
                electron_radiance=mosaic,
                raw=codes,
                tiles=device.upload(corners),
                parameters=buffer,
                width=frame.width,
                window_x=frame.x,
                window_y=frame.y,
                frame_seed=frame_seed,
            )


def _poisson_means(planned: Plan, device: Device, mosaic, columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Variant of kernels/poisson.h for each tile: (tile rows, tile columns) of PoissonMeans."""
    shape = (len(rows) - 1, len(columns) - 1)
    if planned.stage("photon_shot_noise") is None and planned.stage("dark_current") is None:
        return np.full(shape, PoissonMeans.LARGE)
    if planned.stage("dark_current") is not None:
        return np.full(shape, PoissonMeans.ALL)
    range_shape = (2, shape[0], planned.frame.width)
    extremes = device.empty(range_shape, np.float32)
    edges = device.upload(rows.astype(np.uint32))
    kernel = device.kernel("tile_range", {"TILE_HEIGHT": tiles.TILE_HEIGHT})
    device.run(kernel, range_shape[:0:-1], None, image=mosaic, range=extremes, edges=edges)
    least, greatest = device.download(extremes, range_shape, np.float32)
    darkest, brightest = planned.electrons_per_radiance()
    least_e = np.minimum.reduceat(least, columns[:-1], axis=1) * darkest
    greatest_e = np.maximum.reduceat(greatest, columns[:-1], axis=1) * brightest
    means = np.where(least_e >= POISSON_SWITCH_E, PoissonMeans.LARGE, PoissonMeans.ALL)
    for limit_e, variant in zip(SMALL_MEANS_E, list(PoissonMeans)[2:], strict=True):
        means[greatest_e < limit_e] = variant
    return means
