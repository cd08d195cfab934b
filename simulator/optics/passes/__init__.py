"""Executes the planned lens blur on the device."""
