"""A good shot file, to be spoilt in every way."""

SHOT = """\
scene:
  image: good.exr
  depth: 2 m
  luminance: 120 cd/m^2
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 64, height: 48}}
"""
