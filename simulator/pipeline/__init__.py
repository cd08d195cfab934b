"""From a shot to a raw image: the plan and its execution."""
