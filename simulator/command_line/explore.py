"""`photosite explore`: a page on which the controls of a shot are turned."""

import asyncio
import webbrowser
from pathlib import Path

from simulator.command_line.screen import tell
from simulator.config import parse_override, shipped_names
from simulator.device import open_device
from simulator.errors import PhotositeError
from simulator.explore.explorer import Explorer
from simulator.explore.opened_shot import OpenedShot


def explore_shot(shot: Path, settings: list[str], port: int, browse: bool, device: str | None) -> None:
    """Serve the page of a shot until Ctrl-C.

    settings: PATH=VALUE of the command line, for that shot. port: 0 takes a free one. browse: open the page in a browser.
    Raises PhotositeError for a shot that cannot be read, without an OpenCL device or tornado, and where the port is taken.
    """
    try:
        from simulator.explore.server import HOST, make_server
    except ImportError:
        rule = "needs the package tornado; install photosite[explore]"
        raise PhotositeError(rule, key="photosite explore") from None
    first = OpenedShot(str(shot), {key: value for key, value, _ in map(parse_override, settings)})
    first.check()
    open_device(device)
    others = [one for name in shipped_names("shots") if name != shot.stem and (one := OpenedShot(name)).is_complete()]
    explorer = Explorer([first, *others], device)

    async def serve() -> None:
        try:
            server, bound = make_server(explorer, port)
        except OSError as error:
            raise PhotositeError(
                f"{error.strerror}; give another --port, or 0 for a free one", key="port", value=port
            ) from None
        address = f"http://{HOST}:{bound}/"
        tell(f"{address} shows {shot}; Ctrl-C ends it")
        if browse:
            webbrowser.open(address)
        try:
            await asyncio.Event().wait()
        finally:
            server.stop()

    try:
        asyncio.run(serve())
    except KeyboardInterrupt:
        tell("ended")
