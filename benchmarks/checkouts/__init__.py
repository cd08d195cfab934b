"""Two checkouts of Photosite beside each other: the same bits, and no slower. Run by compare_checkouts.py of this folder."""
