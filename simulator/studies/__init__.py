"""Studies that take many shots: `run_study` makes one, `load` reads its results.

Names are imported when they are first used: a single shot, which reads a module of this folder, waits for no measurement.
"""

from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
