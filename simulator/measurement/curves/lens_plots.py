"""Plots of a lens in front of a camera: blur circle and depth of field over distance, modulation transfer."""

import math
from dataclasses import replace

import numpy as np

from simulator.measurement.curves.wavefront_transfer import wavefront_transfer
from simulator.measurement.quantities.quantity import Curve
from simulator.measurement.report.plot import Line, Mark, Plot
from simulator.optics.lens.lens import Lens
from simulator.optics.lens.perspective import GREEN_NM
from simulator.optics.lens.thin_lens import ThinLens
from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.psf_planning import working_wavefront
from simulator.sensor.camera.camera import Camera

POINTS = 241  # of a smooth curve
NEAREST = 0.1  # of the plane in focus, at which distances begin
FARTHEST = 100.0  # times the plane in focus, at which they end
OFF_AXIS = 0.7  # of the half diagonal: half of the frame lies within, about
FAR_M = 1000.0  # where they end for a lens focused at infinity


def blur_plot(lens: Lens, camera: Camera) -> Plot:
    """Return the diameter of the blur circle over the distance of a point, C = A z_i |1/z_focus - 1/z| of a thin lens."""
    distances_m = _distances_m(lens)
    diameters_um = 2.0 * np.abs(np.asarray(lens.blur_radius_um(distances_m), np.float64))
    marks = [Mark("y", 2.0 * camera.pixel_pitch_um, "2 photosites")]
    if isinstance(lens, ThinLens):
        marks.append(Mark("y", lens.circle_um(math.hypot(*camera.sensor_mm)), "circle of confusion"))
        marks += [Mark("x", lens.focus_distance_m, "focus")] * math.isfinite(lens.focus_distance_m)
    line = Line(Curve(distances_m, diameters_um, "distance", "m", "blur circle", "um"), _lens_label(lens))
    note = "Diameter on the sensor by geometrical optics, on the axis."
    least_um = 0.1 * camera.pixel_pitch_um  # less than can be seen
    return Plot("blur", "Blur circle against distance", (line,), note, "log", "log", least_um, tuple(marks))


def depth_of_field_plot(lens: ThinLens, camera: Camera) -> Plot:
    """Return the nearest and the farthest sharp distance over the distance in focus: 1/z = 1/z_focus +- C / (A z_i).

    A limit of infinity is left out: from the hyperfocal distance on nothing is too far.
    """
    circle_um = lens.circle_um(math.hypot(*camera.sensor_mm))
    least_m = max(2.5e-3 * lens.focal_length_mm, NEAREST * _center_m(lens))
    focus_m = np.geomspace(least_m, FARTHEST * _center_m(lens), POINTS)
    limits = np.array([replace(lens, focus_distance_m=float(one)).depth_of_field_m(circle_um) for one in focus_m])
    lines = []
    for side, name in enumerate(("nearest sharp", "farthest sharp")):
        shown = np.isfinite(limits[:, side])
        curve = Curve(focus_m[shown], limits[shown, side], "distance in focus", "m", "distance", "m")
        lines.append(Line(curve, f"{name}, {_lens_label(lens)}"))
    marks = (Mark("x", lens.hyperfocal_m(circle_um), "hyperfocal"),)
    note = f"Blur circle up to {circle_um:.3g} um, the circle of confusion; the farthest limit ends where it is infinite."
    return Plot("depth_of_field", "Depth of field", tuple(lines), note, x_scale="log", y_scale="log", marks=marks)


def diffraction_transfer(frequency_per_um: np.ndarray, wavelength_um: float, f_number: float) -> np.ndarray:
    """Return the modulation transfer of a round pupil in focus without aberrations, same shape as the frequencies.

    2/pi (acos u - u sqrt(1 - u^2)) with u = frequency * wavelength * f-number, 0 from u = 1 on
    (Goodman, Introduction to Fourier Optics, 6.3). frequency_per_um: [cycles/um], >= 0.
    """
    u = np.minimum(np.asarray(frequency_per_um, np.float64) * wavelength_um * f_number, 1.0)
    return 2.0 / math.pi * (np.arccos(u) - u * np.sqrt(1.0 - u * u))


def mtf_plot(lens: Lens | None, camera: Camera) -> Plot:
    """Return the modulation transfer along one axis up to one cycle per photosite: each factor, and their product.

    Diffraction and aberrations of a round pupil at 550 nm, times the aperture of a photosite, times the optical low-pass filter
    (`Sampling.transfer`), in the plane of focus. The product is what the shot simulates: diffraction and aberrations are
    factors of it where the lens has them. Of aberrations there is a product for each place of `_places`.
    lens: None, of a camera alone.
    """
    per_px = np.linspace(0.0, 1.0, POINTS)
    per_um = per_px / camera.pixel_pitch_um
    factors = {"photosite": np.abs(Sampling(camera.fill_factor).transfer(per_um, camera.pixel_pitch_um))}
    if camera.low_pass_um > 0:  # no width of a photosite leaves the filter alone
        factors["low-pass filter"] = np.abs(Sampling(1.0, camera.low_pass_um).transfer(per_um, 0.0))
    products = {"together": np.prod(list(factors.values()), axis=0)}
    note = "Along one axis, in the plane of focus."
    if lens is not None and lens.has_plane_of_focus:
        diffraction = diffraction_transfer(per_um, 1e-3 * GREEN_NM, lens.diffraction_f_number)
        note += f" Diffraction of a round pupil at {GREEN_NM:g} nm, f/{lens.diffraction_f_number:.4g}"
        if lens.has_diffraction:
            factors["diffraction"] = diffraction
            wavefronts = _wavefront_transfers(lens, per_um) or {"together": diffraction}
            products = {place: products["together"] * transfer for place, transfer in wavefronts.items()}
            note += "." if lens.aberrations is None else ", with the lens's aberrations."
        else:
            note += ", which the shot does not simulate: lens.diffraction is off."
    lines = [Line(_transfer(per_px, transfer), place) for place, transfer in products.items()]
    if len(factors) > 1:
        lines += [Line(_transfer(per_px, one), name, is_reference=True) for name, one in factors.items()]
    marks = (Mark("x", 0.5, "Nyquist"),)
    return Plot("mtf", "Modulation transfer", tuple(lines), note, marks=marks)


def _wavefront_transfers(lens: Lens, per_um: np.ndarray) -> dict[str, np.ndarray]:
    """Return the modulation transfer of diffraction and aberrations at each place; {} of a lens without aberrations.

    Raises PhotositeError where the pupil is larger than that of the stated wavefront.
    """
    if lens.aberrations is None:
        return {}
    aberrations, f_number = working_wavefront(lens)

    def transfer(field: float, direction: int) -> np.ndarray:
        def wavefront_um(x: np.ndarray, y: np.ndarray) -> np.ndarray:
            return aberrations.wavefront_error_um(*((x, y), (y, x))[direction], f_number, GREEN_NM, (field, 0.0))

        return wavefront_transfer(wavefront_um, 1e-3 * GREEN_NM, 2e-3 * GREEN_NM * f_number * per_um)

    return {place: transfer(field, direction) for place, (field, direction) in _places(aberrations).items()}


def _places(aberrations: Aberrations) -> dict[str, tuple[float, int]]:
    """Return field and direction of modulation, 0 along the field or along rows, of each line of a lens with aberrations."""
    turns = aberrations.has_fixed_orientation
    found = {"centre, along rows": (0.0, 0), "centre, along columns": (0.0, 1)} if turns else {"centre": (0.0, 0)}
    if aberrations.varies_over_field:
        found |= {f"{OFF_AXIS:g} of the way to the corner, radially": (OFF_AXIS, 0), "there, across the radius": (OFF_AXIS, 1)}
    return found


def mtf_on_sensor(plot: Plot, camera: Camera) -> Plot:
    """Return a plot of `mtf_plot` over cycles/mm on the sensor, in which cameras of other pitches can be compared."""
    per_mm = 1e3 / camera.pixel_pitch_um
    curves = [Curve(per_mm * one.curve.x, one.curve.y, "frequency", "cycles/mm", one.curve.y_name, "") for one in plot.lines]
    lines = tuple(replace(line, curve=curve) for line, curve in zip(plot.lines, curves, strict=True))
    return replace(plot, lines=lines, marks=())


def _transfer(per_px: np.ndarray, transfer: np.ndarray) -> Curve:
    return Curve(per_px, transfer, "frequency", "cycles/px", "modulation transfer", "")


def _distances_m(lens: Lens) -> np.ndarray:
    center_m = _center_m(lens)
    least_m = NEAREST * center_m
    return np.geomspace(least_m, FARTHEST * center_m, POINTS)


def _center_m(lens: Lens) -> float:
    focus_m = lens.focus_distance_m
    return focus_m if math.isfinite(focus_m) else FAR_M / FARTHEST


def _lens_label(lens: Lens) -> str:
    return f"{lens.focal_length_mm:g} mm f/{lens.f_number:.3g}"
