"""The sensor: its camera, its stages, and the kernel that runs them."""
