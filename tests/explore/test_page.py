"""The page in a real browser: it loads, its controls change the picture as physics says, and nothing comes from elsewhere."""

import asyncio
import contextlib
import shutil
import threading

import pytest
from helpers.explore_shots import write_shot

pytest.importorskip("tornado", reason="the extra `explore` is not installed")

from helpers.browser import open_session, started  # noqa: E402  # needs tornado

from simulator.explore.explorer import Explorer  # noqa: E402
from simulator.explore.opened_shot import OpenedShot  # noqa: E402
from simulator.explore.server import make_server  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="no Chromium is installed (Debian: apt install chromium)")
SETTLED = "photosite.measured.answers.detail > {count} && photosite.state.next === null"


@contextlib.contextmanager
def serving(folder):
    """Serve a small shot from a thread of its own; yields the address."""
    loop, begun, address = asyncio.new_event_loop(), threading.Event(), []

    async def serve():
        _, port = make_server(Explorer([OpenedShot(str(write_shot(folder))), OpenedShot("color_checker")]))
        address.append(f"http://127.0.0.1:{port}/")
        begun.set()

    def run():
        asyncio.set_event_loop(loop)
        loop.create_task(serve())
        loop.run_forever()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert begun.wait(30)
    try:
        yield address[0]
    finally:
        loop.call_soon_threadsafe(loop.stop)
        thread.join(30)


class Page:
    """The loaded page, and what a photographer does with it."""

    def __init__(self, session):
        self.session = session

    async def settle(self, count=0):
        """Wait for the numbers of a place at 1:1 that was asked for after `count` of them."""
        await self.session.until(SETTLED.format(count=count))

    async def details(self):
        return await self.session.value("photosite.measured.answers.detail")

    async def turn(self, key, label):
        """Move a slider to the position with this label, as a hand does, and wait for the picture and its numbers."""
        count = await self.details()
        await self.session.value(f"""(() => {{
            const control = photosite.state.controls.find((one) => one.key === "{key}");
            const index = control.choices.findIndex((one) => one.label === "{label}");
            if (index < 0) throw new Error("no {label} in " + control.choices.map((one) => one.label));
            control.input.value = index;
            control.input.dispatchEvent(new Event("input", {{ bubbles: true }}));
        }})()""")
        await self.settle(count)

    async def choose(self, key, value):
        """Choose from a list, as a hand does, and wait for the picture and its numbers."""
        count = await self.details()
        await self.session.value(f"""(() => {{
            const list = document.getElementById("{key}");
            list.focus();
            list.value = "{value}";
            list.dispatchEvent(new Event("change", {{ bubbles: true }}));
        }})()""")
        await self.settle(count)

    async def electrons(self):
        """Mean electrons in the table of the explained photosite."""
        return await self.number("pixel-table", "Mean electrons")

    async def number(self, table, name):
        """Number before its unit in a row of a table."""
        rows = await self.session.value(f"document.getElementById('{table}').innerText")
        line = next(line for line in rows.splitlines() if line.startswith(name))
        return float(line.split("\t")[1].split()[0])


def visited(tmp_path, visit, size=(1280, 900, False)):
    async def run(address, port):
        session = await open_session(port)
        await session.resize(*size)
        await session.open(address)
        page = Page(session)
        await page.settle()
        try:
            return await visit(page, session)
        finally:
            session.socket.close()

    with serving(tmp_path) as address, started(CHROMIUM) as port:
        return asyncio.run(run(address, port)), address


def test_controls_change_the_picture_as_physics_says(tmp_path):
    async def visit(page, session):
        await page.turn("lens.f_number", "f/4")
        base_e = await page.electrons()
        await page.turn("exposure.time", "1/50 s")
        assert await page.electrons() == pytest.approx(2 * base_e, rel=2e-3)  # the table shows four digits
        await page.turn("lens.f_number", "f/8")
        quarter = (1 + 4 * 16 * 1.0081) / (1 + 4 * 64 * 1.0081)  # 1 + 4 N^2 (1 + m)^2
        assert await page.electrons() == pytest.approx(2 * base_e * quarter, rel=0.02)  # texture moves under the blur
        before_e = await page.electrons()
        await page.turn("exposure.iso", "400")
        assert await page.electrons() == pytest.approx(before_e, rel=1e-6)
        for key, label in (("lens.focus_distance", "8 m"), ("lens.focal_length", "14 mm"), ("motion.camera.pan", "20 deg/s")):
            picture = "document.getElementById('picture').toDataURL()"
            shown = await session.value(picture)
            await page.turn(key, label)
            assert await session.value(picture) != shown, key
        seen = await session.look()
        return seen

    seen, address = visited(tmp_path, visit)
    assert not seen.errors and seen.overflow_px <= 0
    assert all(request.startswith(address) or request.startswith("data:") for request in seen.requests)


def test_another_scene_and_camera_change_the_picture_as_physics_says_and_the_rest_stays(tmp_path):
    async def visit(page, session):
        await page.turn("lens.f_number", "f/5.6")
        await page.choose("scene", "flat_field")  # a perfect white on the axis
        white = {name: await page.number("exposure-table", f"Electrons of white, {name}") for name in ("red", "green", "blue")}
        color = {"red": "red", "green": "green", "blue": "blue"}[
            (await session.value("document.getElementById('pixel-table').rows[0].cells[1].textContent"))
        ]
        assert await page.electrons() == pytest.approx(white[color], rel=2e-3)
        exposure_lx_s = await page.number("exposure-table", "Exposure H of white")

        await page.choose("camera", "ideal")  # one electron for each photon, no colour filter
        assert await page.electrons() == await page.number("pixel-table", "Photons")
        assert await page.number("exposure-table", "Exposure H of white") == exposure_lx_s  # light is not the camera's
        assert await session.value("document.activeElement.id") == "camera"  # the keyboard stays where it was

        await page.choose("camera", "imx385")
        assert "ISO 1600 to 25600: 1600 in place of 100" in await session.value("document.getElementById('notes').textContent")
        assert await session.value("photosite.state.data.exposure.iso") == 1600
        kept = await session.value("[photosite.state.data.lens.f_number, photosite.state.settings.scene]")
        assert kept == [5.6, "flat_field"]
        command = await session.value("photosite.state.command")
        assert "--set 'camera=imx385'" in command and "chart: flat_field" in command and str(tmp_path) not in command

        await session.value("document.getElementById('reset').click()")
        count = await page.details()
        await page.settle(count)
        assert await session.value("JSON.stringify(photosite.state.settings)") == "{}"
        assert await session.value("document.getElementById('camera').value") == "own"
        return await session.look()

    seen, address = visited(tmp_path, visit)
    assert not seen.errors and seen.overflow_px <= 0
    assert all(request.startswith(address) or request.startswith("data:") for request in seen.requests)


def test_a_locked_exposure_keeps_the_electrons_rapid_moves_end_at_the_last_value_and_a_wrong_view_is_told(tmp_path):
    async def visit(page, session):
        await page.turn("lens.f_number", "f/4")
        base_e = await page.electrons()
        await session.value("document.getElementById('lock').click()")
        await page.turn("lens.f_number", "f/8")
        assert await session.value("photosite.state.settings['exposure.time']") == "1/25 s"
        assert await page.electrons() == pytest.approx(base_e, rel=0.02)
        await session.value("document.getElementById('lock').click()")

        count = await page.details()
        shown = await session.value("photosite.measured.answers.preview")
        await session.value("""(() => {
            const control = photosite.state.controls.find((one) => one.key === "exposure.iso");
            for (let turn = 0; turn < 200; turn += 1) {
                control.input.value = turn % control.choices.length;
                control.input.dispatchEvent(new Event("input", { bubbles: true }));
            }
        })()""")
        await page.settle(count)
        assert await session.value("photosite.measured.answers.preview") - shown <= 3
        last = await session.value(
            "(() => { const c = photosite.state.controls.find((one) => one.key === 'exposure.iso');"
            " return [c.choices[199 % c.choices.length].text, String(photosite.state.data.exposure.iso)]; })()"
        )
        assert last[0] == last[1]

        await session.value("""(() => {
            const control = photosite.state.controls.find((one) => one.key === "camera.pixel_pitch");
            control.input.value = control.choices.length - 1;
            control.input.dispatchEvent(new Event("input", { bubbles: true }));
        })()""")
        await session.until("photosite.measured.answers.error > 0")
        assert "past the edge of the scene" in await session.value("document.getElementById('message').textContent")

    visited(tmp_path, visit)


def test_it_fits_a_phone_and_every_control_has_a_name(tmp_path):
    async def visit(page, session):
        seen = await session.look()
        assert seen.overflow_px <= 0 and not seen.errors
        nameless = await session.value("""[...document.querySelectorAll("input, select, button, canvas, svg")]
            .filter((one) => !(one.labels && one.labels.length) && !one.getAttribute("aria-label") && !one.textContent.trim())
            .map((one) => one.outerHTML)""")
        assert nameless == []
        text = await session.value(
            "[...document.querySelectorAll('input[type=range]')].map((one) => one.getAttribute('aria-valuetext'))"
        )
        assert len(text) == 7 and all(text)
        for scheme in ("light", "dark"):
            await session.ask("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            low = await session.value(CONTRAST)
            assert low == [], (scheme, low)
        options = await session.value(
            "[...document.querySelectorAll('select')].map((one) => [one.labels[0].textContent, one.value])"
        )
        assert options[1:] == [["Scene", "own"], ["Camera", "own"]]

    visited(tmp_path, visit, (390, 844, True))


# Contrast of text by WCAG 2.2, 1.4.3: at least 4.5 of relative luminances.
CONTRAST = """(() => {
    const luminance = (text) => text.match(/[\\d.]+/g).slice(0, 3).map((one) => one / 255)
        .map((one) => (one <= 0.04045 ? one / 12.92 : ((one + 0.055) / 1.055) ** 2.4))
        .reduce((sum, one, i) => sum + one * [0.2126, 0.7152, 0.0722][i], 0);
    const paper = luminance(getComputedStyle(document.body).backgroundColor);
    return [...document.querySelectorAll("h1, h2, p, label, output, th, td, button, select")]
        .map((one) => [one.textContent, (Math.max(paper, luminance(getComputedStyle(one).color)) + 0.05)
            / (Math.min(paper, luminance(getComputedStyle(one).color)) + 0.05)])
        .filter(([, ratio]) => ratio < 4.5);
})()"""
