"""The pupil: its shape, how rims clip it by place on the sensor, and points on it."""
