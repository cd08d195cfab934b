"""A headless Chromium, driven through its DevTools protocol, without a network."""

import asyncio
import base64
import json
import os
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tornado.httpclient import AsyncHTTPClient
from tornado.websocket import websocket_connect

MOST_S = 60.0
WIDTHS = {"desktop": (1280, 900, False), "phone": (390, 844, True)}  # CSS pixels across and down, and whether it is a phone


@dataclass
class Seen:
    """What a browser shows of a page at one size.

    requests: addresses that it asked for. errors: messages of its console, and exceptions. overflow_px: how much wider than the
    window the page is. broken: pictures without pixels. text: that is visible. png: of the whole page.
    """

    requests: list[str] = field(default_factory=list)
    errors: list[str] = field(default_factory=list)
    overflow_px: int = 0
    broken: int = 0
    text: str = ""
    png: bytes = b""


def look_at(browser: str, page: Path) -> dict[str, Seen]:
    """Open a page at all sizes of WIDTHS."""
    with started(browser) as port:
        return asyncio.run(_look(port, page))


@contextmanager
def started(browser: str) -> Iterator[int]:
    with tempfile.TemporaryDirectory(prefix="photosite-browser-", ignore_cleanup_errors=True) as folder:
        options = ["--headless", "--disable-gpu", "--remote-debugging-port=0", "--no-first-run", "--hide-scrollbars"]
        options += ["--host-resolver-rules=MAP * ~NOTFOUND , EXCLUDE 127.0.0.1", "--no-proxy-server"]
        options += ["--no-sandbox"] * (os.geteuid() == 0)
        process = subprocess.Popen([browser, *options, f"--user-data-dir={folder}"], stderr=subprocess.PIPE, text=True)
        try:
            assert process.stderr is not None
            for line in process.stderr:
                if "DevTools listening on ws://" in line:
                    yield int(line.rpartition(":")[2].partition("/")[0])
                    break
            else:
                raise AssertionError(f"{browser} did not start")
        finally:
            process.terminate()
            process.wait(MOST_S)


async def _look(port: int, page: Path) -> dict[str, Seen]:
    found = {}
    for name, (width, height, is_phone) in WIDTHS.items():
        session = await open_session(port)
        offline = {"offline": True, "latency": 0, "downloadThroughput": -1, "uploadThroughput": -1}
        await session.ask("Network.emulateNetworkConditions", **offline)
        await session.resize(width, height, is_phone)
        await session.open(page.absolute().as_uri())
        found[name] = await session.look()
        session.socket.close()
    return found


async def open_session(port: int) -> "Session":
    """Open an empty tab of the browser on this port of its protocol."""
    answer = await AsyncHTTPClient().fetch(f"http://127.0.0.1:{port}/json/new?about:blank", method="PUT", body="")
    socket = await websocket_connect(json.loads(answer.body)["webSocketDebuggerUrl"], max_message_size=2**28)
    session = Session(socket, Seen())
    for domain in ("Page", "Network", "Runtime", "Log"):
        await session.ask(f"{domain}.enable")
    return session


@dataclass
class Session:
    """A tab. seen: what it showed. last: number of the last call. events: names of the events so far."""

    socket: Any
    seen: Seen
    last: int = 0
    events: list[str] = field(default_factory=list)

    async def ask(self, method: str, **parameters: object) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        self.last += 1
        await self.socket.write_message(json.dumps({"id": self.last, "method": method, "params": parameters}))
        while (message := await self._read()).get("id") != self.last:
            pass
        assert "error" not in message, message
        result: dict[str, Any] = message["result"]
        return result

    async def wait_for(self, event: str) -> None:
        while event not in self.events:
            await self._read()

    async def resize(self, width: int, height: int, is_phone: bool) -> None:
        """Give the tab a size in CSS pixels."""
        size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": is_phone}
        await self.ask("Emulation.setDeviceMetricsOverride", **size)

    async def open(self, address: str) -> None:
        """Load a page."""
        await self.ask("Page.navigate", url=address)
        await self.wait_for("Page.loadEventFired")

    async def value(self, expression: str) -> Any:
        """Evaluate JavaScript."""
        answer = await self.ask("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    async def until(self, condition: str) -> None:
        """Wait until an expression of JavaScript is true."""
        for _ in range(int(MOST_S / 0.05)):
            if await self.value(f"Boolean({condition})"):
                return
            await asyncio.sleep(0.05)
        raise AssertionError(f"never came true: {condition}")

    async def look(self) -> Seen:
        """Look at the page that is loaded."""
        seen = self.seen
        seen.overflow_px = await self.value("document.documentElement.scrollWidth - window.innerWidth")
        seen.broken = await self.value("[...document.images].filter(one => !one.naturalWidth).length")
        seen.text = await self.value("document.body.innerText")
        picture = await self.ask("Page.captureScreenshot", captureBeyondViewport=True, format="png")
        seen.png = base64.b64decode(picture["data"])
        return seen

    async def _read(self) -> dict[str, Any]:
        """Read one message; keep what it tells of requests and errors."""
        text = await asyncio.wait_for(self.socket.read_message(), MOST_S)
        message: dict[str, Any] = json.loads(text)
        method, parameters = message.get("method", ""), message.get("params", {})
        self.events.append(method)
        if method == "Network.requestWillBeSent":
            self.seen.requests.append(parameters["request"]["url"])
        elif method == "Runtime.exceptionThrown":
            self.seen.errors.append(str(parameters["exceptionDetails"]))
        elif method == "Runtime.consoleAPICalled":
            self.seen.errors.append(str(parameters["args"]))
        elif method == "Log.entryAdded":
            self.seen.errors.append(str(parameters["entry"]["text"]))
        return message
