"""Photosite: how a camera makes a raw file, from scene radiance through lens, exposure and sensor to the codes of a DNG.

    >>> import photosite
    >>> shot = photosite.load_shot("color_checker", {"exposure.iso": 400})
    >>> raw = photosite.simulate(shot)
    >>> photosite.save(raw, "out")

docs/python.md says what each name is for. Names are imported when they are first used, so that importing the package costs
nothing. `__init__.pyi` lists them.
"""

from simulator import __version__ as __version__
from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
