"""Exposure: what the photographer sets on the shutter and the ISO dial."""
