"""From a shot to a raw frame: executes a plan on an OpenCL device."""

import platform
from collections.abc import Callable
from dataclasses import asdict, replace
from importlib.metadata import PackageNotFoundError, version

import numpy as np

from simulator import __version__
from simulator.blur import blurred_mosaic
from simulator.device import Device, open_device
from simulator.errors import PhotositeError
from simulator.frame import Raw
from simulator.input_files import fingerprints
from simulator.noise_free import mean_charge, noise_free
from simulator.planner import Plan, plan, projection_arguments, projection_defines
from simulator.progress import Progress
from simulator.readout import averaged, covered, mixed, read_out, shared_charge, veiled
from simulator.scene import Layer
from simulator.sensing import FrameSetting
from simulator.sensitivity import baseline_exposure_ev
from simulator.shot import Shot
from simulator.truth_maps import blur_map, depth_map, variance_map


def simulate(shot: Shot, *, device: str | None = None, progress: Progress | None = None) -> Raw:
    """Take a photograph.

    device: part of an OpenCL device's label; default: $PHOTOSITE_DEVICE, else the newest PoCL.
    progress: called with (what is done now, share done from 0 to 1).
    Raises PhotositeError for anything the user can put right.
    """
    tell = progress or (lambda stage, share: None)
    tell("scene", 0.0)
    planned = plan(shot)
    opened = open_device(device)
    check_memory(planned, opened, shot.truth)
    tell("light", 0.1)
    mosaic = expose_mosaic(planned, opened, lambda share: tell("light", 0.1 + 0.7 * share))
    tell("sensor", 0.8)
    dn = read_out(planned, opened, mosaic, shot.seeds)
    tell("truth", 0.9)
    mean_electrons, noise_free_dn = truth(planned, opened, mosaic)
    parts = truth_parts(shot, planned, opened, mean_electrons)
    tell("done", 1.0)
    return _raw(shot, planned, opened, dn, mean_electrons, noise_free_dn, parts)


def check_memory(planned: Plan, device: Device, parts: tuple[str, ...] = ()) -> None:
    """Raise PhotositeError for a frame that does not fit into the device's memory; parts: of the truth, as `Shot.truth`."""
    needed, there, frame = planned.memory_bytes(parts), device.info.memory_bytes, planned.frame
    if needed > there:
        raise PhotositeError(
            f"out of memory: {frame.width} x {frame.height} photosites need about {needed / 1e9:.1f} GB, "
            f"but {device.info.label} has {there / 1e9:.1f} GB; read out a part of the sensor with camera.window"
        )


def expose_mosaic(planned: Plan, device: Device, progress: Callable[[float], None] = lambda share: None):
    """Device buffer (height, width) float32: electron radiance through the lens in each photosite's colour."""
    scene, frame = planned.scene, planned.frame
    if planned.spread is not None:
        from simulator.spreading import spread_mosaic  # brings SciPy's transforms

        planes = [_layer_planes(planned, device, layer) for layer in scene.layers]
        mosaic = spread_mosaic(planned, device, planes, progress)
    elif planned.defocus is not None:
        mosaic = blurred_mosaic(planned, device, [_layer_planes(planned, device, layer) for layer in scene.layers], progress)
    else:
        mosaic = device.empty((frame.height, frame.width), np.float32)
        kernel = device.kernel("projection_mosaic", projection_defines(planned), file="projection.cl")
        planes, arguments = _layer_planes(planned, device, scene.layers[0]), projection_arguments(planned, frame.x, frame.y)
        device.run(kernel, (frame.width, frame.height), None, planes=planes, mosaic=mosaic, **arguments)
    mosaic = veiled(planned, device, mosaic)
    return covered(planned, device, mixed(planned, device, mosaic, planned.layout.crosstalk.optical_shares))


def _layer_planes(planned: Plan, device: Device, layer: Layer):
    """Device buffer (channels, scene height, scene width) float32 of a layer's electron radiance [e- s^-1 um^-2 sr^-1].

    With a plane more, the layer's coverage, where any layer of the scene has one.
    """
    height, width, bands = layer.planes.shape
    channels, pixels = planned.camera.channels, height * width
    coverage = any(one.coverage is not None for one in planned.scene.layers)
    planes, scene = device.empty((channels + coverage, pixels), np.float32), np.ascontiguousarray(layer.planes, np.float32)
    device.run(
        device.kernel("camera_planes", {"BANDS": bands, "CHANNELS": channels}),
        (pixels, channels),
        None,
        scene=device.share(scene),
        weights=device.upload(planned.weights),
        planes=planes,
    )
    if coverage and layer.coverage is None:
        device.fill(planes, np.float32(1.0), 4 * channels * pixels)
    elif coverage:
        device.write(planes, layer.coverage.astype(np.float32, copy=False).reshape(-1), 4 * channels * pixels)
    device.finish()  # `scene` may be gone afterwards
    return planes


def truth(planned: Plan, device: Device, mosaic) -> tuple[np.ndarray, np.ndarray]:
    """Mean electrons [e-] and noise-free codes [DN] of the photosites that are given out, float32 each."""
    frame, read = planned.frame, planned.layout.read
    settings = [FrameSetting(planned.stages, x=frame.x, y=frame.y)]
    buffers = mean_charge(device, mosaic, (frame.height, frame.width), settings)
    mean_electrons, signal = (shared_charge(planned, device, buffer) for buffer in buffers)
    noise_free(device, signal, (read.height, read.width), settings)
    return tuple(averaged(planned, device, buffer)[planned.layout.kept] for buffer in (mean_electrons, signal))


def truth_parts(shot: Shot, planned: Plan, device: Device, mean_electrons: np.ndarray) -> dict[str, np.ndarray]:
    """Return the parts of the truth that the shot asks for, by name; see `Raw.truth`."""
    wanted, parts = set(shot.truth), {}
    if "variance" in wanted:
        parts["variance"] = variance_map(planned, mean_electrons)
    if wanted & {"depth", "blur"}:
        depth_m = depth_map(planned)
        if "depth" in wanted:
            parts["depth"] = depth_m
        if "blur" in wanted:
            parts["blur"] = blur_map(planned, shot.lens, depth_m)
    if "rgb" in wanted:
        parts["rgb"] = clean_rgb(planned, device)
    return parts


def clean_rgb(planned: Plan, device: Device) -> np.ndarray:
    """Signal without noise in every colour at every pixel: (height, width, channels) float32, 0 at black, 1 at white.

    Camera colours, linear, not white-balanced: what a demosaicing without error would find. A channel is the noise-free
    code of a sensor that has this channel's filter on all photosites. In a pixel's own colour it is (noise-free code -
    black) / (white - black), unless crosstalk mixes colours.
    """
    black_dn = np.float32(planned.stage("adc").black_level_dn)
    span_dn = np.float32(planned.white_level_dn() - planned.stage("adc").black_level_dn)
    planes = []
    for channel in range(planned.camera.channels):
        one = replace(planned, only_colour=channel)
        _, noise_free_dn = truth(one, device, expose_mosaic(one, device))
        planes.append((noise_free_dn - black_dn) / span_dn)
    return np.stack(planes, axis=-1)


def _raw(shot: Shot, planned: Plan, device: Device, dn, mean_electrons, noise_free_dn, parts) -> Raw:
    camera, lens = shot.camera, shot.lens
    matrix, neutral = planned.color_metadata()
    return Raw(
        dn=dn,
        mean_electrons=mean_electrons,
        noise_free_dn=noise_free_dn,
        cfa=camera.frame_cfa(),
        bit_depth=camera.bit_depth,
        black_level_dn=planned.stage("adc").black_level_dn,
        white_level_dn=planned.white_level_dn(),
        noise_profile=(planned.noise_profile(),) * camera.channels,
        color_matrix=matrix,
        **planned.color_matrices(),
        as_shot_neutral=neutral,
        make=camera.make,
        model=camera.model,
        lens_model=lens.model,
        exposure_time_s=shot.exposure.time_s,
        f_number=lens.f_number,
        focal_length_mm=lens.focal_length_mm,
        focal_length_35mm_mm=lens.focal_length_35mm_mm(float(np.hypot(*camera.sensor_mm))),
        focus_distance_m=lens.focus_distance_m,
        iso=shot.exposure.iso,
        baseline_exposure_ev=baseline_exposure_ev(planned, shot.exposure.iso),
        name=shot.name,
        black_offsets_dn=planned.black_offsets_dn() if shot.raw.black_per_place else (0.0,) * 4,
        format=shot.raw,
        date_time=shot.exposure.date_time,
        active_area=planned.layout.active_area,
        warp_rectilinear=planned.warp_rectilinear(),
        truth=parts,
        resolved={
            "shot": shot.resolved,
            "inputs": fingerprints(shot.scene, shot.lens),
            "seeds": asdict(shot.seeds),
            "plan": [asdict(step) for step in planned.steps],
            "notes": list(planned.scene.notes),
            "device": asdict(device.info),
            "versions": _versions(),
        },
    )


def _versions() -> dict[str, str]:
    found = {"photosite": __version__, "python": platform.python_version()}
    for package in ("numpy", "pyopencl"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
