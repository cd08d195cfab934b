"""Pictures, depth maps, cubes and kernels that the shots are taken of: written once, for both checkouts at the same paths.

Nothing here imports Photosite, so that a change of it cannot change its own input.
"""

from pathlib import Path

import numpy as np
import OpenImageIO as oiio

WIDTH_PX, HEIGHT_PX = 260, 190
FIELD_NAMES = ("R", "G", "B")


def write_inputs(folder: Path) -> None:
    """Write all input files into a folder; their content depends on nothing but this module and NumPy."""
    folder.mkdir(parents=True)
    rng = np.random.default_rng(20260501)
    picture, depth_m = textured(rng, HEIGHT_PX, WIDTH_PX), wall_and_disks(HEIGHT_PX, WIDTH_PX)
    write_pictures(folder, picture)
    write_depths(folder, picture, depth_m)
    write_layers(folder, rng, picture)
    write_cubes(folder, rng)
    write_deep(folder / "deep.exr", rng)
    write_kernels(folder)
    write_collections(folder, rng)


def textured(rng: np.random.Generator, height: int, width: int) -> np.ndarray:
    """Return patches of three sizes and a few lights: linear RGB (height, width, 3) float32, 0.02 to about 1, lights 40."""
    picture = np.zeros((height, width, 3))
    for size, weight in ((37, 0.5), (9, 0.3), (1, 0.2)):
        patches = rng.random((height // size + 1, width // size + 1, 3))
        picture += weight * np.kron(patches, np.ones((size, size, 1)))[:height, :width]
    picture = 0.02 + picture**2
    picture[rng.integers(0, height, 9), rng.integers(0, width, 9)] = 40.0
    return picture.astype(np.float32)


def wall_and_disks(height: int, width: int) -> np.ndarray:
    """Return depth of a tilted wall behind two disks, (height, width) float32 [m]."""
    y, x = np.mgrid[:height, :width]
    depth_m = 2.5 + 1.5 * x / width
    depth_m[(x - 0.3 * width) ** 2 + (y - 0.4 * height) ** 2 < (0.2 * height) ** 2] = 0.5
    depth_m[(x - 0.7 * width) ** 2 + (y - 0.6 * height) ** 2 < (0.25 * height) ** 2] = 1.0
    return depth_m.astype(np.float32)


def put(path: Path, pixels: np.ndarray, names: tuple[str, ...] = ()) -> None:
    """Write (height, width[, channels]) uint8, uint16 or float32 with OpenImageIO. Raises OSError."""
    pixels = pixels if pixels.ndim == 3 else pixels[..., None]
    kind = {"uint8": "uint8", "uint16": "uint16", "float32": "float"}[str(pixels.dtype)]
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    spec.attribute("DateTime", "")
    spec.attribute("oiio:UnassociatedAlpha", 1)  # of a PNG: colours are stored as they are given
    if names:
        spec.channelnames = names
    output = oiio.ImageOutput.create(str(path))
    if not (output.open(str(path), spec) and output.write_image(np.ascontiguousarray(pixels)) and output.close()):
        raise OSError(f"{path}: {output.geterror()}")


def write_pictures(folder: Path, picture: np.ndarray) -> None:
    """One picture in every format that a scene can be read from."""
    codes = np.clip(picture, 0.0, 1.0) ** (1 / 2.2)
    for name in ("picture.exr", "picture.hdr", "float.tif"):
        put(folder / name, picture)
    put(folder / "picture.tif", (65535 * codes).astype(np.uint16))
    for name in ("picture.png", "picture.jpg"):
        put(folder / name, (255 * codes).astype(np.uint8))
    put(folder / "grey.png", (255 * codes[..., 1]).astype(np.uint8))
    np.save(folder / "picture.npy", picture)
    put(
        folder / "named.exr",
        np.dstack([picture, 0.5 * picture]),
        (*(f"beauty.{c}" for c in "RGB"), *(f"other.{c}" for c in "RGB")),
    )
    put(folder / "negative.exr", picture - np.float32(0.1))
    put(folder / "detail.exr", textured(np.random.default_rng(5), 4 * HEIGHT_PX, 4 * WIDTH_PX))


def write_depths(folder: Path, picture: np.ndarray, depth_m: np.ndarray) -> None:
    """Depth in a file of its own, in the picture's file, and with holes."""
    put(folder / "depth_mm.exr", 1000 * depth_m)
    put(folder / "with_depth.exr", np.dstack([picture, depth_m]), ("R", "G", "B", "Z"))
    holes = depth_m.copy()
    holes[20:30, 40:70], holes[100:120, 150:160] = np.nan, 0.0
    put(folder / "holes.exr", holes)


def write_layers(folder: Path, rng: np.random.Generator, picture: np.ndarray) -> None:
    """A disk and bars before the picture: associated and straight alpha, and alpha in a file of its own."""
    height, width = picture.shape[:2]
    y, x = np.mgrid[:height, :width]
    disk = np.clip(0.5 + 50 - np.hypot(x - 90, y - 80), 0, 1)[..., None]
    bars = (x // 14 % 3 == 0).astype(np.float32)[..., None]
    colour = textured(rng, height, width)
    put(folder / "disk.exr", np.dstack([colour * disk, disk]).astype(np.float32), ("R", "G", "B", "A"))
    straight = np.dstack([np.clip(colour, 0, 1) ** (1 / 2.2), 0.8 * bars])
    put(folder / "bars.png", (255 * straight).astype(np.uint8), ("R", "G", "B", "A"))
    put(folder / "bars_mask.png", (255 * bars).astype(np.uint8))
    put(folder / "bars.exr", colour)


def write_cubes(folder: Path, rng: np.random.Generator) -> None:
    """A cube of 16 wavelengths as .npy beside its wavelengths, and as channels of an EXR named by wavelength."""
    wavelengths_nm = np.arange(400, 701, 20)
    grey = textured(rng, 60, 80)[..., :1]
    tint = 0.5 + 0.4 * np.sin(wavelengths_nm / 60.0 + 4.0 * rng.random((60, 80, 1)))
    cube = np.clip(grey * tint, 0.0, 1.0).astype(np.float32)
    np.save(folder / "cube.npy", cube)
    np.savetxt(folder / "wavelengths.txt", wavelengths_nm)
    put(folder / "cube.exr", cube, tuple(f"{nm}nm" for nm in wavelengths_nm))


def write_deep(path: Path, rng: np.random.Generator) -> None:
    """Up to five samples a pixel, surfaces between 0.5 and 6 m and a thin volume. Raises OSError."""
    height, width, names = 60, 80, ("R", "G", "B", "A", "Z", "ZBack")
    counts = rng.integers(1, 6, height * width)
    data = oiio.DeepData()
    data.init(height * width, len(names), [oiio.TypeFloat] * len(names), list(names))
    for pixel, count in enumerate(counts):
        data.set_samples(pixel, int(count))
    for pixel, count in enumerate(counts):
        near_m = np.sort(rng.choice([0.5, 0.9, 1.5, 3.0, 5.5], count, replace=False))
        for sample, z in enumerate(near_m):
            alpha = rng.choice([0.3, 0.8, 1.0])
            back = z + (0.2 if alpha < 0.5 else 0.0)
            for channel, value in enumerate((*(rng.random(3) * alpha), alpha, z, back)):
                data.set_deep_value(pixel, channel, sample, float(value))
    spec = oiio.ImageSpec(width, height, len(names), oiio.FLOAT)
    spec.channelnames, spec.deep = names, True
    output = oiio.ImageOutput.create(str(path))
    if not (output.open(str(path), spec) and output.write_deep_image(data) and output.close()):
        raise OSError(f"{path}: {output.geterror()}")


def gaussian(size: int, sigma: float, stretch: float = 1.0) -> np.ndarray:
    """Return a normalised (size, size) kernel, wider across than down by `stretch`."""
    place = np.arange(size) - size // 2
    kernel = np.exp(-0.5 * ((place[:, None] / sigma) ** 2 + (place / (stretch * sigma)) ** 2))
    return kernel / kernel.sum()


def write_kernels(folder: Path) -> None:
    """One kernel; a table over fields; a table over blur radii; a listing as optical design programs write it."""
    np.save(folder / "one.npy", gaussian(7, 1.2, 1.4))
    fields = np.stack([gaussian(9, 0.8 + 0.8 * field, 1 + field) for field in (0.0, 0.5, 1.0)])
    np.savez(folder / "fields.npz", kernels=fields[None, :, None], fields=[0.0, 0.5, 1.0])
    radii = np.arange(-30.0, 31.0, 6.0)
    blurred = np.stack([gaussian(63, 0.7 + 0.5 * abs(radius), 1.2 if radius < 0 else 1.0) for radius in radii])
    np.savez(folder / "radii.npz", kernels=blurred[:, None, None], blur_radii_px=radii)
    rows = "\n".join(" ".join(f"{value:.6e}" for value in row) for row in gaussian(33, 5.0))
    (folder / "huygens.txt").write_text(f"Data spacing is 0.500 um\nCenter point is: 17, 16\n\n{rows}\n", encoding="utf-8")


def write_collections(folder: Path, rng: np.random.Generator) -> None:
    """Folders of pictures and cubes for data sets."""
    for kind in ("photographs", "linear", "cubes"):
        (folder / kind).mkdir()
    for number in range(3):
        picture = textured(rng, 90, 120)
        put(folder / "photographs" / f"{number}.png", (255 * np.clip(picture, 0, 1) ** (1 / 2.2)).astype(np.uint8))
        put(folder / "linear" / f"{number}.exr", picture)
    np.save(folder / "cubes" / "0.npy", np.load(folder / "cube.npy"))
