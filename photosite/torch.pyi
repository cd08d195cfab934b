from data_gen.torch import LivePairs as LivePairs
from data_gen.torch import StoredPairs as StoredPairs
from data_gen.torch import loader as loader
