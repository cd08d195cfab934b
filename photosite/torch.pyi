# pyright: basic
# PyTorch may not be installed, so that its types are not known.
from data_gen.torch import LivePairs as LivePairs
from data_gen.torch import StoredPairs as StoredPairs
from data_gen.torch import loader as loader
