"""From a shot to a raw frame: the plan and its execution."""
