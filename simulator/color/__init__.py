"""Colour: spectra, the colour matrices of cameras, and the measured tables of colour-science."""
