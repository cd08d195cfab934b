"""The sensor's stages, for `Camera.stages`: one frozen dataclass each. docs/sensor.md has their numbers and sources."""

from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
