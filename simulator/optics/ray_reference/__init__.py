"""The reference blur: rays through the lens, which faster methods are compared with."""
