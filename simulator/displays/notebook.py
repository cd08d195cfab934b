"""The pieces of HTML that notebooks show: one style, and the display of each kind of object."""

from collections.abc import Callable
from html import escape
from typing import Any

from simulator.displays.camera_display import camera_title, show_camera
from simulator.displays.explanation import explain_plan, explanation_body
from simulator.displays.raw_display import raw_title, show_raw
from simulator.displays.shot_display import show_shot
from simulator.pipeline.planner import Plan
from simulator.pipeline.shot import Shot
from simulator.raw.raw_image import Raw
from simulator.sensor.camera.camera import Camera

# Colours are those of the notebook, so that a display reads as well in the dark.
STYLE = """
.photosite, .photosite h4, .photosite td, .photosite th { color: inherit; }
.photosite h4 { font-size: 1em; font-weight: 600; margin: 0.8em 0 0.2em; }
.photosite table { border-collapse: collapse; margin: 0.2em 0; font-size: 0.9em; }
.photosite td, .photosite th { padding: 0.1em 0.7em; text-align: left; vertical-align: top; background: none;
  border: 0; border-bottom: 1px solid rgba(128, 128, 128, 0.4); white-space: normal; }
.photosite td.number { text-align: right; white-space: nowrap; font-variant-numeric: tabular-nums; }
.photosite .scroll { overflow-x: auto; max-width: 100%; }
.photosite summary { cursor: pointer; }
.photosite ul { margin: 0.2em 0; }
.photosite img { max-width: 100%; height: auto; }
"""


def display_html(shown: object) -> str:
    """Return what a notebook shows of a Raw, Shot, Plan or Camera: a piece of HTML with its own style, without scripts.

    Raises TypeError for another object.
    """
    for kind, (title, show) in DISPLAYS.items():
        if isinstance(shown, kind):
            head = f"<h4>{escape(title(shown))}</h4>"
            return f"<div class='photosite'><style>{STYLE}</style>\n{head}\n{show(shown)}\n</div>"
    raise TypeError(f"{type(shown).__name__} has no display")


def _shot_title(shot: Shot) -> str:
    return f"Shot {shot.name}"


def _plan_title(planned: Plan) -> str:
    window = planned.optics.window
    return f"Plan of {window.width} × {window.height} photosites"


def _show_plan(planned: Plan) -> str:
    return explanation_body(explain_plan(planned), "h4", is_folded=True)


DISPLAYS: dict[type, tuple[Callable[[Any], str], Callable[[Any], str]]] = {
    Raw: (raw_title, show_raw),
    Shot: (_shot_title, show_shot),
    Plan: (_plan_title, _show_plan),
    Camera: (camera_title, show_camera),
}
