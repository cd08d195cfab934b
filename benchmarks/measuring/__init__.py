"""What every benchmark shares: the work, interleaved timing, and the report."""
