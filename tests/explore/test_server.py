"""The server answers its own page alone, the latest request first, and tells nothing of the machine."""

import asyncio
import json
import struct
import time

import numpy as np
import pytest
from helpers.explore_shots import write_shot

tornado = pytest.importorskip("tornado", reason="the extra `explore` is not installed")

from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest  # noqa: E402  # after the skip
from tornado.websocket import websocket_connect  # noqa: E402

from simulator.errors import PhotositeError  # noqa: E402
from simulator.explore.explorer import Answer, Explorer, SupersededError  # noqa: E402
from simulator.explore.opened_shot import OpenedShot  # noqa: E402
from simulator.explore.server import MOST_PAGES, make_server, read_request, without_folders  # noqa: E402


@pytest.fixture(scope="module")
def explorer(tmp_path_factory):
    return Explorer([OpenedShot(str(write_shot(tmp_path_factory.mktemp("shot")))), OpenedShot("color_checker")])


def served(explorer, visit):
    """Run a coroutine function with the address and the shots' names beside the server."""

    async def run():
        server, port = make_server(explorer)
        try:
            return await visit(f"127.0.0.1:{port}", explorer.names())
        finally:
            server.stop()

    return asyncio.run(run())


async def status(address, path="", method="GET", body=None, **headers):
    request = HTTPRequest(f"http://{address}/{path}", method=method, body=body, headers=headers)
    try:
        answer = await AsyncHTTPClient().fetch(request)
    except HTTPClientError as error:
        return error.code, error.response.body.decode() if error.response else ""
    return answer.code, answer.body


async def read(socket):
    message = await asyncio.wait_for(socket.read_message(), 120)
    (length,) = struct.unpack_from("<I", message)
    return json.loads(message[4 : 4 + length]), message[4 + length :]


def test_a_foreign_page_or_name_is_refused_everywhere(explorer):
    async def visit(address, names):
        foreign = [{"Origin": "http://evil.example"}, {"Host": "evil.example"}, {"Origin": "null"}]
        body = json.dumps({"shot": names[1], "settings": {}})
        for headers in foreign:
            for path, method, sent in (("", "GET", None), ("explore.js", "GET", None), ("view.yaml", "POST", body)):
                assert (await status(address, path, method, sent, **headers))[0] == 403
            with pytest.raises(HTTPClientError) as refused:
                await websocket_connect(HTTPRequest(f"ws://{address}/socket", headers=headers))
            assert refused.value.code == 403
        own = await status(address, "view.yaml", "POST", body, Origin=f"http://{address}")
        assert own[0] == 200 and b"color_checker" in own[1]

    served(explorer, visit)


def test_nothing_but_the_page_is_served(explorer):
    async def visit(address, names):
        assert (await status(address))[0] == 200
        for path in ("server.py", "../server.py", "%2e%2e/server.py", "page/index.html", "etc/passwd", "explore.js/"):
            code, text = await status(address, path)
            assert code in (400, 404) and "Traceback" not in str(text)

    served(explorer, visit)


def test_of_many_requests_the_last_is_answered_and_few_others(explorer):
    async def visit(address, names):
        socket = await websocket_connect(f"ws://{address}/socket")
        head, _ = await read(socket)
        assert head == {"kind": "shots", "shots": names}
        for number in range(200):
            settings = {"exposure.iso": str(100 + number)}
            await socket.write_message(
                json.dumps({"number": number, "want": "preview", "shot": names[1], "settings": settings})
            )
        answered = []
        while not answered or answered[-1] != 199:
            head, pixels = await read(socket)
            assert head["kind"] == "picture" and len(pixels) == 4 * head["width"] * head["height"]
            answered.append(head["number"])
        assert head["data"]["exposure"]["iso"] == 299 and len(answered) <= 20 and answered == sorted(answered)
        socket.close()

    served(explorer, visit)


def test_a_wrong_value_is_told_and_the_page_goes_on(explorer):
    async def visit(address, names):
        socket = await websocket_connect(f"ws://{address}/socket")
        await read(socket)
        ask = {"number": 1, "want": "preview", "shot": names[0], "settings": {"lens.f_number": "f/0.1"}}
        for message in (json.dumps(ask), "{", "[1]", json.dumps(ask | {"want": "exec"})):
            await socket.write_message(message)
            head, _ = await read(socket)
            assert head["kind"] in ("error", "refused") and "Traceback" not in head["message"] and "/tmp" not in head["message"]
        await socket.write_message(json.dumps(ask | {"settings": {}}))
        assert (await read(socket))[0]["kind"] == "picture"
        socket.close()

    served(explorer, visit)


def test_pages_and_messages_are_limited(explorer):
    async def visit(address, names):
        sockets = [await websocket_connect(f"ws://{address}/socket") for _ in range(MOST_PAGES)]
        with pytest.raises(HTTPClientError) as refused:
            await websocket_connect(f"ws://{address}/socket")
        assert refused.value.code == 503
        await sockets[0].write_message("x" * 100_000)
        await read(sockets[0])
        assert await asyncio.wait_for(sockets[0].read_message(), 20) is None  # closed
        for socket in sockets:
            socket.close()
        code, _ = await status(address, "view.yaml", "POST", "x" * 100_000)
        assert code in (400, 413, 599)

    served(explorer, visit)


def test_the_dng_of_a_view_is_that_of_its_shot(explorer):
    async def visit(address, names):
        settings = {"lens.f_number": "f/8", "camera.pixel_pitch": "6 um"}
        body = json.dumps({"want": "frame", "shot": names[0], "settings": settings})
        return await status(address, "view.dng", "POST", body), names[0], settings

    (code, data), name, settings = served(explorer, visit)
    from simulator.pipeline.simulate import simulate
    from simulator.raw.dng.writer import dng_bytes

    assert code == 200 and data == dng_bytes(simulate(explorer.opened(name).shot(settings)))


WRONG = ["", "[]", "{}", '{"shot": 1, "settings": {}}', '{"shot": "a", "settings": {}, "at": [2, 0]}', b"\xff"]


@pytest.mark.parametrize("message", WRONG)
def test_a_request_that_the_page_does_not_send_is_refused(message):
    with pytest.raises(PhotositeError, match="as the page does"):
        read_request(message)


def test_a_message_names_files_alone():
    assert (
        without_folders("/home/me/shots/a.yaml:3: scene.image = /data/x.exr: no such file")
        == "a.yaml:3: scene.image = x.exr: no such file"
    )


class Patient(Explorer):
    """Takes each whole frame until it is stale, and the second one of a page at once."""

    def __init__(self, shots):
        super().__init__(shots)
        self.begun, self.ended = [], []

    def answer(self, request, is_stale=lambda: False):
        if request.want == "frame":
            self.begun.append(request.at)
            if self.begun.count(request.at) == 1:
                while not is_stale():
                    time.sleep(0.01)
                self.ended.append(request.at)
                raise SupersededError
        elif request.at == (0.0, 0.0):
            raise ZeroDivisionError("division by zero")
        return Answer(np.zeros((1, 1, 4), np.uint8), {})


async def opened_page(address):
    socket = await websocket_connect(f"ws://{address}/socket")
    await read(socket)
    return socket


def asked(number, want, names, at=(0.5, 0.5)):
    return json.dumps({"number": number, "want": want, "shot": names[0], "settings": {}, "at": at})


def test_a_whole_frame_gives_way_to_another_page_and_is_taken_again():
    patient = Patient([OpenedShot("color_checker")])

    async def visit(address, names):
        first, second = [await opened_page(address) for _ in range(2)]
        await first.write_message(asked(1, "frame", names))
        while not patient.begun:
            await asyncio.sleep(0.01)
        await second.write_message(asked(7, "preview", names))
        assert (await read(second))[0]["number"] == 7
        assert (await read(first))[0]["want"] == "frame" and len(patient.begun) == 2
        await first.write_message(asked(2, "frame", names, (0.25, 0.5)))
        while len(patient.begun) < 3:
            await asyncio.sleep(0.01)
        first.close()  # nobody waits for it
        await second.write_message(asked(8, "frame", names))
        assert (await read(second))[0]["number"] == 8 and patient.ended == [(0.5, 0.5), (0.25, 0.5)]

    served(patient, visit)


def test_a_fault_of_the_program_is_told_and_the_page_goes_on(caplog):
    async def visit(address, names):
        page = await opened_page(address)
        await page.write_message(asked(1, "preview", names, (0.0, 0.0)))
        head, _ = await read(page)
        assert head["kind"] == "error" and head["message"] == "ZeroDivisionError: division by zero"
        await page.write_message(asked(2, "preview", names))
        assert (await read(page))[0]["number"] == 2

    served(Patient([OpenedShot("color_checker")]), visit)
    assert "Traceback" in caplog.text
