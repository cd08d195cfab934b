"""The scene before the lens: radiance as planes times spectra, with depth."""
