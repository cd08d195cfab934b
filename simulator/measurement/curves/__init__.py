"""Curves of a camera and a lens from their own models: signal-to-noise ratio, noise, dynamic range, MTF, blur."""
