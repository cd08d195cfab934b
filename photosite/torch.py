"""Pairs inside a PyTorch DataLoader. docs/dataset.md says how. Needs `pip install 'photosite[torch]'`."""

from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
