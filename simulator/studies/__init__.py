"""Studies that take many shots."""
