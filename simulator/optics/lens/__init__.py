"""What forms the image: focus, field of view and light of one lens object."""
