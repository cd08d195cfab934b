"""What raw frames tell about a camera: photon transfer, EMVA 1288, edges, and a camera measured from its files."""

from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
