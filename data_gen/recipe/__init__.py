"""What a data set is drawn from: its file, distributions, priors and random streams."""
