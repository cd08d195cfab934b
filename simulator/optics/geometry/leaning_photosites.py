"""Error of photosites whose sides lean in the scene, which are averaged in upright parts."""

from simulator.optics.geometry.projection import UPRIGHT_PARTS, Projection

OF_TILT = 0.45  # of the differences between even squares and the lean of a photosite in one part, in 99.9 % of the photosites
OF_SMOOTH_TILT = 1.0 / 8.0  # the same of light that is linear between pixels as large as photosites
LEAN_PX = 0.42  # radius of a blur circle from which on it hides that photosites lean over even squares


def upright_parts(projection: Projection) -> int:
    """Upright parts per axis in which photosites behind a distortion are blurred, or those of bilinear light are averaged."""
    return UPRIGHT_PARTS if projection.has_squares else projection.samples


def lean_error(projection: Projection, width_px: int, height_px: int, parts: int, radius_px: float, detail: float) -> float:
    """Error of photosites that lean behind a distortion, in `parts` x `parts` upright parts, as a share of the brightest light.

    Of even squares it is OF_TILT t / n^2 of their differences: an upright part moves a triangle of t / 8 of its side over an
    edge along that side. Of light that is linear between pixels as large as photosites it is OF_SMOOTH_TILT t / n^2: the mean
    product of x and y of a parallelogram, which its parts lack. Circles hide it as R^1.5, from LEAN_PX photosites on, or from
    a pixel. Random black and white pixels leave 0.4 to 0.95 of it, in 99.9 % of the photosites.
    width_px, height_px: of the sensor [photosites]. radius_px: of the smallest blur circle [photosites]. detail: difference
    between pixels, of `scene_detail`.
    """
    if projection.warp is None:
        return 0.0
    share, hidden_px = OF_TILT, LEAN_PX
    if not projection.has_squares:
        share, hidden_px = OF_SMOOTH_TILT * projection.scale**2, 1.0 / projection.scale
    hidden = max(abs(radius_px) / hidden_px, 1.0) ** 1.5
    return share * detail * projection.warp.tilt(width_px, height_px) / (parts**2 * hidden)
