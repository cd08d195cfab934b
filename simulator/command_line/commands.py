"""All commands of `photosite`. Each module adds its own to the application; their order is that of the help."""

# isort: off
from simulator.command_line import frame_commands, plan_commands, study_commands, camera_commands
# isort: on

from simulator.command_line.app import app

__all__ = ["app", "camera_commands", "frame_commands", "plan_commands", "study_commands"]
