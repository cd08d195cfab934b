"""Audit of the promise: the error of random shots beside the one that their plans state."""
