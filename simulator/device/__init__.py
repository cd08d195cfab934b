"""The OpenCL device: drivers, buffers, launches, and the texts of kernels."""

from simulator.device.device import (
    Buffer,
    CompilerWarning,
    Device,
    DeviceInfo,
    Kernel,
    default_order,
    devices,
    has_devices,
    open_device,
)

__all__ = [
    "Buffer",
    "CompilerWarning",
    "Device",
    "DeviceInfo",
    "Kernel",
    "default_order",
    "devices",
    "has_devices",
    "open_device",
]
