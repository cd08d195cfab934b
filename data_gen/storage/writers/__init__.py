"""File formats of a data set."""
