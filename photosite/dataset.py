"""Data sets of clean and noisy raw frames for training. docs/dataset.md has the file, the modes and the priors."""

from simulator import lazy_names

__getattr__, __dir__, __all__ = lazy_names(__name__, __file__)
