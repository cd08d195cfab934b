"""The fused sensor kernel: how it is built, launched and cut into tiles."""
