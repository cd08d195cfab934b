"""Stress: searches for the inputs at which a kernel is farthest from float64. Run it with `make stress`."""
