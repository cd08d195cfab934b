"""Files that leave the simulator, and what is read back from raw files."""
