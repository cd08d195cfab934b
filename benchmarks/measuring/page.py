"""The sensor page with the lines of absent stages deleted, to measure what an absent stage costs."""

import re

from simulator.device import KERNELS, expanded


def without_absent_stages(defines: dict[str, object]) -> str:
    """Text of kernels/sensor.cl and its headers without any line under `#if STAGE` of a stage that is 0."""
    text = (KERNELS / "sensor.cl").read_text(encoding="utf-8")
    for name, value in defines.items():
        if value == 0 and re.search(rf"^#if {name}$", text, re.MULTILINE):
            text = re.sub(rf"^#if {name}\n.*?^#endif\n", "", text, flags=re.MULTILINE | re.DOTALL)
            text = text.replace(f'#include "{name.lower()}.h"\n', "")
    return expanded(text)
