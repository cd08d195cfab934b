"""One file per contestant: each makes the same frame in its own way, as its users write it.

`contestant(mean_e, sensor)` gives a measuring.contest.Contestant. A package that is missing is an ImportError.
"""
