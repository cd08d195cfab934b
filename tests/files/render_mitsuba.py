"""Render tests/files/mitsuba.exr with Mitsuba 3 (3.9.1 was used): python tests/files/render_mitsuba.py.

A wall at 4 m with an edge, a ball before it, nothing beside the wall; colour, length of the rays, and positions.
"""

from pathlib import Path

import mitsuba as mi

SIZE = (24, 16)


def scene() -> dict[str, object]:
    """Return the scene; the camera looks along +z from the origin."""
    place = mi.ScalarTransform4f
    return {
        "type": "scene",
        "integrator": {"type": "aov", "aovs": "dd:depth,pos:position", "image": {"type": "path", "max_depth": 3}},
        "sensor": {
            "type": "perspective",
            "fov": 50,
            "near_clip": 0.5,
            "to_world": place().look_at(origin=[0, 0, 0], target=[0, 0, 1], up=[0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": SIZE[0],
                "height": SIZE[1],
                "rfilter": {"type": "box"},
                "pixel_format": "rgba",
                "component_format": "float32",
            },
            "sampler": {"type": "multijitter", "sample_count": 256},
        },
        "wall": {
            "type": "rectangle",
            "to_world": place().translate([0.8, 0, 4]).rotate([0, 1, 0], 180).scale([2.0, 3, 1]),
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.5, 0.8]}},
        },
        "ball": {
            "type": "sphere",
            "center": [-0.2, 0, 2.5],
            "radius": 0.4,
            "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.3, 0.1]}},
        },
        "lamp": {"type": "point", "position": [0, 1, 0], "intensity": {"type": "rgb", "value": 10.0}},
    }


if __name__ == "__main__":
    mi.set_variant("scalar_rgb")
    rendered = mi.load_dict(scene())
    mi.render(rendered)
    rendered.sensors()[0].film().bitmap().write(str(Path(__file__).with_name("mitsuba.exr")))
