"""The blur by rays through the lens, which faster methods are compared with."""
