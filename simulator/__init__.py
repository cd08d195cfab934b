"""The simulator's modules. The public face is `photosite`, which has all names; the few below are here, too.

    >>> from simulator import develop, load_shot, save, simulate
    >>> raw = simulate(load_shot("color_checker", ["exposure.iso=400"]))

Names are imported when they are first used, so that importing the package costs nothing. `__init__.pyi` lists them.
"""

from simulator.lazy_names import lazy_names

__version__ = "0.1.0"

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
