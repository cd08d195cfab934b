"""A bench that runs single kernel headers, and chains of stages."""

import copy
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from simulator.device import Device
from simulator.device.device import Kernel
from simulator.device.kernel_source import expanded
from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, launch_sensor
from simulator.sensor.seeds import Seeds
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.stage import Stage


def device_like(device: Device, **settings: object) -> Device:
    """A device of the same context and queue, some of whose settings differ."""
    other = copy.copy(device)
    for name, value in settings.items():
        assert hasattr(device, name), name
        setattr(other, name, value)
    return other


@cache
def _probe(device: Device, source: str, defines: tuple[tuple[str, object], ...]) -> Kernel:
    """The kernel `probe` of this text with these macros, which a search with many inputs builds once."""
    return device.build(expanded(source), "probe", dict(defines))


class Bench:
    """Runs parts of the chain on one device."""

    def __init__(self, device: Device) -> None:
        self.device = device

    def like(self, **settings: object) -> "Bench":
        """The same on a device whose settings, such as row_px, differ."""
        return Bench(device_like(self.device, **settings))

    def header(
        self,
        include: str,
        expression: str,
        arrays: dict[str, np.ndarray],
        defines: dict[str, object] | None = None,
        dtype: DTypeLike = np.float32,
        function: str = "",
    ) -> np.ndarray:
        """`expression` of a kernel header (and a function), evaluated at every element of 1-D arrays named as in it."""
        kinds = {"float32": "float", "uint32": "uint"}
        names = ", ".join(f"global const {kinds[str(a.dtype)]} *{n}_" for n, a in arrays.items())
        reads = " ".join(f"const {kinds[str(a.dtype)]} {n} = {n}_[i];" for n, a in arrays.items())
        source = (
            f'#include "{include}"\n{function}\nkernel void probe({names}, global {kinds[np.dtype(dtype).name]} *result) '
            f"{{ const size_t i = get_global_id(0); {reads} result[i] = {expression}; }}"
        )
        count = len(next(iter(arrays.values())))
        result = self.device.empty((count,), dtype)
        kernel = _probe(self.device, source, tuple((defines or {}).items()))
        buffers = {f"{name}_": self.device.upload(array) for name, array in arrays.items()}
        self.device.run(kernel, (count,), None, result=result, **buffers)
        return self.device.download(result, (count,), dtype)

    def sensor(
        self,
        mean_electrons: ArrayLike,
        *stages: Stage,
        frame_seed: int = 1,
        body_seed: int = 2,
        x: int = 0,
        y: int = 0,
        gain: float = 1.0,
        bits: int = 16,
        black: float = 0.0,
        **tunables: Any,
    ) -> np.ndarray:
        """Codes of the fused kernel for these mean electrons (height, width), with only the stages given.

        tunables: of `launch_sensor`.
        """
        chain = {stage.stem: stage for stage in (AnalogGain(gain), Adc(bits, black), *stages)}
        setting = FrameSetting(tuple(chain.values()), Seeds(body_seed, frame_seed), x, y)
        # Not through `expose_frame_stack`, which refuses more electrons than any light gives: the kernel must saturate there.
        means = np.ascontiguousarray(mean_electrons, np.float32)
        codes = self.device.empty(means.shape, np.uint16)
        launch_sensor(self.device, self.device.upload(means), codes, means.shape, [setting], KernelPart.WHOLE, **tunables)
        return self.device.download(codes, means.shape, np.uint16)
