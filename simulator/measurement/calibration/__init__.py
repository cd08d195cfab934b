"""From a user's raw files to a camera file: what the files are, what they tell, and how far to trust it."""
