"""What a plan says of diffraction, aberrations, low-pass filter and aperture."""

import math
from dataclasses import replace

from simulator.optics.defocus.defocus import Defocus
from simulator.optics.lens.bare_sensor import BareSensor
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.perspective import GREEN_NM
from simulator.optics.lens.pinhole import Pinhole
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.psf.field_psf import Spread
from simulator.pipeline.step import Step
from simulator.sensor.camera.camera import Camera


def psf_steps(lens: Lens, camera: Camera, defocus: Defocus | None, spread: Spread | None, unseen: str | None) -> list[Step]:
    """Diffraction, aberrations, low-pass filter and pixel aperture. unseen: why nothing of them is seen; None: something is."""
    steps = [
        _diffraction(lens, camera, defocus, spread),
        _aberrations(lens, spread),
        Step("low-pass filter", camera.low_pass_um > 0, _low_pass(camera)),
        Step("pixel aperture", camera.fill_factor < 1.0, _aperture(camera)),
    ]
    return steps if unseen is None else [replace(step, kept=False, why=unseen if step.kept else step.why) for step in steps]


def _diffraction(lens: Lens, camera: Camera, defocus: Defocus | None, spread: Spread | None) -> Step:
    step = "diffraction"
    if isinstance(lens, BareSensor):
        return Step(step, False, "without a lens there is no image")
    airy_px = lens.airy_diameter_um() / camera.pixel_pitch_um
    told = f"the Airy disk is {airy_px:.2f} photosites wide (2.44 lambda N at {GREEN_NM:g} nm)"
    if isinstance(lens, ThinLens) and lens.psf is not None:
        return Step(step, False, f"is in the PSF of the file; {told}")
    if not (lens.diffraction or getattr(lens, "aberrations", None)):
        return Step(step, False, f"lens.diffraction is not set; {told}")
    return Step(step, True, told if spread is None else f"{told}; {_way(lens, defocus, spread)}")


def _aberrations(lens: Lens, spread: Spread | None) -> Step:
    step = "aberrations"
    if isinstance(lens, Pinhole | BareSensor):
        return Step(step, False, "nothing is refracted")
    if lens.psf is None and lens.aberrations is None:
        return Step(step, False, "the lens states none")
    if spread is None:
        return Step(step, True, "of the lens")
    nodes = (
        "one kernel for the whole field"
        if spread.nodes == (1, 1)
        else f"kernels at {spread.nodes[0]} x {spread.nodes[1]} places"
    )
    return Step(step, True, nodes if lens.psf is None else f"{lens.psf.name}, {nodes}; {_slabs(spread)}")


def _way(lens: Lens, defocus: Defocus | None, spread: Spread) -> str:
    if spread.by_distance:
        return _slabs(spread)
    far = "blur circles are far larger" if lens.aberrations is None else "blur circles are too large for kernels"
    return f"follows the geometric blur, since {far} (up to {defocus.largest_px:.1f} photosites in radius)"


def _slabs(spread: Spread) -> str:
    size, count = 2 * spread.reach_px + 1, len(spread.radii_px)
    if not spread.by_distance:
        return f"kernels of {size} photosites follow the geometric blur"
    if count > 1:
        ends = f"{spread.radii_px[0]:.2f} to {spread.radii_px[-1]:+.2f}"
        return f"together with the blur, {count} slabs of radius {ends} photosites, kernels of up to {size}"
    return (
        f"kernels of {size} photosites"
        if spread.radii_px == (0.0,)
        else f"together with the blur, kernels of {size} photosites"
    )


def _low_pass(camera: Camera) -> str:
    if not camera.low_pass_um:
        return "the camera has none"
    zero = 0.5 * camera.pixel_pitch_um / camera.low_pass_um
    return f"four spots {camera.low_pass_um:g} um apart: no contrast at {zero:.3g} cycles per photosite"


def _aperture(camera: Camera) -> str:
    if camera.fill_factor == 1.0:
        return "photosites are sensitive all over"
    side = math.sqrt(camera.fill_factor)
    return f"sensitive squares of {side:.3g} photosites: sinc({side:.3g} nu) instead of sinc(nu)"
