"""What reports share: checks against stated numbers, figures, and tables of pages."""
