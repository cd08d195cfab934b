"""Real lenses: from the wavefront in the exit pupil to point spread functions on photosites."""
