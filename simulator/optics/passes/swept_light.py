"""Executes motion before a blur that is the same at each instant: the light is swept once, and then blurred once."""

from dataclasses import replace

import numpy as np

from simulator.device import Buffer, Device
from simulator.optics.geometry.posed_projection import posed
from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.read_areas import read_areas
from simulator.optics.passes.swept_mosaic import swept_planes
from simulator.optics.passes.swept_vectors import swept_vectors
from simulator.optics.passes.tile_plan import TilePlan, plan_tiles
from simulator.optics.pupil.pupil import UPRIGHT
from simulator.sensor.camera.camera_sections import Window


def sweep_light(optics: OpticsPlan, device: Device, planes: list[Buffer]) -> tuple[OpticsPlan, TilePlan | None, list[Buffer]]:
    """Sweep a scene that moves before a fixed blur; return what `still_mosaic` needs for the blur of the light.

    That is the plan of a picture at rest, the methods of its tiles, and its only plane. planes: for each layer a device buffer,
    as for `swept_mosaic`.
    """
    assert optics.motion is not None  # without it nothing is swept
    assert optics.motion.blur is not None
    window, over = light_window(optics, device), optics.motion.blur.samples_per_axis
    still, moving = _on_samples(optics, window, over), optics
    if optics.motion.blur.followed is not None:
        moving = replace(optics, motion=replace(optics.motion, path=optics.motion.path.going_on()))
    return still, plan_tiles(still, device), [_sweep(moving, device, planes, window, over)]


def light_window(optics: OpticsPlan, device: Device) -> Window:
    """Return the photosites, also beyond the sensor, whose light the blur of the window gathers."""
    still = _at_rest(optics)
    seen = [window for _, window in read_areas(still, plan_tiles(still, device))]
    x, y = min(window.x for window in seen), min(window.y for window in seen)
    right, bottom = max(one.x + one.width for one in seen), max(one.y + one.height for one in seen)
    return Window(x, y, right - x, bottom - y)


def _sweep(optics: OpticsPlan, device: Device, planes: list[Buffer], window: Window, over: int) -> Buffer:
    """Device buffer (channels, rows, columns) float32: the swept light of a window's samples in all colours."""
    motion = optics.motion
    assert motion is not None  # as of sweep_light
    if motion.vectors is None:
        return swept_planes(optics, device, planes, window, over)
    there, shape = replace(optics, window=window), (window.height, window.width)
    found = device.empty((optics.channels, *shape), np.float32)
    for channel in range(optics.channels):
        light = swept_vectors(there.in_one_color(channel), motion, motion.vectors, device, planes[0])
        device.write(found, device.download(light, shape, np.float32), 4 * channel * window.height * window.width)
    return found


def _at_rest(optics: OpticsPlan) -> OpticsPlan:
    """Return the plan of one opaque picture at rest, with the samples and the spots that what moves needs."""
    assert optics.motion is not None and optics.motion.blur is not None  # else nothing is swept before a blur
    skew, moved = optics.motion.blur.spot_skew, optics.with_moved_pixels()
    defocus, psf = moved.defocus, optics.psf
    if defocus is not None:
        defocus = defocus.with_skew(skew)
    if psf is not None and skew != UPRIGHT:
        psf = replace(psf, skew=skew)
    scene = optics.scene
    if optics.has_coverage or len(scene.layers) > 1:
        scene = replace(scene, coverage=None, behind=(), deep=None)
    return replace(moved, scene=scene, defocus=defocus, psf=psf, motion=None, flash_motion=None)


def _on_samples(optics: OpticsPlan, window: Window, over: int) -> OpticsPlan:
    """Return the plan of a picture at rest whose pixels are the samples of the photosites of a window."""
    projection = Projection(
        scale=float(over),
        offset_x=float(-over * window.x),
        offset_y=float(-over * window.y),
        scene_width=over * window.width,
        scene_height=over * window.height,
        samples=over,
        nearest=False,
        open_side=optics.projection.open_side,
        edge_px=optics.projection.edge_px,
    )
    moved = None
    if optics.defocus is not None and optics.defocus.maps and optics.motion is not None:
        moved = posed(optics.projection, optics.motion, optics.motion.middle_homography())
    return replace(_at_rest(optics), projection=projection, moved_radii=moved)
