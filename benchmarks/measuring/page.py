"""The sensor page with the lines of absent stages deleted, to measure what an absent stage costs."""

import re

from simulator.device.kernel_source import KERNELS, expanded

BODY_BLOCK = "block_of(x, y, STREAM_BODY, body_seed, 1u);"


def without_absent_stages(defines: dict[str, object]) -> str:
    """Text of kernels/sensor.cl and its headers without the lines of stages that are 0, nor the body's numbers when unused.

    Raises ValueError when a line is not where it is looked for: the page has changed.
    """
    text = (KERNELS / "sensor.cl").read_text(encoding="utf-8")
    absent = re.findall(r"^    if \((\w+)\) signal = ", text, re.MULTILINE)
    for name in (name for name in absent if defines[name] == 0):
        text = re.sub(rf"^    if \({name}\) signal = .*\n", "", text, flags=re.MULTILINE)
        text = re.sub(rf'^#include "{name.lower()}.h"\n', "", text, flags=re.MULTILINE)
    text = expanded(text)
    if not (defines["PRNU"] or defines["DSNU"]):
        if BODY_BLOCK not in text:
            raise ValueError(f"kernels/row_pair.h has no {BODY_BLOCK} to delete")
        text = text.replace(BODY_BLOCK, "{0u, 0u, 0u, 0u};")
    return text
