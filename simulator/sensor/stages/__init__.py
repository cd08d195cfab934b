"""One frozen dataclass per stage of the sensor, one header of the same stem in kernels/."""
