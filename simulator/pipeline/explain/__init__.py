"""Predictions from a plan before the shot is simulated: photometry of a grey patch, and the noise budget."""
