"""Scenes and data sets for denoisers, made with the simulator."""
