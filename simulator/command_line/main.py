"""The command `photosite`.

Heavy modules are imported inside the commands: `photosite --help` must not wait for OpenCL, pint or colour.
"""

import io
import os
import sys

from simulator.command_line.commands import app
from simulator.command_line.garbage import search_seldom
from simulator.errors import PhotositeError


def main(arguments: list[str] | None = None) -> None:
    """Run the command and end the process.

    Exit status: 0 done, 1 an error of one line on stderr, 2 a wrong option, 130 interrupted.
    PHOTOSITE_DEBUG=1 in the environment shows the traceback of an error.
    """
    search_seldom()
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "1")  # else it looks for them in all packages that are installed
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")  # of letters that a terminal lacks, and of paths that are no UTF-8
    try:
        app(args=arguments, prog_name="photosite")
    except KeyboardInterrupt:
        sys.exit(130)
    except (PhotositeError, OSError, MemoryError) as error:
        if os.environ.get("PHOTOSITE_DEBUG"):
            raise
        print(f"error: {_one_message(error)}", file=sys.stderr)
        sys.exit(1)


def _one_message(error: BaseException) -> str:
    if isinstance(error, PhotositeError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"out of memory ({error}); use a smaller camera.window".replace(" ()", "")
    return f"{error.filename}: {error.strerror}" if isinstance(error, OSError) and error.filename else str(error)
