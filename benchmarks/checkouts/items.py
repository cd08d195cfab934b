"""What both checkouts are asked to do: shots taken from Python, and commands.

A shot is a shot file as data; paths in it are absolute and the same for both checkouts. A command is a list of argument lists
that run one after the other in one empty folder; the worker puts in `{inputs}`, `{shots}`, `{checkout}` and `{device}`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Data = dict[str, Any]
ALL_TRUTH = ["variance", "depth", "blur", "rgb"]
SMALL = {"base": "sony_a7s2", "width": 244, "height": 182, "pixel_pitch": "6 um"}
TINY_WINDOW = {"x": 400, "y": 300, "width": 201, "height": 151}
THIN_LENS = {"focal_length": "8 mm", "f_number": "f/2.8", "focus_distance": "1 m"}
EXPOSURE = {"time": "1/200 s", "iso": 800}


@dataclass(frozen=True)
class Item:
    """One thing to do.

    document: of a shot taken from Python; or file: of a shot in the checkout, with the overrides `settings`.
    commands: argument lists instead of a shot; the first word is photosite, data_gen or a script of the checkout.
    again: resimulate and develop the DNG as well. wording: what is printed is text for people, counted where it differs.
    """

    name: str
    document: Data = field(default_factory=dict)
    file: str = ""
    settings: Data = field(default_factory=dict)
    commands: tuple[tuple[str, ...], ...] = ()
    again: bool = False
    wording: bool = False


def items(inputs: Path, shot_files: list[str], cameras: list[str], dataset_files: list[str]) -> list[Item]:
    """Return everything to do, small things first.

    inputs: folder of `write_inputs`. shot_files, dataset_files: paths in the checkout. cameras: names in configs/cameras.
    """
    made = [*lens_items(inputs), *tolerance_items(inputs), *spread_items(inputs), *sensor_items(inputs)]
    made += [*scene_items(inputs), *file_items(inputs), *library_items(inputs, shot_files, cameras)]
    made += [*command_items(), *dataset_items(dataset_files), *full_size_items(inputs)]
    return made


def near_and_far(inputs: Path, **settings: object) -> Data:
    """Return a scene of a tilted wall behind two disks."""
    depth = {"image": str(inputs / "depth_mm.exr"), "unit": "mm"}
    return {"image": str(inputs / "picture.exr"), "luminance": "120 cd/m^2", "depth": depth, **settings}


def layers(inputs: Path, **back: object) -> Data:
    """Return a scene of three layers, with alpha of each kind; back: other keys of the last one."""
    return {
        "layers": [
            {"image": str(inputs / "disk.exr"), "depth": "0.4 m"},
            {"image": str(inputs / "bars.exr"), "alpha_image": str(inputs / "bars_mask.png"), "depth": "0.9 m"},
            {
                "image": str(inputs / "picture.exr"),
                "depth": {"image": str(inputs / "depth_mm.exr"), "unit": "mm", "scale": 2},
                **back,
            },
        ],
        "luminance": "120 cd/m^2",
    }


def shot(name: str, scene: Data, lens: Data | None = None, camera: Data | None = None, **settings: Any) -> Item:
    """Return a shot of the small camera; lens and camera add to the usual ones, settings replace sections or flags."""
    kinds = {"pinhole", "bare_sensor"} & set(lens or {})
    again = settings.pop("again", False)
    document = {
        "name": name,
        "scene": scene,
        "lens": lens if kinds else {**THIN_LENS, **(lens or {})},
        "exposure": EXPOSURE,
        "camera": {**SMALL, **(camera or {})},
        "truth": ALL_TRUTH,
        "seeds": {"frame": 11, "body": 3},
        **settings,
    }
    return Item(name, document, again=again)


def lens_items(inputs: Path) -> Iterator[Item]:
    """Apertures, kinds of lens, rims, distortion, veil."""
    scene, flat = near_and_far(inputs), {"chart": "flat_field", "luminance": "100 cd/m^2", "depth": "2 m"}
    for f_number in ("f/1.4", "f/2", "f/4", "f/16"):
        yield shot(f"thin_{f_number.replace('/', '')}", scene, {"f_number": f_number}, again=f_number == "f/1.4")
    yield shot("thin_infinity", scene, {"focus_distance": "infinity"})
    yield shot("thin_near_focus", scene, {"focus_distance": "0.5 m", "f_number": "f/1.4"})
    yield shot("thin_aplanatic", scene, {"irradiance": "aplanatic", "t_stop": "f/3.3"})
    yield shot("thin_no_cos4", scene, {"cos4": False, "transmittance": 0.8})
    yield shot("blades", scene, {"f_number": "f/1.4", "aperture": {"blades": 6, "rotation": "10 deg"}})
    curved = {"blades": 7, "rotation": "5 deg", "blade_curvature": 0.3}
    yield shot("blades_curved", scene, {"f_number": "f/1.4", "aperture": curved})
    rims = {"front": {"distance": "6 mm", "diameter": "7 mm"}, "rear": {"distance": "4 mm", "diameter": "6 mm"}}
    yield shot("cats_eyes", scene, {"f_number": "f/1.4", "vignetting": rims})
    yield shot("cats_eyes_blades", scene, {"f_number": "f/1.4", "vignetting": rims, "aperture": curved})
    yield shot("cats_eyes_flat", flat, {"f_number": "f/1.4", "vignetting": {"front": rims["front"]}})
    yield shot("cats_eyes_layers", layers(inputs), {"f_number": "f/1.4", "vignetting": rims})
    barrel = {"k1": -0.06, "k2": 0.01, "p1": 0.001, "p2": -0.002, "unit": "half_diagonal", "lateral": [1.002, 1, 0.998]}
    yield shot("distortion", scene, {"f_number": "f/16", "distortion": barrel}, again=True)
    yield shot("distortion_blurred", scene, {"f_number": "f/1.4", "distortion": barrel})
    yield shot(
        "distortion_window",
        scene,
        {"distortion": {"k1": 0.2, "k3": -0.1}},
        {"window": {"x": 31, "y": 21, "width": 140, "height": 121}},
    )
    yield shot("glare", scene, {"veiling_glare": 0.03})
    yield shot("glare_layers", layers(inputs), {"veiling_glare": 0.03, "f_number": "f/1.4"})
    pinhole = {"diameter": "0.1 mm", "distance": "8 mm", "diffraction": False}
    long = {"time": "2 s", "iso": 800}
    yield shot("pinhole", scene, {"pinhole": pinhole}, exposure=long)
    yield shot("pinhole_glare", scene, {"pinhole": {**pinhole, "veiling_glare": 0.02, "cos4": False}}, exposure=long)
    yield shot("pinhole_diffraction", scene, {"pinhole": {**pinhole, "diffraction": True}}, exposure=long)
    yield shot(
        "bare_sensor",
        near_and_far(inputs, field_of_view="50 deg"),
        {"bare_sensor": {}},
        exposure={"time": "1/8000 s", "iso": 100},
    )
    yield shot("bare_sensor_layers", layers(inputs), {"bare_sensor": {}}, exposure={"time": "1/8000 s", "iso": 100})


def tolerance_items(inputs: Path) -> Iterator[Item]:
    """Blur at each tolerance, of a picture with depth and of layers; 0 follows rays in a small window."""
    window = {"x": 70, "y": 50, "width": 45, "height": 37}
    even = layers(inputs, depth="2.5 m")
    for tolerance in (0, 0.01, 0.1, 1):
        camera = {"window": window} if tolerance == 0 else {}
        yield shot(f"tolerance_{tolerance}", near_and_far(inputs), {"f_number": "f/1.4"}, camera, tolerance=tolerance)
        yield shot(
            f"tolerance_{tolerance}_layers",
            even if tolerance == 0 else layers(inputs),
            {"f_number": "f/1.4"},
            camera,
            tolerance=tolerance,
        )
    yield shot("tolerance_10", near_and_far(inputs), {"f_number": "f/1.4"}, tolerance=10)
    rims = {"front": {"distance": "6 mm", "diameter": "7 mm"}}
    yield shot("tolerance_0_cats_eyes", even, {"f_number": "f/1.4", "vignetting": rims}, {"window": window}, tolerance=0)
    yield shot("extend", near_and_far(inputs, hidden="extend"), {"f_number": "f/1.4"})
    yield shot("extend_rays", near_and_far(inputs, hidden="extend"), {"f_number": "f/1.4"}, {"window": window}, tolerance=0)
    yield shot("large_blur", layers(inputs), {"f_number": "f/1.4", "focal_length": "12 mm", "focus_distance": "4 m"})


def spread_items(inputs: Path) -> Iterator[Item]:
    """Point spread functions: wave optics, files, low-pass filter, aperture of the photosites."""
    flat = {"image": str(inputs / "picture.exr"), "luminance": "120 cd/m^2", "depth": "1 m"}
    fine = {**flat, "image": str(inputs / "detail.exr")}
    deep = near_and_far(inputs)
    yield shot("diffraction", flat, {"f_number": "f/16", "diffraction": True}, again=True)
    yield shot("diffraction_detail", fine, {"f_number": "f/11", "diffraction": True})
    yield shot("diffraction_blades", flat, {"f_number": "f/16", "diffraction": True, "aperture": {"blades": 6}})
    yield shot("diffraction_depth", deep, {"f_number": "f/8", "diffraction": True})
    yield shot("diffraction_layers", layers(inputs), {"f_number": "f/8", "diffraction": True})
    yield shot("diffraction_far", deep, {"f_number": "f/1.4", "diffraction": True})
    spherical = {"spherical": "0.6 um", "defocus": "-0.4 um", "at_f_number": "f/4"}
    yield shot("spherical", flat, {"f_number": "f/4", "aberrations": spherical})
    field = {"coma": "0.8 um", "astigmatism": "0.5 um", "field_curvature": "0.3 um", "zernike": {11: "0.05 um"}}
    colour = [
        {"wavelength": "450 nm", "focus": "40 um", "lateral": "3 um"},
        {"wavelength": "550 nm"},
        {"wavelength": "650 nm", "focus": "20 um"},
    ]
    yield shot("coma", flat, {"f_number": "f/4", "aberrations": field})
    yield shot("chromatic", flat, {"f_number": "f/4", "aberrations": {"chromatic": colour}})
    yield shot("aberrations_depth", deep, {"f_number": "f/4", "aberrations": {"spherical": "0.5 um"}})
    for name in ("one.npy", "fields.npz", "huygens.txt"):
        yield shot(f"psf_{name.replace('.', '_')}", flat, {"psf": str(inputs / name)})
    yield shot("psf_depth", deep, {"psf": str(inputs / "radii.npz"), "f_number": "f/2.8"})
    yield shot("psf_one_depth", deep, {"psf": str(inputs / "one.npy"), "f_number": "f/2"})
    yield shot("low_pass", flat, None, {"low_pass": "4 um"})
    yield shot("low_pass_detail", fine, None, {"low_pass": "4 um", "fill_factor": 0.5})
    yield shot("low_pass_depth", deep, {"f_number": "f/1.4"}, {"low_pass": "4 um"})
    yield shot("fill_factor", fine, None, {"fill_factor": 0.6})
    yield shot(
        "everything",
        deep,
        {"f_number": "f/8", "diffraction": True, "veiling_glare": 0.02, "distortion": {"k1": -0.05}},
        {"low_pass": "4 um"},
    )
    yield shot("spread_mono", flat, {"f_number": "f/16", "diffraction": True}, {"base": "ideal"})


STAGES: dict[str, Data] = {
    "banding": {"amplitude": "2 DN", "period": 37.5},
    "column_offset": {"sigma": "1.5 DN"},
    "dark_current": {"rate": "300 e-/s", "temperature": "35 degC", "measured_at": "25 degC"},
    "dead_pixels": {"share": 0.01},
    "digital_gain": {"factor": 1.6},
    "dsnu": {"sigma": "2 e-"},
    "full_well": {"capacity": "4000 e-"},
    "hot_pixels": {"share": 0.02, "rate": "5000 e-/s"},
    "nonlinearity": {"errors": ["0 DN", "120 DN", "-30 DN", "0 DN"]},
    "prnu": {"sigma": 0.02},
    "random_telegraph_noise": {"share": 0.05, "amplitude": "30 e-"},
}


def sensor_items(inputs: Path) -> Iterator[Item]:
    """Each stage alone and all together; crosstalk, binning, optical black; filter patterns and windows."""
    ramp = {"chart": "grey_ramp", "steps": 9, "luminance": "120 cd/m^2", "depth": "1 m"}
    scene = near_and_far(inputs)
    for stem, numbers in STAGES.items():
        yield shot(f"stage_{stem}", ramp, None, {"stages": {stem: numbers}})
    yield shot("stage_row_noise", ramp, None, {"base": "sony_a7_iii", "stages": {"row_noise": {"sigma": "1 DN"}}})
    yield shot("stages_none", ramp, None, {"stages": {"photon_shot_noise": None}})
    yield shot("stages_all", scene, None, {"stages": STAGES}, again=True)
    spread = {"base": "sony_a7_iii", "read_noise_spread": 0.2, "stages": {**STAGES, "row_noise": {"sigma": "1 DN"}}}
    yield shot("stages_all_model", scene, {"f_number": "f/1.4"}, spread)
    yield shot("model_noise", ramp, None, {"base": "sony_a7_iii", "read_noise_spread": 0.3})
    yield shot(
        "extrapolated",
        ramp,
        None,
        {"base": "canon_5d_mark_ii", "iso_range": "extrapolate"},
        exposure={"time": "1/200 s", "iso": 100},
    )
    line = {"gain": "0.8 DN/e-", "read_noise": "3 DN", "color_bias": ["1 DN", "-2 DN", "0.5 DN", "3 DN"]}
    biased = {"base": "sony_a7_iii", "read_noise_model": None, "conversion_gain": None, "iso_table": {800: line}}
    yield shot("color_bias", ramp, None, biased, raw={"black_per_place": True})
    optical = {"optical": 0.02, "optical_corner": 0.005}
    electrical = {"electrical": 0.015, "electrical_corner": 0.002}
    yield shot("crosstalk_optical", scene, None, {"crosstalk": optical})
    yield shot("crosstalk_electrical", scene, None, {"crosstalk": electrical})
    yield shot("crosstalk_both", scene, {"f_number": "f/1.4"}, {"crosstalk": {**optical, **electrical}, "stages": STAGES})
    for mode in ("charge", "average"):
        for factor in (2, 3):
            yield shot(
                f"binning_{mode}_{factor}",
                scene,
                None,
                {"binning": {"factor": factor, "mode": mode}, "crosstalk": electrical, "width": 252, "height": 180},
            )
    black = {"left": 16, "top": 8, "right": 4, "bottom": 2}
    yield shot(
        "optical_black",
        scene,
        {"veiling_glare": 0.01},
        {"optical_black": black, "crosstalk": {**optical, **electrical}},
        again=True,
    )
    yield shot(
        "optical_black_window",
        scene,
        {"f_number": "f/1.4"},
        {"optical_black": black, "window": {"x": 6, "y": 4, "width": 150, "height": 101}},
    )
    odd = {"x": 33, "y": 17, "width": 131, "height": 97}
    for cfa in ("RGGB", "BGGR", "GRBG", "GBRG"):
        yield shot(f"window_{cfa}", scene, {"f_number": "f/1.4"}, {"cfa": cfa, "window": odd}, again=cfa == "GBRG")
    yield shot("mono", scene, {"f_number": "f/1.4"}, {"base": "ideal"}, again=True)
    yield shot("mono_window", layers(inputs), {"f_number": "f/1.4"}, {"base": "ideal", "window": odd})
    yield shot("seeds", ramp, None, {"stages": STAGES}, seeds={"frame": 4294967295, "body": 77})
    for bits in (8, 12):
        yield shot(f"bits_{bits}", ramp, None, {"bit_depth": bits, "black_level": f"{2 ** (bits - 5)} DN"})


def scene_items(inputs: Path) -> Iterator[Item]:
    """Each kind of scene and of picture file."""
    near = {"luminance": "120 cd/m^2", "depth": "1 m"}
    for name in ("picture.hdr", "float.tif", "picture.tif", "picture.png", "picture.jpg", "picture.npy", "grey.png"):
        yield shot(f"image_{name.replace('.', '_')}", {"image": str(inputs / name), **near})
    yield shot(
        "image_mean_A",
        {"image": str(inputs / "picture.png"), **near, "luminance_of": "mean", "illuminant": "A", "encoding": "linear"},
    )
    yield shot("image_kelvin", {"image": str(inputs / "picture.exr"), **near, "illuminant": "3200 K"})
    yield shot("image_layer", {"image": str(inputs / "named.exr"), **near, "layer": "other"})
    yield shot("image_negative", {"image": str(inputs / "negative.exr"), **near})
    yield shot("image_negative_clip", {"image": str(inputs / "negative.exr"), **near, "negative": "clip"})
    yield shot("image_missing", {"image": str(inputs / "no_such.exr"), **near})
    yield shot("image_field", {"image": str(inputs / "picture.exr"), **near, "field_of_view": "12 deg"})
    inside = {"image": str(inputs / "with_depth.exr"), "luminance": "120 cd/m^2", "depth": {"channel": "Z", "unit": "m"}}
    yield shot("depth_channel", inside, {"f_number": "f/1.4"})
    along_ray = {**inside, "depth": {"channel": "Z", "unit": "m", "along": "ray"}, "field_of_view": "20 deg"}
    yield shot("depth_along_ray", along_ray, {"f_number": "f/1.4"})
    for holes in ("infinity", "nearest", None):
        depth = {"image": str(inputs / "holes.exr"), "unit": "m", **({"holes": holes} if holes else {})}
        yield shot(f"depth_holes_{holes}", near_and_far(inputs, depth=depth), {"f_number": "f/1.4"})
    cube = {"spectral_cube": str(inputs / "cube.npy"), "wavelengths": str(inputs / "wavelengths.txt"), "depth": "1 m"}
    yield shot("cube_reflectance", {**cube, "quantity": "reflectance", "luminance": "120 cd/m^2", "illuminant": "A"})
    yield shot("cube_radiance", {**cube, "quantity": "radiance", "luminance": "120 cd/m^2"})
    yield shot(
        "cube_exr",
        {"spectral_cube": str(inputs / "cube.exr"), "quantity": "reflectance", "luminance": "120 cd/m^2", "depth": "3 m"},
        {"f_number": "f/1.4"},
    )
    for chart, keys in (("color_checker", {}), ("grey_ramp", {"steps": 5}), ("flat_field", {"reflectance": 0.18})):
        yield shot(
            f"chart_{chart}",
            {"chart": chart, "luminance": "120 cd/m^2", "illuminant": "FL2", "depth": "2 m", **keys},
            {"f_number": "f/2"},
        )
    yield shot("layers", layers(inputs), {"f_number": "f/1.4"}, again=True)
    straight = {"image": str(inputs / "bars.png"), "depth": "0.6 m"}
    back = {"image": str(inputs / "picture.png"), "depth": "2 m"}
    yield shot(
        "layers_png", {"layers": [straight, back], "luminance": "120 cd/m^2", "luminance_of": "mean", "field_of_view": "14 deg"}
    )
    for most in (1, 4, 16):
        deep = {"deep": str(inputs / "deep.exr"), "depth": {"unit": "m"}, "most_layers": most, "luminance": "120 cd/m^2"}
        yield shot(f"deep_{most}", deep, {"f_number": "f/2"})
    deep = {
        "deep": str(inputs / "deep.exr"),
        "depth": {"unit": "m", "along": "ray"},
        "luminance": "120 cd/m^2",
        "field_of_view": "12 deg",
    }
    yield shot("deep_along_ray", deep, {"f_number": "f/1.4"})


def file_items(inputs: Path) -> Iterator[Item]:
    """What the raw section and the exposure say in the files."""
    scene = near_and_far(inputs)
    for payload in ("packed", "lossless_jpeg"):
        yield shot(f"payload_{payload}", scene, raw={"payload": payload, "orientation": 6})
    dated = {**EXPOSURE, "date_time": "2026-05-01 12:30:00"}
    yield shot("dated", scene, {"model": "Test 8 mm"}, exposure=dated, raw={"opcodes": False})
    yield shot("published_matrix", scene, None, {"color_matrix": {"in_dng": True}})
    yield shot("no_truth", scene, truth=[])


def library_items(inputs: Path, shot_files: list[str], cameras: list[str]) -> Iterator[Item]:
    """Each camera, and each shot file that comes with Photosite; charts in a window, the motorcycle with a picture of ours."""
    scene = {"chart": "color_checker", "luminance": "120 cd/m^2", "depth": "1 m"}
    lens = {"focal_length": "50 mm", "f_number": "f/2", "focus_distance": "2 m"}
    exposure = {"time": "1/250 s", "iso": 1600}
    for name in cameras:
        camera = {"base": name, "iso_range": "extrapolate", "window": TINY_WINDOW}
        document = {
            "name": f"camera_{name}",
            "scene": scene,
            "lens": lens,
            "exposure": exposure,
            "camera": camera,
            "truth": ALL_TRUTH,
        }
        yield Item(f"camera_{name}", document)
    for file in shot_files:
        settings: Data = {"camera.window": {"x": 1851, "y": 1133, "width": 301, "height": 253}}
        if "motorcycle" in file:
            settings["scene.image"] = str(inputs / "with_depth.exr")
        yield Item(f"file_{Path(file).stem}", file=file, settings=settings)


def command_items() -> Iterator[Item]:
    """Commands on shots: sweeps, resimulation, development, inspection, calibration, messages."""
    device = ("--device", "{device}")
    take = ("photosite", "simulate", "{shots}/layers.yaml", "--out", ".", *device)
    yield Item("command_resimulate", commands=(take, ("photosite", "resimulate", "layers.dng", "--out", "again", *device)))
    outputs = [
        ("develop", "layers.dng", "--output", output, "--out", f"{output}.tif")
        for output in ("srgb", "linear_srgb", "xyz", "metric")
    ]
    views = [
        ("inspect", "layers.dng", "--json"),
        ("inspect", "layers.dng"),
        ("develop", "layers.dng", "--white-balance", "20,20,30,30"),
    ]
    yield Item("command_develop", commands=(take, *(("photosite", *words) for words in (*outputs, *views))))
    size = "camera={base: sony_a7s2, window: {x: 1900, y: 1200, width: 150, height: 120}}"
    sweep = ("photosite", "simulate", "{checkout}/configs/shots/iso_sweep.yaml", "--set", size, "--out", ".", *device)
    yield Item("command_sweep_zip", commands=(sweep, sweep))
    product = ("photosite", "simulate", "{shots}/sweep_product.yaml", "--out", ".", *device)
    yield Item("command_sweep_product", commands=(product, (*product, "--redo")))
    yield Item(
        "command_singlet", commands=(("photosite", "simulate", "{checkout}/configs/shots/singlet.yaml", "--out", ".", *device),)
    )
    yield Item(
        "command_noise_check", commands=(("photosite", "validate", "noise", "ideal", "--iso", "100", "--out", ".", *device),)
    )
    wrong = (
        "lens.f_number=2.8",
        "lens.colour=red",
        "camera=no_such",
        "exposure.iso=99999999",
        "scene.image=nowhere.exr",
        "tolerance=11",
        "seeds.frame=-1",
    )
    told = tuple(("photosite", "simulate", "{shots}/layers.yaml", "--set", setting, "--out", ".", *device) for setting in wrong)
    yield Item("command_messages", commands=told)
    yield Item("command_motorcycle", commands=(("data_gen", "motorcycle", "motorcycle.exr"),))
    named = ("layers", "diffraction_depth", "stages_all", "pinhole", "bare_sensor", "cats_eyes")
    yield Item(
        "wording_explain", commands=tuple(("photosite", "explain", f"{{shots}}/{name}.yaml") for name in named), wording=True
    )
    yield Item("wording_schema", commands=(("photosite", "schema"),), wording=True)


SWEEP_PRODUCT = {
    "sweep": {
        "mode": "product",
        "vary": {"lens.f_number": ["f/2", "f/8"], "exposure.iso": [100, 800], "seeds.frame": {"range": [0, 2]}},
    },
}


def sweep_product(inputs: Path) -> Data:
    """Return a shot file of eight points."""
    return {**shot("sweep_product", near_and_far(inputs)).document, **SWEEP_PRODUCT}


DRAWINGS = {
    "procedural": ["dead_leaves", "text", "point_lights"],
    "count": 12,
    "width": 96,
    "height": 80,
    "illuminants": ["D65", "A"],
}
MEASURED = {"cameras": {"sony_a7s2": {"iso": {"measured": [800, 25600]}, "weight": 2}, "imx385": {}}, "exposure_time": "1/30 s"}


def dataset_documents(inputs: Path) -> dict[str, Data]:
    """Return data sets of every mode, prior, format and kind of picture, by name."""
    base = {
        "count": 9,
        "seed": 5,
        "crop": [40, 48],
        "pictures": {"drawings": DRAWINGS},
        "noise": MEASURED,
        "exposure_ratio": {"uniform": [1, 30]},
    }

    def made(format_name: str = "npz", channels: str = "mosaic", **settings: Any) -> Data:
        return {**base, "writer": {"format": format_name, "channels": channels, "samples_per_shard": 4}, **settings}

    flat = {key: value for key, value in base.items() if key not in ("pictures",)}
    writer = {"format": "npz", "samples_per_shard": 5}
    kinds = {
        "photographs": {"photographs": str(inputs / "photographs"), "inverse_isp": "camera"},
        "unprocessed": {"photographs": str(inputs / "photographs"), "inverse_isp": "brooks2019", "downscale": 2},
        "linear": {"linear_images": str(inputs / "linear")},
        "cubes": {
            "spectral_cubes": str(inputs / "cubes"),
            "wavelengths": str(inputs / "wavelengths.txt"),
            "quantity": "reflectance",
        },
    }
    documents = {
        "single": made("webdataset", "rggb", variance=True),
        "burst": made("npz", mode="burst", burst={"frames": 3, "shift": {"normal": [0, 1]}}),
        "dark": {**flat, "mode": "dark", "writer": writer, "bodies": 2},
        "noise_only": {**flat, "mode": "noise_only", "noise_only": {"level": {"log_uniform": [0.001, 1]}}, "writer": writer},
        "multi_exposure": made("hdf5", mode="multi_exposure", multi_exposure={"ratios": [1, 4, 16]}),
        "mixed": made("webdataset", "rgbg", pictures=kinds, crops_per_picture=2, crop=[32, 32]),
        "shots": made("npz", pictures={"layers": {"shot": "{shots}/layers.yaml"}}, count=4),
        **{f"format_{name}": made(name) for name in ("zarr", "lmdb", "dng")},
        "format_eld": made("eld", "rgbg"),
    }
    for prior in ("unprocessing", "cycleisp", "eld", "pmn", "led"):
        drawn = {key: value for key, value in made().items() if key != "exposure_ratio"}
        documents[f"prior_{prior}"] = {**drawn, "noise": {"prior": prior, "camera": "sony_a7s2"}}
    return documents


def dataset_items(dataset_files: list[str]) -> Iterator[Item]:
    """Data sets; those that come with Photosite shortened."""
    device = ("--device", "{device}")
    for name in dataset_documents(Path()):
        make = ("photosite", "dataset", f"{{shots}}/dataset_{name}.yaml", "--out", ".", *device)
        verify = (
            (("photosite", "dataset", f"{{shots}}/dataset_{name}.yaml", "--out", ".", "--verify"),) if name == "single" else ()
        )
        yield Item(f"dataset_{name}", commands=(make, *verify))
    for file in dataset_files:
        short = ("--set", "count=5", "--set", "crop=[128, 128]", "--set", "writer.samples_per_shard=5")
        yield Item(
            f"dataset_file_{Path(file).stem}",
            commands=(("photosite", "dataset", f"{{checkout}}/{file}", "--out", ".", *short, *device),),
        )


def full_size_items(inputs: Path) -> Iterator[Item]:
    """Frames of 12 megapixels: a photograph on a picture of ours, and the demonstration, which needs scikit-image."""
    settings = {"scene.image": str(inputs / "with_depth.exr")}
    yield Item("full_motorcycle", file="configs/shots/motorcycle_wide_open.yaml", settings=settings)
    yield Item("full_demo", commands=(("{checkout}/examples/demo.py", "--out", "."),))
