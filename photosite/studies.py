"""Studies: a shot at many points, each measured; `run_study` makes one, `load` reads its results."""

from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
