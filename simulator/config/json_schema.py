"""JSON Schema of the shot file, for editors that complete and check YAML."""

import copy
from typing import Any

from simulator.config.shot_file import make_shot_section

DRAFT = "https://json-schema.org/draft/2020-12/schema"


def schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a shot file, from the models that read it; units are in the descriptions."""
    model = make_shot_section()
    result: dict[str, Any] = {"$schema": DRAFT, "title": "Photosite shot"} | model.model_json_schema(
        by_alias=True, mode="validation"
    )
    definitions = result["$defs"]
    definitions["Camera"] = _make_camera_schema(definitions["Camera"])
    result["properties"]["name"]["description"] = "stem of the files written; the shot file's own when left out"
    result["required"] = [key for key in result["required"] if key != "name"]
    return result


def _make_camera_schema(full: dict[str, Any]) -> dict[str, Any]:
    """List what `camera:` may be: a name or path, a mapping on a base, or a full camera."""
    text = {"type": "string", "description": "a name in configs/cameras or the path of a camera file"}
    partial = copy.deepcopy(full)
    partial["properties"]["base"] = text
    partial["required"] = ["base"]
    for key, value in partial["properties"].items():
        if key != "base":  # beside a base every section may be partial, and null removes it
            partial["properties"][key] = {"description": value.get("description", key)}
    partial["properties"]["iso_table"] |= {
        "description": f"{full['properties']['iso_table'].get('description', '')} It replaces the base's table as a whole.",
        "type": ["object", "null"],
        "properties": {"merge": {"type": "boolean", "description": "true: lay these lines over those of the base"}},
    }
    by_file = {
        "type": "object",
        "required": ["file"],
        "properties": {"file": {"type": "string", "description": "a name in configs/responses or a path"}},
    }
    whole = copy.deepcopy(full)
    whole["properties"]["response"] = {"anyOf": [by_file, full["properties"]["response"]]}
    return {"anyOf": [text, partial, whole]}
