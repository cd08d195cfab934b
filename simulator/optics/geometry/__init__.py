"""Where light falls on the sensor: projection and distortion."""
