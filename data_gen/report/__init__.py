"""What a data set tells of itself: data card, figures, estimate."""
