"""The command `photosite`."""
