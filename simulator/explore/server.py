"""The server of the page: on loopback alone, one request at a time, the latest wins."""

import asyncio
import json
import struct
from collections.abc import Coroutine, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast, get_args

import tornado.httpserver
import tornado.netutil
import tornado.web
import tornado.websocket
from tornado.log import app_log

from simulator.errors import PhotositeError, reading
from simulator.explore.explorer import Answer, Explorer, Request, SupersededError, Want

HOST = "127.0.0.1"
PAGE = Path(__file__).parent / "page"
TYPES = {"index.html": "text/html", "explore.css": "text/css", "explore.js": "text/javascript"}
LARGEST_MESSAGE = 2**14  # bytes of a request
MOST_PAGES = 4  # that are open at a time
# Nothing from elsewhere: no script, style, picture or connection but of this server.
POLICY = "; ".join(
    [
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'self'",
        "frame-ancestors 'none'",
    ]
)


@dataclass
class Desk:
    """What the handlers share.

    explorer: answers. worker: its one thread. pages: sockets that are open. urgent: requests that wait and for which the whole
    frame of another page gives way. is_ending: whether no answer is wanted any more.
    """

    explorer: Explorer
    port: int = 0
    worker: ThreadPoolExecutor = field(default_factory=lambda: ThreadPoolExecutor(1))
    pages: int = 0
    urgent: set[object] = field(default_factory=set)
    is_ending: bool = False

    def hosts(self) -> set[str]:
        """Return the values of the Host header that name this server."""
        return {f"{HOST}:{self.port}", f"localhost:{self.port}"}

    def is_own(self, host: str | None, origin: str | None) -> bool:
        """Whether a request was sent to this server's name, and by its own page where a page sent it (DNS rebinding)."""
        return host in self.hosts() and (origin is None or origin in {f"http://{own}" for own in self.hosts()})


class Guarded(tornado.web.RequestHandler):
    """A handler that answers requests to this server's own name from its own page alone."""

    def initialize(self, desk: Desk) -> None:
        """Take what the handlers share."""
        self.desk = desk

    def set_default_headers(self) -> None:
        """Keep the browser from loading, guessing or framing anything."""
        self.set_header("Content-Security-Policy", POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Referrer-Policy", "no-referrer")
        self.set_header("Cache-Control", "no-store")
        self.clear_header("Server")

    def prepare(self) -> None:
        """Refuse a foreign Host or Origin with 403."""
        headers = self.request.headers
        if not self.desk.is_own(headers.get("Host"), headers.get("Origin")):
            raise tornado.web.HTTPError(403)

    def write_error(self, status_code: int, **kwargs: Any) -> None:
        """Answer with the status and one line, never a traceback."""
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(f"{status_code} {self._reason}\n")


class PageFile(Guarded):
    """The page, its style and its script."""

    def get(self, name: str) -> None:
        """Answer with a file of the page."""
        name = name or "index.html"
        if name not in TYPES:
            raise tornado.web.HTTPError(404)
        self.set_header("Content-Type", f"{TYPES[name]}; charset=utf-8")
        self.finish((PAGE / name).read_bytes())


class Download(Guarded):
    """A view as a file: its DNG, or the YAML that takes it again."""

    async def post(self, kind: str) -> None:
        """Answer with the file of the view in the body."""
        try:
            request = read_request(self.request.body)
            opened = self.desk.explorer.opened(request.shot)
            if kind == "dng":
                work = self.desk.worker.submit(self.desk.explorer.dng, request, lambda: self.desk.is_ending)
                data = await asyncio.wrap_future(work)
            else:
                data = opened.yaml(request.settings).encode()
        except SupersededError:
            raise tornado.web.HTTPError(503) from None
        except (PhotositeError, OSError, MemoryError) as error:
            self.set_status(422)
            self.set_header("Content-Type", "text/plain; charset=utf-8")
            self.finish(describe_error(error))
            return
        self.set_header("Content-Type", "image/x-adobe-dng" if kind == "dng" else "text/yaml; charset=utf-8")
        self.finish(data)


class Socket(tornado.websocket.WebSocketHandler):
    """The connection of one page: the last request is answered, those before it are dropped."""

    def initialize(self, desk: Desk) -> None:
        """Take what the handlers share."""
        self.desk, self.is_busy, self.is_counted, self.is_closed = desk, False, False, False
        self.wanted: tuple[int, Request] | None = None
        self.tasks: set[asyncio.Future[None]] = set()

    def prepare(self) -> None:
        """Refuse a foreign Host with 403, and a page too many with 503."""
        if not self.desk.is_own(self.request.headers.get("Host"), self.request.headers.get("Origin")):
            raise tornado.web.HTTPError(403)
        if self.desk.pages >= MOST_PAGES:
            raise tornado.web.HTTPError(503)

    def check_origin(self, origin: str) -> bool:
        """Whether a page of this server asks."""
        return self.desk.is_own(self.request.headers.get("Host"), origin)

    def open(self, *args: str, **kwargs: str) -> None:
        """Send the names of the shots."""
        self.desk.pages, self.is_counted = self.desk.pages + 1, True
        self.set_nodelay(True)
        names = self.desk.explorer.names()
        self._send({"kind": "shots", "shots": names})

    def on_close(self) -> None:
        """Drop what was asked for."""
        self.wanted, self.is_closed = None, True
        if self.is_counted:
            self.desk.pages, self.is_counted = self.desk.pages - 1, False

    def on_message(self, message: str | bytes) -> None:
        """Take a request in place of one that waits. Its work goes on beside: Tornado reads the next message when this ends."""
        try:
            number = int(read_message(message)["number"])
            self.wanted = number, read_request(message)
        except (PhotositeError, ValueError, KeyError, TypeError) as error:
            self._send({"kind": "refused", "message": f"not understood: {without_folders(str(error))}"})
            return
        if not self.is_busy:
            self.is_busy = True
            self._begin(self._answer_all())

    def _begin(self, work: Coroutine[Any, Any, None]) -> None:
        """Begin work and hold it until it is done."""
        task = asyncio.ensure_future(work)
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    async def _answer_all(self) -> None:
        """Answer until no request waits."""
        try:
            while self.wanted is not None:
                await self._answer()
        finally:
            self.is_busy = False

    async def _answer(self) -> None:
        """Answer the request that waits."""
        assert self.wanted is not None
        (number, request), self.wanted = self.wanted, None
        try:
            found = await self._take(request)
            command = self.desk.explorer.opened(request.shot).command(request.settings)
        except SupersededError:
            if self.wanted is None and not self.is_closed and not self.desk.is_ending:
                self.wanted = number, request  # it gave way to another page, and is taken again
            return
        except Exception as error:  # the page tells it; a fault of the program is logged, too
            if not isinstance(error, PhotositeError | OSError | MemoryError):
                app_log.error("photosite explore", exc_info=True)
            message = {"kind": "error", "number": number, "want": request.want, "message": describe_error(error)}
            return self._send(message)
        height, width = found.pixels.shape[:2]
        kind = "controls" if request.want == "controls" else "picture"
        head = {"kind": kind, "number": number, "want": request.want, "shot": request.shot, "width": width, "height": height}
        self._send(head | {"data": found.data, "command": command}, found.pixels.tobytes())

    async def _take(self, request: Request) -> Answer:
        """Return the answer to a request, which a newer one ends; a whole frame gives way to what other pages wait for."""
        ticket = object()
        if request.want != "frame":
            self.desk.urgent.add(ticket)

        def is_stale() -> bool:
            gives_way = request.want == "frame" and bool(self.desk.urgent)
            return self.wanted is not None or self.is_closed or self.desk.is_ending or gives_way

        def work() -> Answer:
            self.desk.urgent.discard(ticket)
            return self.desk.explorer.answer(request, is_stale)

        return await asyncio.wrap_future(self.desk.worker.submit(work))

    def _send(self, head: Mapping[str, Any], pixels: bytes = b"") -> None:
        """Send a head as JSON and pixels behind it: bytes of the head (uint32, little endian), head, pixels."""
        text = json.dumps(head, allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        try:
            self.write_message(struct.pack("<I", len(text)) + text + pixels, binary=True)
        except tornado.websocket.WebSocketClosedError:
            self.wanted = None


def read_message(message: str | bytes) -> Any:
    """Return what a message of a page holds. Raises PhotositeError for one that is no JSON."""
    with reading("message", "send JSON, as the page does", key="request"):
        return json.loads(message)


def read_request(message: str | bytes) -> Request:
    """Return the request that a page sent. Raises PhotositeError for anything else."""
    refused = PhotositeError("give want, shot, settings and at, as the page does", key="request")
    try:
        data = read_message(message)
        want, shot, settings = data.get("want", "preview"), data["shot"], data["settings"]
        across, down = (float(share) for share in data.get("at", (0.5, 0.5)))
    except (ValueError, KeyError, TypeError, AttributeError):
        raise refused from None
    is_moving = data.get("is_moving", False)
    is_right = want in get_args(Want) and isinstance(shot, str) and isinstance(settings, dict) and isinstance(is_moving, bool)
    if not (is_right and 0 <= across <= 1 and 0 <= down <= 1):
        raise refused
    return Request(cast(Want, want), shot, settings, (across, down), is_moving)


def describe_error(error: Exception) -> str:
    """Return the message of an error as a page may show it."""
    return without_folders(str(error) if isinstance(error, PhotositeError) else f"{type(error).__name__}: {error}")


def without_folders(message: str) -> str:
    """Return a message with the names of files alone, since their folders are the machine's own business."""
    words = (word.rpartition("/")[2] if word.startswith("/") and len(word) > 1 else word for word in message.split(" "))
    return " ".join(words)


@dataclass
class Service:
    """A server that listens, and its desk."""

    server: tornado.httpserver.HTTPServer
    desk: Desk

    def stop(self) -> None:
        """Listen no more, and end the work that goes on at its next step."""
        self.server.stop()
        self.desk.is_ending = True
        self.desk.worker.shutdown(wait=False, cancel_futures=True)


def make_server(explorer: Explorer, port: int = 0) -> tuple[Service, int]:
    """Return a server that listens on loopback, and its port; it answers once an event loop runs.

    port: 0 takes a free one. Raises OSError where the port is taken.
    """
    desk = Desk(explorer)
    shared = {"desk": desk}
    routes: list[Any] = [
        (r"/socket", Socket, shared),
        (r"/view\.(dng|yaml)", Download, shared),
        (r"/([a-z.]*)", PageFile, shared),
    ]
    application = tornado.web.Application(routes, websocket_max_message_size=LARGEST_MESSAGE)
    server = tornado.httpserver.HTTPServer(application, max_body_size=LARGEST_MESSAGE, max_header_size=2**15)
    sockets = tornado.netutil.bind_sockets(port, HOST)
    server.add_sockets(sockets)
    desk.port = sockets[0].getsockname()[1]
    return Service(server, desk), desk.port
