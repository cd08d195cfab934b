"""What stands before the lens: radiance as planes times spectra, with depth."""
