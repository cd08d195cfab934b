"""The OpenCL device: the only module that imports pyopencl.

Kernels live in kernels/*.cl. `#include "x.h"` is expanded here, because PoCL refuses an -I path that holds a space.
Arguments are bound by name, and so are the fields of structs: a missing or misspelt one is an error, not a wrong number in the
wrong place.
"""

import functools
import os
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike

from simulator.errors import PhotositeError

Buffer = cl.Buffer  # memory on a device; kernels' comments and docstrings say shape and type

_HERE = Path(__file__).resolve().parent
KERNELS = next(folder for folder in (_HERE / "kernels", _HERE.parent / "kernels") if folder.is_dir())
_INCLUDE = re.compile(r'^#include "([^"]+)"$', re.MULTILINE)
_SCALARS = {"float": np.float32, "uint": np.uint32, "int": np.int32, "ulong": np.uint64}
_FIELDS = ("float", "uint", "int")  # of structs: all of 4 bytes, so that no compiler pads
INSTALL_HINT = "install one: `pip install pyopencl[pocl]`, or Debian's `apt install pocl-opencl-icd`"


def expanded(text: str, seen: set[str] | None = None) -> str:
    """OpenCL C text with the headers of kernels/ put in, each once."""
    seen = set() if seen is None else seen

    def header(match: re.Match) -> str:
        if match[1] in seen:
            return ""
        seen.add(match[1])
        return expanded((KERNELS / match[1]).read_text(encoding="utf-8"), seen)

    return _INCLUDE.sub(header, text)


def kernel_source(file: str) -> str:
    """Text of kernels/<file> with its headers put in."""
    return expanded((KERNELS / file).read_text(encoding="utf-8"))


@dataclass(frozen=True)
class DeviceInfo:
    """One OpenCL device as a user sees it."""

    name: str
    platform: str
    version: str
    compute_units: int
    memory_bytes: int

    @property
    def label(self) -> str:
        """Name that `--device` matches."""
        return f"{self.name} [{self.version}]"


def _info(device: cl.Device) -> DeviceInfo:
    version = device.platform.version.removeprefix("OpenCL ").split("  ")[0]
    return DeviceInfo(device.name.strip(), device.platform.name, version, device.max_compute_units, _memory_bytes(device))


def _memory_bytes(device: cl.Device) -> int:
    """Memory of a device; a CPU has the machine's, of which some drivers report a part."""
    if device.type & cl.device_type.CPU and "SC_PHYS_PAGES" in os.sysconf_names:
        return max(device.global_mem_size, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return device.global_mem_size


def _pocl_version(device: cl.Device) -> tuple[int, ...]:
    found = re.search(r"PoCL (\d+)\.(\d+)", device.platform.version)
    return tuple(int(number) for number in found.groups()) if found else (-1,)


_drivers_of: int | None = None  # process that loaded the OpenCL drivers


def _require_living_drivers() -> None:
    """Refuse a process that was forked after the drivers were loaded: their threads stay behind, and it would wait forever."""
    if _drivers_of not in (None, os.getpid()):
        raise PhotositeError(
            f"OpenCL in process {os.getpid()}: it was forked from one that had used OpenCL, and drivers do not survive that; "
            "start workers before OpenCL is used, or with the method 'spawn' or 'forkserver' of multiprocessing "
            "(PyTorch: DataLoader(..., multiprocessing_context='forkserver'))"
        )


def _all_devices() -> list[cl.Device]:
    """Every device, the default first: the newest PoCL, then the others as the loader lists them."""
    global _drivers_of
    _require_living_drivers()
    _drivers_of = os.getpid()
    try:
        found = [device for platform in cl.get_platforms() for device in platform.get_devices()]
    except cl.Error as error:
        raise PhotositeError(f"no OpenCL platform found ({error}); {INSTALL_HINT}") from None
    if not found:
        raise PhotositeError(f"no OpenCL device found; {INSTALL_HINT}")
    return sorted(found, key=_pocl_version, reverse=True)


def devices() -> list[DeviceInfo]:
    """All OpenCL devices, the default one first. Raises PhotositeError when there is none."""
    return [_info(device) for device in _all_devices()]


def has_devices() -> bool:
    """Whether there is any OpenCL device."""
    try:
        return bool(_all_devices())
    except PhotositeError:
        return False


@dataclass(frozen=True)
class Kernel:
    """A built kernel; arguments: type by name, in order: "*" of a buffer, a scalar's name, or the dtype of a struct."""

    name: str
    function: cl.Kernel
    arguments: dict[str, str | np.dtype]

    def bind(self, name: str, value: Any) -> Any:
        """What the driver takes for an argument. Raises TypeError when a struct's fields are not exactly those declared."""
        kind = self.arguments[name]
        if isinstance(kind, np.dtype):
            return packed_struct(kind, value, f"{name} of {self.name}")
        return _SCALARS[kind](value) if kind in _SCALARS else value


def declared_arguments(source: str, name: str) -> dict[str, str | np.dtype]:
    """Types by name of a kernel's arguments, read from its text: drivers forget them in builds that come from a disk cache."""
    found = re.search(rf"kernel void {name}\(([^)]*)\)", re.sub(r"//.*", "", source))
    if not found:
        raise ValueError(f"kernel {name} is not declared")
    parts = [re.findall(r"\w+|\*", argument) for argument in found[1].split(",")]
    return {
        part[-1]: "*" if "*" in part else declared_struct(source, part[-2]) if "struct" in part else part[-2] for part in parts
    }


def declared_struct(source: str, name: str) -> np.dtype:
    """The dtype of `struct name`, read from the text of a kernel or header: float, uint and int, or arrays of them.

    Raises ValueError for other types, which a compiler might pad.
    """
    found = re.search(rf"\bstruct {name} \{{([^}}]*)\}};", re.sub(r"//.*", "", source))
    if not found:
        raise ValueError(f"struct {name} is not declared")
    fields: list[tuple] = []
    for line in filter(None, map(str.strip, found[1].split(";"))):
        kind, _, names = line.partition(" ")
        declared = [re.fullmatch(r"(\w+)(?:\[(\d+)\])?", name.strip()) for name in names.split(",")]
        if kind not in _FIELDS or not all(declared):
            raise ValueError(f"struct {name}: '{line}' is not a field of {', '.join(_FIELDS)}")
        fields += [(field[1], _SCALARS[kind], int(field[2]) if field[2] else ()) for field in declared if field]
    return np.dtype(fields)


def packed_struct(dtype: np.dtype, value: Mapping[str, Any] | np.void, what: str) -> np.void:
    """Structured scalar of a mapping from field to value, or of a structured scalar with the same fields.

    what: names the struct in the TypeError that is raised for a missing or superfluous field.
    """
    declared = dtype.names or ()
    names = value.keys() if isinstance(value, Mapping) else getattr(getattr(value, "dtype", None), "names", None)
    if names is None or set(names) != set(declared):
        raise TypeError(f"{what} has the fields {sorted(declared)}, not {sorted(names) if names else value!r}")
    return np.void(tuple(value[name] for name in declared), dtype)


CPU_ROW_PX = 1024  # a CPU starts work-groups one after another, which costs more than 500 photosites do
CPU_SPAN = 64  # photosites of a work-item in kernels whose innermost loop runs over them; a GPU has work-items enough
GPU_ROW_PX = 256  # what every GPU can run at once
CONSTANT_BYTES = 2**16  # that every OpenCL device has for the numbers of a launch (OpenCL 1.2, table 4.3)
SHORTEST_ROW_PX = 32  # shorter groups waste lanes of a GPU and cost a CPU more to start than to run


class Device:
    """A context, a queue and the kernels built on them.

    row_px: work-items of a group that runs along a row. constant_bytes: of the numbers of a launch.
    shares_memory: whether kernels work on the host's own arrays.
    """

    def __init__(self, device: cl.Device):
        self.info = _info(device)
        wanted = CPU_ROW_PX if device.type & cl.device_type.CPU else GPU_ROW_PX
        self.row_px = min(wanted, device.max_work_group_size)
        self.span = CPU_SPAN if device.type & cl.device_type.CPU else 1
        self.constant_bytes = CONSTANT_BYTES
        self.shares_memory = bool(device.type & cl.device_type.CPU)
        self._own_context = cl.Context([device])
        self._own_queue = cl.CommandQueue(self._own_context)
        self._kernels: dict[tuple, Kernel] = {}

    @property
    def _context(self) -> cl.Context:
        _require_living_drivers()
        return self._own_context

    @property
    def _queue(self) -> cl.CommandQueue:
        _require_living_drivers()
        return self._own_queue

    def upload(self, array: np.ndarray) -> cl.Buffer:
        """Copy of an array on the device."""
        return self._buffer(cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=np.ascontiguousarray(array))

    def share(self, array: np.ndarray) -> cl.Buffer:
        """Buffer over a contiguous array's own memory on a CPU, elsewhere a copy; the array must outlive the buffer's use.

        What kernels write there is in the array after `collect`.
        """
        if not self.shares_memory:
            return self.upload(array)
        flags = cl.mem_flags.USE_HOST_PTR | (cl.mem_flags.READ_WRITE if array.flags.writeable else cl.mem_flags.READ_ONLY)
        return self._buffer(flags, hostbuf=array)

    def collect(self, buffer: cl.Buffer, array: np.ndarray) -> None:
        """Wait for all work and bring a buffer of `share` into its array."""
        if not self.shares_memory:
            cl.enqueue_copy(self._queue, array, buffer)
            return
        mapped, _ = cl.enqueue_map_buffer(self._queue, buffer, cl.map_flags.READ, 0, array.shape, array.dtype)
        mapped.base.release(self._queue)
        self._queue.finish()

    def empty(self, shape: tuple[int, ...], dtype: DTypeLike) -> cl.Buffer:
        """Uninitialised buffer for an array of this shape. Raises PhotositeError when it does not fit."""
        return self._buffer(cl.mem_flags.READ_WRITE, int(np.prod(shape)) * np.dtype(dtype).itemsize)

    def _buffer(self, flags: int, size: int = 0, hostbuf: np.ndarray | None = None) -> cl.Buffer:
        try:
            return cl.Buffer(self._context, flags, size, hostbuf)
        except (cl.Error, MemoryError) as error:
            needed = size if hostbuf is None else hostbuf.nbytes
            raise PhotositeError(
                f"out of memory on {self.info.label}: no room for {needed / 2**20:.0f} MiB "
                f"({error}); read out a part of the sensor with camera.window"
            ) from None

    def write(self, buffer: cl.Buffer, array: np.ndarray, offset: int) -> None:
        """Copy an array into a buffer, from this byte on."""
        cl.enqueue_copy(self._queue, buffer, np.ascontiguousarray(array), dst_offset=offset)

    def zeros(self, shape: tuple[int, ...], dtype: DTypeLike) -> cl.Buffer:
        """Buffer of zeros for an array of this shape."""
        return self._filled(shape, np.zeros((), dtype))

    def ones(self, shape: tuple[int, ...], dtype: DTypeLike) -> cl.Buffer:
        """Buffer of ones for an array of this shape."""
        return self._filled(shape, np.ones((), dtype))

    def fill(self, buffer: cl.Buffer, value: np.ndarray | np.number, offset: int) -> None:
        """Fill a buffer from this byte on."""
        cl.enqueue_fill_buffer(self._queue, buffer, np.asarray(value), offset, buffer.size - offset)

    def _filled(self, shape: tuple[int, ...], value: np.ndarray) -> cl.Buffer:
        """Buffer for an array of this shape with this value, an array of shape (), everywhere."""
        buffer = self.empty(shape, value.dtype)
        self.fill(buffer, value, 0)
        return buffer

    def download(self, buffer: cl.Buffer, shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
        """Array of a buffer's content, after all work before it."""
        array = np.empty(shape, dtype)
        cl.enqueue_copy(self._queue, array, buffer)
        return array

    def finish(self) -> None:
        """Wait until all work is done."""
        self._queue.finish()

    def kernel(self, name: str, defines: dict[str, object], file: str | None = None) -> Kernel:
        """Kernel `name` of kernels/<file> (default <name>.cl), built once for these macros."""
        key = (file or f"{name}.cl", name, tuple(defines.items()))
        if key not in self._kernels:
            self._kernels[key] = self.build(kernel_source(key[0]), name, defines)
        return self._kernels[key]

    def build(self, source: str, name: str, defines: dict[str, object]) -> Kernel:
        """Kernel `name` of expanded source text, with these macros in front (pyopencl keeps builds on disk)."""
        macros = "".join(f"#define {macro} {value}\n" for macro, value in defines.items())
        try:
            with warnings.catch_warnings(action="ignore", category=cl.CompilerWarning):  # remarks of some drivers
                program = cl.Program(self._context, macros + source).build()
        except cl.Error as error:
            raise PhotositeError(f"{self.info.label} cannot build the kernel {name}: {error}") from None
        return Kernel(name, cl.Kernel(program, name), declared_arguments(source, name))

    def run(self, kernel: Kernel, global_size: tuple[int, ...], local_size: tuple[int, ...] | None, **arguments: Any) -> None:
        """Enqueue a kernel; scalars are cast to the declared type, structs are given as mappings from field to value.

        local_size: of a work-group; None: as long a part of a row as divides it.
        Raises TypeError when the names are not exactly those of the kernel, or of a struct's fields.
        """
        if set(kernel.arguments) != set(arguments):
            raise TypeError(f"{kernel.name} takes {sorted(kernel.arguments)}, not {sorted(arguments)}")
        local_size = local_size or self._group(global_size)
        values = [kernel.bind(name, arguments[name]) for name in kernel.arguments]
        try:
            kernel.function(self._queue, global_size, local_size, *values)
        except cl.Error as error:
            raise PhotositeError(f"{self.info.label} cannot run {kernel.name}: {error}") from None

    def _group(self, global_size: tuple[int, ...]) -> tuple[int, ...] | None:
        """Work-group that is a part of a row; left to the driver, which may choose badly, where a row has no good divisor."""
        width = next(size for size in range(min(self.row_px, global_size[0]), 0, -1) if global_size[0] % size == 0)
        return (width, *(1 for _ in global_size[1:])) if width >= SHORTEST_ROW_PX or width == global_size[0] else None


@functools.cache
def open_device(name: str | None = None) -> Device:
    """Device whose label holds `name` (upper and lower case alike); default: $PHOTOSITE_DEVICE, else the newest PoCL.

    A forked process opens its own, unless the process it comes from has used OpenCL.
    Raises PhotositeError when nothing matches, listing what there is, and in a process forked too late.
    """
    wanted = name or os.environ.get("PHOTOSITE_DEVICE", "")
    found = _all_devices()
    for device in found:
        if wanted.lower() in _info(device).label.lower():
            return Device(device)
    labels = "\n  ".join(_info(device).label for device in found)
    raise PhotositeError(f"no OpenCL device matches {wanted!r}; give a part of one of these names:\n  {labels}")


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=open_device.cache_clear)
