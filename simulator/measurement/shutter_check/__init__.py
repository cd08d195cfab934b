"""Shutters measured back from raw files of a lamp, a flash, steady light and things that move."""
