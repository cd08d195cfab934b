"""The page on which a photographer turns the controls of a shot: `photosite explore`."""
