"""What a data set is drawn from: its file, priors and recipes."""
