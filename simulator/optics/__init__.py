"""From the scene to the light on the sensor: lens, pupil, geometry, defocus, point spread functions, glare."""
