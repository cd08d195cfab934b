"""Cameras measured back from the raw files they make, and compared with the numbers put in."""
