"""From the wavefront in the exit pupil, or a file, to point spread functions on photosites."""
