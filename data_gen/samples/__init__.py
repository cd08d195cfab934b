"""Samples: clean and noisy patches, their records and tensors."""
