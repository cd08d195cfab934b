"""The report of a study: one page that holds its figures, pictures, numbers and provenance."""
