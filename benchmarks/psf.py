"""Point spread functions: run time against error beside SciPy, PyTorch and GalSim.

A picture with a pixel for each photosite, before a sensor without colour filter, is convolved with one kernel from a file,
which all contestants know. Truth is SciPy's FFT of the whole kernel in float64. Peers get faster by a smaller part of the
kernel, GalSim by coarser interpolants.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from measuring.light import exposing
from measuring.record import ERROR_COLUMNS, Z_ERROR, Record, z_errors
from measuring.run import Run
from motion import camera_of, frame_size, photographs, squares
from scipy.signal import fftconvolve, oaconvolve

from simulator.exposure.settings import Exposure
from simulator.optics.lens.thin_lens import ThinLens
from simulator.pipeline.planner import plan
from simulator.pipeline.shot import Shot
from simulator.scene.scene import Scene

ELECTRONS, PROBE_S, BRIGHTEST = 2000.0, 1e-3, 0.95  # of the brightest light; exposure at which it is looked at; that light
TOLERANCES, DEFAULT = (1.0, 0.3, 0.1, 0.03, 0.0), 0.1
REACHES_PX = (2, 4, 8, 16, 32)  # of the parts of the kernel that peers use
DIRECT_PX = 8  # most of them that PyTorch convolves directly
TEXT = """\
{size} photosites without colour filter, a kernel from a PSF file: a core with a tail that falls as 1/r³, as diffraction's does
(`tail`), or a spot of coma (`compact`), over squares of light or a photograph. The error is against SciPy's FFT of the whole
kernel in float64, in units of the noise of 2,000 e⁻ of the brightest light. SciPy (`oaconvolve`), PyTorch and GalSim
(`InterpolatedImage`) get the picture with its edge continued. A number in photosites is the part of the kernel that is used, to
each side.
"""


def tail_kernel(reach_px: int) -> np.ndarray:
    """A core with a tail of r^-3, (2 reach + 1, 2 reach + 1) float64, sum 1."""
    y, x = np.mgrid[-reach_px : reach_px + 1, -reach_px : reach_px + 1]
    kernel = (1.0 + (x**2 + y**2) / 0.8**2) ** -1.5
    return kernel / kernel.sum()


def compact_kernel(reach_px: int) -> np.ndarray:
    """A lopsided spot, (2 reach + 1, 2 reach + 1) float64, sum 1."""
    y, x = np.mgrid[-reach_px : reach_px + 1, -reach_px : reach_px + 1]
    kernel = np.exp(-0.5 * (x**2 + y**2)) + 0.3 * np.exp(-0.5 * ((x - 2.0) ** 2 / 2.0 + (y - 1.0) ** 2 / 4.0))
    return kernel / kernel.sum()


def shot_of(light: np.ndarray, kernel: Path, tolerance: float) -> Shot:
    """A shot of light (height, width) in focus through the kernel of a file; BRIGHTEST gives ELECTRONS."""
    wavelengths, planes = np.arange(400.0, 701.0, 10.0), light[..., None].astype(np.float32)
    planes.setflags(write=False)
    scene = Scene(planes, np.full((1, 31), 1e-3), wavelengths, np.ones(31), 2.0, interpolation="nearest")
    lens, camera = ThinLens(50.0, 4.0, focus_distance_m=2.0, cos4=False, psf=kernel), camera_of(*light.shape[::-1], 1)
    probe = Shot(scene, lens, Exposure(PROBE_S), camera, tolerance=tolerance)
    time_s = PROBE_S * ELECTRONS / plan(probe).optics.accuracy.electrons
    return replace(probe, exposure=Exposure(time_s))


def part_of(kernel: np.ndarray, reach_px: int) -> np.ndarray:
    """The middle of a kernel, its sum made that of the whole."""
    cut = len(kernel) // 2 - reach_px
    part = kernel[cut : len(kernel) - cut, cut : len(kernel) - cut]
    return part / part.sum() * kernel.sum()


def by_scipy(light: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Overlap-add in float32."""
    return oaconvolve(np.pad(light, len(kernel) // 2, "edge"), kernel.astype(np.float32), "valid")


def by_torch(light: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Direct, or by FFT of the whole picture, in float32."""
    import torch

    reach = len(kernel) // 2
    with torch.inference_mode():
        padded = torch.nn.functional.pad(torch.from_numpy(light)[None, None], (reach,) * 4, mode="replicate")
        spot = torch.from_numpy(np.ascontiguousarray(kernel[::-1, ::-1], np.float32))[None, None]
        if reach <= DIRECT_PX:
            return torch.nn.functional.conv2d(padded, spot)[0, 0].numpy()
        size = [side + 2 * reach for side in padded.shape[2:]]
        spectrum = torch.fft.rfft2(padded[0, 0], size) * torch.fft.rfft2(spot[0, 0].flip((0, 1)), size)
        return torch.fft.irfft2(spectrum, size)[2 * reach : -2 * reach, 2 * reach : -2 * reach].numpy()


def by_galsim(light: np.ndarray, kernel: np.ndarray, interpolant: str) -> np.ndarray:
    """Both as interpolated images, convolved by GalSim."""
    import galsim

    reach, limits = len(kernel) // 2, galsim.GSParams(maximum_fft_size=1 << 15)
    padded = np.pad(light, reach, "edge").astype(np.float64)
    picture, spot = (
        galsim.InterpolatedImage(
            galsim.Image(plane), scale=1.0, x_interpolant=interpolant, normalization="flux", gsparams=limits
        )
        for plane in (padded, kernel.astype(np.float64))
    )
    drawn = galsim.Convolve(picture, spot, gsparams=limits).drawImage(
        galsim.Image(*padded.shape[::-1], dtype=np.float32), scale=1.0, method="no_pixel"
    )
    return drawn.array[reach : reach + light.shape[0], reach : reach + light.shape[1]]


def peers_of(light: np.ndarray, kernel: np.ndarray, record: Record) -> dict[str, Callable[[], np.ndarray]]:
    """What makes each peer's picture, by name; a note for packages that are missing."""
    whole = len(kernel) // 2
    reaches = {f"{reach} px": reach for reach in REACHES_PX if reach < whole} | {f"{whole} px": whole}
    found: dict[str, Callable[[], np.ndarray]] = {}
    for label, reach in reaches.items():
        found[f"SciPy, {label}"] = lambda reach=reach: by_scipy(light, part_of(kernel, reach))
    try:
        import torch  # noqa: F401
    except ImportError:
        record.note("PyTorch, which is not installed: pip install torch")
    else:
        for label, reach in reaches.items():
            found[f"PyTorch, {label}"] = lambda reach=reach: by_torch(light, part_of(kernel, reach))
    try:
        import galsim  # noqa: F401
    except ImportError:
        record.note("GalSim, which is not installed: pip install galsim")
    else:
        for interpolant in ("linear", "lanczos7"):
            found[f"GalSim, {interpolant}"] = lambda interpolant=interpolant: by_galsim(light, kernel, interpolant)
    return found


def measure_psf(run: Run) -> Record:
    """Run time and error of every method on every kernel and picture."""
    columns = ERROR_COLUMNS | {"error": [Z_ERROR, ".3g"], "rms": ["rms", ".3g"]}
    record, device = Record("psf", "The point spread function", TEXT, Z_ERROR, columns, "error"), run.device()
    width, height = frame_size(run.pick(0.05, 0.4, 4.0))
    record.facts["size"] = f"{width} x {height}"
    pictures = {"squares": squares(width, height, 1)[0], "photograph": photographs(width, height, 1)[0]}
    kernels = {"tail": tail_kernel(run.pick(24, 64, 64)), "compact": compact_kernel(8)}
    for kind, kernel in kernels.items():
        path = run.folder / f"{kind}.npy"
        np.save(path, kernel)
        for picture, light in pictures.items():
            case, made = f"{kind}, {picture}", {}
            border = len(kernel) // 2
            truth = fftconvolve(np.pad(light.astype(np.float64), border, "edge"), kernel, "valid")
            runs: dict[str, Callable[[], object]] = {}
            units: dict[str, float] = {}
            for tolerance in TOLERANCES:
                name = f"Photosite, {tolerance:g} σ"
                planned = plan(shot_of(light, path, tolerance))
                runs[name] = exposing(device, planned, made, name)
                units[name] = float(planned.optics.weights.sum())
            for name, make in peers_of(light, kernel, record).items():
                runs[name] = lambda name=name, make=make, made=made: _keep(made, name, make())
            for name, timing in run.turns(case, runs).items():
                more = {"is_default": True} if name == f"Photosite, {DEFAULT:g} σ" else {}
                record.add(
                    case, name, timing, **z_errors(made[name]() / units.get(name, 1.0), truth, ELECTRONS / BRIGHTEST), **more
                )
    record.mark_dominated()
    return record


def _keep(made: dict[str, Callable[[], np.ndarray]], name: str, picture: np.ndarray) -> None:
    """Leave a picture for its error."""
    made[name] = lambda: picture
