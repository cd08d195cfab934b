"""What a plan says of a shot before it is taken: steps, noise, ISO speed."""
