"""What a plan says of diffraction, aberrations, low-pass filter and aperture."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from simulator.optics.defocus.defocus import Defocus
from simulator.optics.error_term import Skipped
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.perspective import GREEN_NM
from simulator.pipeline.step import Step
from simulator.sensor.camera.camera import Camera

if TYPE_CHECKING:
    from simulator.optics.psf.field_psf import FieldPsf


def psf_steps(
    lens: Lens, camera: Camera, defocus: Defocus | None, psf: "FieldPsf | None", skipped: Skipped | None
) -> list[Step]:
    """Steps of diffraction, aberrations, low-pass filter and pixel aperture.

    skipped: why their point spread function is left out; None: it is not.
    """
    steps = [
        _diffraction(lens, camera, defocus, psf),
        _aberrations(lens, psf),
        Step("low-pass filter", camera.low_pass_um > 0, _low_pass(camera)),
        Step("pixel aperture", camera.fill_factor < 1.0, _aperture(camera)),
    ]
    if skipped is None:
        return steps
    return [replace(step, kept=False, why=skipped.reason if step.kept else step.why) for step in steps]


def _diffraction(lens: Lens, camera: Camera, defocus: Defocus | None, psf: "FieldPsf | None") -> Step:
    step = "diffraction"
    if not lens.forms_image:
        return Step(step, False, "without a lens there is no image")
    airy_px = lens.airy_diameter_um() / camera.pixel_pitch_um
    airy = f"the Airy disk is {airy_px:.2f} photosites wide (2.44 lambda N at {GREEN_NM:g} nm)"
    if lens.psf is not None:
        return Step(step, False, f"is in the PSF of the file; {airy}")
    if not lens.has_diffraction:
        return Step(step, False, f"lens.diffraction is not set; {airy}")
    return Step(step, True, airy if psf is None else f"{airy}; {_order(lens, defocus, psf)}")


def _aberrations(lens: Lens, psf: "FieldPsf | None") -> Step:
    step = "aberrations"
    if not lens.can_have_aberrations:
        return Step(step, False, "nothing is refracted")
    if lens.psf is None and lens.aberrations is None:
        return Step(step, False, "the lens states none")
    if psf is None:
        return Step(step, True, "of the lens")
    nodes = "one kernel for the whole field" if psf.nodes == (1, 1) else f"kernels at {psf.nodes[0]} x {psf.nodes[1]} places"
    return Step(step, True, nodes if lens.psf is None else f"{lens.psf.name}, {nodes}; {_slabs(psf)}")


def _order(lens: Lens, defocus: Defocus | None, psf: "FieldPsf") -> str:
    """Whether the kernels include the blur of defocus or follow it, and why."""
    if psf.by_distance or defocus is None:
        return _slabs(psf)
    if psf.corrected_px:
        return f"follows the geometric blur, which is corrected to wave optics at {len(psf.corrected_px)} radii"
    far = "blur circles are far larger" if lens.aberrations is None else "blur circles are too large for kernels"
    return f"follows the geometric blur, since {far} (up to {defocus.largest_px:.1f} photosites in radius)"


def _slabs(psf: "FieldPsf") -> str:
    size, count = 2 * psf.reach_px + 1, len(psf.radii_px)
    if not psf.by_distance:
        return f"kernels of {size} photosites follow the geometric blur"
    if count > 1:
        ends = f"{psf.radii_px[0]:.2f} to {psf.radii_px[-1]:+.2f}"
        return f"together with the blur, {count} slabs of radius {ends} photosites, kernels of up to {size}"
    return (
        f"kernels of {size} photosites" if psf.radii_px == (0.0,) else f"together with the blur, kernels of {size} photosites"
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
