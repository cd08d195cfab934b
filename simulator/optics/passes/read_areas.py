"""Photosites whose light is read for the image of a window: the scene is needed where they see it, and nowhere else."""

from simulator.optics.geometry.projection import Projection
from simulator.optics.optics_plan import OpticsPlan
from simulator.optics.passes.psf_bands import read_by_bands
from simulator.optics.passes.tile_plan import TilePlan
from simulator.sensor.camera.camera_sections import Window


def read_areas(optics: OpticsPlan, tiles: TilePlan | None) -> list[tuple[Projection, Window]]:
    """Return windows of the sensor, with the projection of the scene onto their photosites.

    tiles: methods of the blur's tiles; None: none are chosen.
    """
    areas = [] if tiles is None else tiles.areas()
    window, psf = optics.blur_window(), optics.psf
    if tiles is None and optics.defocus is not None and (psf is None or not psf.by_distance):  # rays
        window = _grown(window, optics.defocus.reach_px)
        areas += [(optics.projection, seen) for seen in optics.defocus.seen_aside(window)]
    elif psf is not None and psf.core is not None:
        window = read_by_bands(optics.window, psf.gather_reach_px, psf.over)
    elif psf is not None:
        from simulator.optics.psf.tiled_convolution import bound_tiles, split_into_tiles  # brings SciPy's transforms

        width, height = psf.sensor_px
        window = bound_tiles(split_into_tiles(psf.x_px, psf.y_px, (height, width)), psf.reach_px, optics.window)
        if psf.corrected_px:
            areas.append((optics.projection, read_by_bands(optics.window, psf.gather_reach_px, psf.over)))
    if psf is not None:
        window = _grown(window, psf.sample_reach_px)
    return [*areas, (optics.projection, window)]


def _grown(window: Window, margin_px: int) -> Window:
    return Window(window.x - margin_px, window.y - margin_px, window.width + 2 * margin_px, window.height + 2 * margin_px)
