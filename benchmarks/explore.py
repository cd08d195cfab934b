"""Time from a move of a slider to its painted preview, in headless Chromium.

`python benchmarks/explore.py SHOT --set KEY=VALUE`

Every control of the shot is moved through its positions, one move after the picture of the one before is there, twice: what is
planned or compiled for a position the first time is told apart.
"""

import argparse
import asyncio
import json
import shutil
import sys
import threading
from pathlib import Path

import numpy as np

CHECKOUT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(CHECKOUT), str(CHECKOUT / "tests")]  # the browser's driver lies in tests/helpers

from helpers.browser import open_session, started  # noqa: E402  # after the path

from simulator.config import parse_override  # noqa: E402
from simulator.explore.explorer import Explorer  # noqa: E402
from simulator.explore.opened_shot import OpenedShot  # noqa: E402
from simulator.explore.server import make_server  # noqa: E402

GOAL_MS = 150.0  # of 95 % of the moves
POSITIONS = 8  # of each control, evenly over its range
MOVE = """(() => {{
    const control = photosite.state.controls.find((one) => one.key === {key});
    control.input.value = {index};
    control.input.dispatchEvent(new Event("input", {{ bubbles: true }}));
}})()"""


def serve(shot: OpenedShot) -> int:
    """Serve the page of a shot from a thread, and return its port."""
    begun, ports = threading.Event(), []

    async def run() -> None:
        ports.append(make_server(Explorer([shot]))[1])
        begun.set()
        await asyncio.Event().wait()

    threading.Thread(target=lambda: asyncio.run(run()), daemon=True).start()
    begun.wait()
    return ports[0]


async def measure(browser_port: int, port: int) -> dict[str, list[list[float]]]:
    """Return the times of each control's moves, of the first round and the second [ms]."""
    session = await open_session(browser_port)
    await session.resize(1280, 900, False)
    await session.open(f"http://127.0.0.1:{port}/")
    await session.until("window.photosite && photosite.measured.answers.preview > 0")
    sliders = (
        "photosite.state.controls.filter((one) => one.kind === 'slider').map((one) => [one.key, one.choices.length, one.index])"
    )
    controls = json.loads(await session.value(f"JSON.stringify({sliders})"))
    found: dict[str, list[list[float]]] = {key: [[], []] for key, _, _ in controls}
    for turn in range(2):
        for key, length, start in controls:
            for index in [*np.unique(np.linspace(0, length - 1, POSITIONS).round().astype(int)).tolist(), start]:
                painted = await session.value("photosite.measured.paints_ms.length")
                errors = await session.value("photosite.measured.answers.error")
                await session.value(MOVE.format(key=json.dumps(key), index=index))
                await session.until(
                    f"photosite.measured.paints_ms.length > {painted} || photosite.measured.answers.error > {errors}"
                )
                if await session.value("photosite.measured.paints_ms.length") > painted:
                    found[key][turn].append(await session.value("photosite.measured.paints_ms.at(-1)"))
                else:  # a view that the scene does not fill
                    await session.value("photosite.state.moved = null")
    return found


def main() -> None:
    """Print median and 95 % of each control, and of all moves."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("shot", nargs="?", default="color_checker")
    arguments.add_argument("--set", action="append", default=[], metavar="KEY=VALUE")
    given = arguments.parse_args()
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        sys.exit("no Chromium is installed; on Debian: apt install chromium")
    port = serve(OpenedShot(given.shot, {key: value for key, value, _ in map(parse_override, given.set)}))
    with started(browser) as browser_port:
        found = asyncio.run(measure(browser_port, port))
    rows = {**found, "all": [sum((times[turn] for times in found.values()), []) for turn in range(2)]}
    print(f"{'control':20} {'moves':>6} {'first: median':>14} {'95 %':>6} {'again: median':>14} {'95 %':>6}  [ms]")
    print(f"goal: 95 % below {GOAL_MS:g} ms")
    for name, (first, again) in rows.items():
        figures = [
            float(np.quantile(times, share)) if times else float("nan") for times in (first, again) for share in (0.5, 0.95)
        ]
        print(f"{name:20} {len(first):6} {figures[0]:14.0f} {figures[1]:6.0f} {figures[2]:14.0f} {figures[3]:6.0f}")


if __name__ == "__main__":
    main()
