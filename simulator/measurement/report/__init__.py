"""Figures that reports share."""
