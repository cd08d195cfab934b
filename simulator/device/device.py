"""OpenCL devices, and the one that work is given to: the only module that imports pyopencl.

Arguments and fields of structs are bound by name, so that a missing or misspelt one raises an error.
"""

import functools
import logging
import math
import os
import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from threading import Lock
from typing import Any

import numpy as np
import pyopencl as cl
from numpy.typing import DTypeLike

from simulator.device.huge_pages import HAS_HUGE_PAGES, LARGE_BYTES, HugePages
from simulator.device.kernel_source import SCALARS, declared_arguments, kernel_source, packed_struct, read_macros
from simulator.errors import PhotositeError
from simulator.progress import counted_as

CompilerWarning = cl.CompilerWarning
Buffer = cl.Buffer  # memory on a device; docstrings and the comments of kernels state shape and element type of its content

INSTALL_HINT = "install one: `pip install pyopencl[pocl]`, or Debian's `apt install pocl-opencl-icd`"
NEWER_HINT = "install a newer one: Debian's `apt install pocl-opencl-icd`, or `conda install -c conda-forge pocl`"
UNKNOWN_PROCESSOR = "unknown target CPU"  # of PoCL 3.0 from pip, of 2022, on a Zen 5 processor


@dataclass(frozen=True)
class DeviceInfo:
    """Name and size of an OpenCL device."""

    name: str
    platform: str
    version: str
    compute_units: int
    memory_bytes: int

    @property
    def label(self) -> str:
        """Text that `--device` is searched in."""
        return f"{self.name} [{self.version}]"


def _info(device: cl.Device) -> DeviceInfo:
    """Return name and size of a device."""
    version = device.platform.version.removeprefix("OpenCL ").split("  ")[0]
    return DeviceInfo(device.name.strip(), device.platform.name, version, device.max_compute_units, _memory_bytes(device))


def _memory_bytes(device: cl.Device) -> int:
    """Return the memory of a device; for a CPU that of the machine, of which some drivers report only a part."""
    if device.type & cl.device_type.CPU and "SC_PHYS_PAGES" in getattr(os, "sysconf_names", ()):  # Windows has none
        return max(device.global_mem_size, os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    return device.global_mem_size


def _pocl_version(device: cl.Device) -> tuple[int, ...]:
    """Return major and minor version of a PoCL device; (-1,) for other drivers."""
    found = re.search(r"PoCL (\d+)\.(\d+)", device.platform.version)
    return tuple(int(number) for number in found.groups()) if found else (-1,)


def default_order(device: cl.Device) -> tuple[int, int, int]:
    """Sort key of the devices, the default first.

    GPUs come first, on their makers' drivers before PoCL's; then CPUs, the newest PoCL first and other drivers last; then other
    accelerators; then what cannot build kernels. Equal ones stay in the loader's order.
    """
    major, minor = (*_pocl_version(device), 0)[:2]
    if not (device.available and device.compiler_available):
        return 3, 0, 0
    if device.type & cl.device_type.GPU:
        return 0, int(major >= 0), 0
    return 1 if device.type & cl.device_type.CPU else 2, -major, -minor


_drivers_of: int | None = None  # id of the process that loaded the OpenCL drivers


def _require_living_drivers() -> None:
    """Raise PhotositeError in a process forked after the drivers were loaded: it has none of their threads and would hang."""
    if _drivers_of not in (None, os.getpid()):
        raise PhotositeError(
            f"OpenCL in process {os.getpid()}: it was forked from one that had used OpenCL, and drivers do not survive that; "
            "start workers before OpenCL is used, or with the method 'spawn' or 'forkserver' of multiprocessing "
            "(PyTorch: DataLoader(..., multiprocessing_context='forkserver'))"
        )


def _all_devices() -> list[cl.Device]:
    """Return all devices in the default order."""
    global _drivers_of
    _require_living_drivers()
    _drivers_of = os.getpid()
    try:
        found = [device for platform in cl.get_platforms() for device in platform.get_devices()]
    except cl.Error as error:
        raise PhotositeError(f"no OpenCL platform found ({error}); {INSTALL_HINT}") from None
    if not found:
        raise PhotositeError(f"no OpenCL device found; {INSTALL_HINT}")
    return sorted(found, key=default_order)


def devices() -> list[DeviceInfo]:
    """Return all OpenCL devices, the default one first. Raises PhotositeError when there is none."""
    return [_info(device) for device in _all_devices()]


def has_devices() -> bool:
    """Return whether there is any OpenCL device."""
    try:
        return bool(_all_devices())
    except PhotositeError:
        return False


@dataclass(frozen=True)
class Kernel:
    """A compiled kernel.

    arguments: type of each argument, by name, in order: "*" for a buffer, the name of a scalar type, or the dtype of a struct.
    """

    name: str
    function: cl.Kernel
    arguments: dict[str, str | np.dtype]

    def bind(self, name: str, value: Any) -> Any:
        """Convert a value to the declared type. Raises TypeError when the fields of a struct are not exactly those declared."""
        kind = self.arguments[name]
        if isinstance(kind, np.dtype):
            return packed_struct(kind, value, f"{name} of {self.name}")
        return SCALARS[kind](value) if kind in SCALARS else value


CPU_ROW_PX = 1024  # work-items; starting a work-group on a CPU costs more time than computing 500 photosites
CPU_SPAN = 64  # photosites per work-item in kernels whose innermost loop runs over them; on a GPU it is 1
GPU_ROW_PX = 256  # work-items; a group size that every GPU supports
CONSTANT_BYTES = 2**16  # constant memory that every OpenCL device has (OpenCL 1.2, table 4.3)
SHORTEST_ROW_PX = 32  # work-items; shorter groups waste lanes of a GPU, and on a CPU take longer to start than to run
FEW_GROUPS = 4096  # work-groups that PoCL starts within 50 us of processor time
FEW_ITEMS = 16  # work-items of a group of so small a launch: as many as a CPU's widest vector has float32 lanes


def _without_compiler_warnings() -> AbstractContextManager:
    """Ignore warnings of compilers, which some give without a cause."""
    return warnings.catch_warnings(action="ignore", category=CompilerWarning)


ProgramKey = tuple[str, tuple[tuple[str, str], ...]]  # file in kernels/, and names and values of its macros


def _program_key(file: str, defines: Mapping[str, object]) -> ProgramKey:
    return file, tuple((macro, f"{value}") for macro, value in defines.items())


class Device:
    """An OpenCL device with its context, its queue and the kernels built for it.

    row_px: largest number of work-items of a group that runs along a row. span: photosites per work-item in kernels whose
    innermost loop runs over them. constant_bytes: constant memory for the parameters of a launch. shares_memory: whether
    kernels can work on the host's arrays without a copy. few_groups: number of work-groups up to which a launch is split into
    groups of few sizes; PoCL compiles a kernel anew for each size, in 0.2 to 0.6 s.
    """

    def __init__(self, device: cl.Device) -> None:
        self.info = _info(device)
        wanted = CPU_ROW_PX if device.type & cl.device_type.CPU else GPU_ROW_PX
        self.row_px = min(wanted, device.max_work_group_size)
        self.span = CPU_SPAN if device.type & cl.device_type.CPU else 1
        self.constant_bytes = CONSTANT_BYTES
        self.few_groups = FEW_GROUPS if self.span > 1 and _pocl_version(device) > (-1,) else 0
        self.shares_memory = bool(device.type & cl.device_type.CPU)
        self._own_context = cl.Context([device])
        self._own_queue = cl.CommandQueue(self._own_context)
        self._pages = HugePages(self._passing)
        self._kernels: dict[tuple, Kernel] = {}
        self._launching, self._building = Lock(), Lock()
        self._programs: dict[ProgramKey, Future[cl.Program]] = {}  # a file with its macros; its kernels share a build

    @property
    def _context(self) -> cl.Context:
        _require_living_drivers()
        return self._own_context

    @property
    def _queue(self) -> cl.CommandQueue:
        _require_living_drivers()
        return self._own_queue

    def upload(self, array: np.ndarray) -> cl.Buffer:
        """Return a buffer with a copy of an array."""
        return self._buffer(cl.mem_flags.READ_WRITE | cl.mem_flags.COPY_HOST_PTR, hostbuf=np.ascontiguousarray(array))

    def share(self, array: np.ndarray) -> cl.Buffer:
        """Return a buffer that uses the memory of a contiguous array on a CPU, or a copy of it on other devices.

        The array must exist as long as the buffer is used. After `collect` it contains what kernels wrote to the buffer.
        """
        if not self.shares_memory:
            return self.upload(array)
        flags = cl.mem_flags.USE_HOST_PTR | (cl.mem_flags.READ_WRITE if array.flags.writeable else cl.mem_flags.READ_ONLY)
        return self._buffer(flags, hostbuf=array)

    def receive(self, array: np.ndarray) -> cl.Buffer:
        """Return a buffer for what kernels write, which `collect` brings to a contiguous array: its own memory on a CPU.

        The array must exist as long as the buffer is used.
        """
        return self.share(array) if self.shares_memory else self.empty(array.shape, array.dtype)

    @counted_as("device")
    def collect(self, buffer: cl.Buffer, array: np.ndarray) -> None:
        """Wait for all work and copy a buffer made by `share` or `receive` to its array, where the two do not share memory."""
        if not self.shares_memory:
            cl.enqueue_copy(self._queue, array, buffer)
            return
        mapped, _ = cl.enqueue_map_buffer(self._queue, buffer, cl.map_flags.READ, 0, array.shape, array.dtype)
        mapped.base.release(self._queue)
        self._queue.finish()

    def array(self, shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
        """Return an uninitialised array of the host; a large one has memory that an earlier one needs no more."""
        size = math.prod(shape) * np.dtype(dtype).itemsize
        if not HAS_HUGE_PAGES or size < LARGE_BYTES:
            return np.empty(shape, dtype)
        return self._pages.take(size).view(dtype).reshape(shape)

    def empty(self, shape: tuple[int, ...], dtype: DTypeLike) -> cl.Buffer:
        """Return an uninitialised buffer for an array of this shape. Raises PhotositeError when it does not fit."""
        return self._buffer(cl.mem_flags.READ_WRITE, int(np.prod(shape)) * np.dtype(dtype).itemsize)

    def _buffer(self, flags: int, size: int = 0, hostbuf: np.ndarray | None = None) -> cl.Buffer:
        """Return a buffer of `size` bytes, or over `hostbuf`. Raises PhotositeError when it does not fit."""
        try:
            if HAS_HUGE_PAGES and self.shares_memory and size >= LARGE_BYTES:  # 0 for one over an array
                flags, size, hostbuf = flags | cl.mem_flags.USE_HOST_PTR, 0, self._pages.take(size)
            return cl.Buffer(self._context, flags, size, hostbuf)
        except (cl.Error, MemoryError, OSError) as error:
            needed = size or (0 if hostbuf is None else hostbuf.nbytes)
            raise PhotositeError(
                f"out of memory on {self.info.label}: no room for {needed / 2**20:.0f} MiB "
                f"({error}); read out a part of the sensor with camera.window"
            ) from None

    def write(self, buffer: cl.Buffer, array: np.ndarray, offset: int) -> None:
        """Copy an array into a buffer, starting at byte `offset`."""
        cl.enqueue_copy(self._queue, buffer, np.ascontiguousarray(array), dst_offset=offset)

    def copy(self, source: cl.Buffer, target: cl.Buffer, first: int, to: int, count: int) -> None:
        """Copy `count` bytes from byte `first` of a buffer to byte `to` of another."""
        cl.enqueue_copy(self._queue, target, source, src_offset=first, dst_offset=to, byte_count=count)

    def zeros(self, shape: tuple[int, ...], dtype: DTypeLike) -> cl.Buffer:
        """Return a buffer of zeros for an array of this shape."""
        return self._filled(shape, np.zeros((), dtype))

    def ones(self, shape: tuple[int, ...], dtype: DTypeLike) -> cl.Buffer:
        """Return a buffer of ones for an array of this shape."""
        return self._filled(shape, np.ones((), dtype))

    def fill(self, buffer: cl.Buffer, value: np.ndarray | np.number, offset: int) -> None:
        """Fill a buffer with copies of a value, from byte `offset` to its end."""
        cl.enqueue_fill_buffer(self._queue, buffer, np.asarray(value), offset, buffer.size - offset)

    def _filled(self, shape: tuple[int, ...], value: np.ndarray) -> cl.Buffer:
        """Return a buffer for an array of this shape, filled with a value given as an array of shape ()."""
        buffer = self.empty(shape, value.dtype)
        self.fill(buffer, value, 0)
        return buffer

    @counted_as("device")
    def download(self, buffer: cl.Buffer, shape: tuple[int, ...], dtype: DTypeLike) -> np.ndarray:
        """Wait for all work enqueued before, and return the content of a buffer as an array."""
        array = self.array(shape, dtype)
        cl.enqueue_copy(self._queue, array, buffer)
        return array

    @contextmanager
    def view(self, buffer: cl.Buffer, shape: tuple[int, ...], dtype: DTypeLike) -> Iterator[np.ndarray]:
        """Wait for all work, and yield an array of what a buffer holds, which is not to be changed, nor used afterwards.

        It is the buffer's own memory on a CPU, and a copy of it on other devices.
        """
        if not self.shares_memory:
            yield self.download(buffer, shape, dtype)
            return
        self.finish()
        mapped, _ = cl.enqueue_map_buffer(self._queue, buffer, cl.map_flags.READ, 0, shape, np.dtype(dtype))
        mapped.flags.writeable = False
        try:
            yield mapped
        finally:
            mapped.base.release(self._queue)

    def download_later(self, buffer: cl.Buffer, shape: tuple[int, ...], dtype: DTypeLike) -> Callable[[], np.ndarray]:
        """Return a function that returns what a buffer has held here, as an array, while what is enqueued later goes on."""
        array = self.array(shape, dtype)
        event = cl.enqueue_copy(self._queue, array, buffer, is_blocking=False)
        self._queue.flush()

        @counted_as("device")
        def wait() -> np.ndarray:
            event.wait()
            return array

        return wait

    @counted_as("device")
    def finish(self) -> None:
        """Wait until all work is done."""
        self._queue.finish()

    def mark(self) -> Callable[[], object]:
        """Return a function that waits until all work enqueued so far is done, while what is enqueued later goes on."""
        event = cl.enqueue_marker(self._queue)
        self._queue.flush()
        return event.wait

    def _passing(self) -> Callable[[], bool]:
        """Return a function that tells whether all work enqueued so far is done."""
        event = cl.enqueue_marker(self._queue)
        return lambda: event.command_execution_status == cl.command_execution_status.COMPLETE

    def kernel(self, name: str, defines: dict[str, object], file: str | None = None) -> Kernel:
        """Return the kernel `name` of kernels/<file> (default <name>.cl), built once for those macros that the file reads."""
        file = file or f"{name}.cl"
        defines = read_macros(file, defines)
        key = (file, tuple(defines.items()))
        if (*key, name) not in self._kernels:
            with _without_compiler_warnings():
                function = cl.Kernel(self._program(file, defines, name), name)
            self._kernels[*key, name] = Kernel(name, function, declared_arguments(kernel_source(file), name))
        return self._kernels[*key, name]

    def used_programs(self) -> list[ProgramKey]:
        """Return the programs whose kernels were asked for, in the order in which they were."""
        return list(dict.fromkeys(_program_key(file, dict(defines)) for file, defines, _ in self._kernels))

    def build_program(self, program: ProgramKey) -> None:
        """Build a program that `kernel` then finds built, on a thread that changes no filters of warnings.

        Raises PhotositeError when the driver cannot build it, and OSError for a file that there is not.
        """
        file, defines = program
        self._program(file, read_macros(file, dict(defines)), file)

    @counted_as("build")
    def _program(self, file: str, defines: Mapping[str, object], name: str) -> cl.Program:
        """Return the program of a file with these macros, which one thread builds, and for which others wait.

        name: of a kernel, for the error's message.
        """
        key = _program_key(file, defines)
        with self._building:
            is_there = key in self._programs
            program = self._programs.setdefault(key, Future())
        if not is_there:
            try:
                program.set_result(self._build(kernel_source(file), name, defines))
            except BaseException as error:
                del self._programs[key]  # the next one tries again
                program.set_exception(error)
        return program.result()

    def build(self, source: str, name: str, defines: dict[str, object]) -> Kernel:
        """Build the kernel `name` from expanded source text, with these macros (pyopencl caches builds on disk).

        Raises PhotositeError when the driver cannot build it.
        """
        with _without_compiler_warnings():
            return Kernel(name, cl.Kernel(self._build(source, name, defines), name), declared_arguments(source, name))

    @counted_as("build")
    def _build(self, source: str, name: str, defines: Mapping[str, object]) -> cl.Program:
        """Return the program of expanded source text with these macros. name: of a kernel, for the error's message."""
        macros = "".join(f"#define {macro} {value}\n" for macro, value in defines.items())
        try:
            return cl.Program(self._context, macros + source).build()
        except cl.Error as error:
            if UNKNOWN_PROCESSOR in str(error):
                message = f"the compiler of {self.info.label} is older than this processor, for which it builds no kernel"
                raise PhotositeError(f"{message}; {NEWER_HINT}") from None
            raise PhotositeError(f"{self.info.label} cannot build the kernel {name}: {error}") from None

    def check(self) -> None:
        """Build a kernel. Raises PhotositeError when the driver cannot."""
        self.build("kernel void check(global float *out) { out[0] = 0.0f; }", "check", {})

    @counted_as("device")
    def run(self, kernel: Kernel, global_size: tuple[int, ...], local_size: tuple[int, ...] | None, **arguments: Any) -> None:
        """Enqueue a kernel; scalars are cast to the declared type, structs are given as mappings from field to value.

        local_size: size of a work-group; None: the longest part of a row that divides the row evenly.
        Raises TypeError when the names are not exactly those of the kernel, or of a struct's fields, and PhotositeError when
        the driver refuses the launch.
        """
        if set(kernel.arguments) != set(arguments):
            raise TypeError(f"{kernel.name} takes {sorted(kernel.arguments)}, not {sorted(arguments)}")
        local_size = local_size or self._group(global_size)
        values = [kernel.bind(name, arguments[name]) for name in kernel.arguments]
        try:
            with self._launching:  # a kernel keeps one set of arguments for all threads
                kernel.function(self._queue, global_size, local_size, *values)
        except cl.Error as error:
            raise PhotositeError(f"{self.info.label} cannot run {kernel.name}: {error}") from None

    def _group(self, global_size: tuple[int, ...]) -> tuple[int, ...] | None:
        """Return a work-group size that divides a row evenly, or None, the driver's choice, where a row has no good divisor."""
        row, *others = global_size
        even = math.gcd(row, FEW_ITEMS)
        if row // even * math.prod(others) <= self.few_groups:
            return (even, *(1 for _ in others))
        width = next(size for size in range(min(self.row_px, row), 0, -1) if row % size == 0)
        return (width, *(1 for _ in others)) if width >= SHORTEST_ROW_PX or width == row else None


@functools.cache
def _log_choice(label: str) -> None:
    logging.getLogger(__name__).info("device: %s", label)


_opening = Lock()


@functools.cache
def _opened(device: cl.Device) -> Device:
    return Device(device)


@counted_as("device")
def find_device(name: str | None = None) -> Device:
    """Return the device of `open_device`, which tells of no choice. Raises PhotositeError as that does."""
    wanted = name or os.environ.get("PHOTOSITE_DEVICE", "")
    with _opening:
        found = _all_devices()
        for device in found:
            if wanted.lower() in _info(device).label.lower():
                return _opened(device)
    labels = "\n  ".join(_info(device).label for device in found)
    raise PhotositeError(f"no OpenCL device matches {wanted!r}; give a part of one of these names:\n  {labels}")


@functools.cache
def open_device(name: str | None = None) -> Device:
    """Return the device whose label contains `name` (case-insensitive).

    name: by default $PHOTOSITE_DEVICE, else the first device in `default_order` is taken.
    The log `simulator.device` names the device once in a process. A forked process opens a device of its own, which works
    unless its parent process has used OpenCL.
    Raises PhotositeError when nothing matches, listing all devices, and in a process forked after its parent used OpenCL.
    """
    device = find_device(name)
    _log_choice(device.info.label)
    return device


def _forget_devices() -> None:
    """Let a forked process open devices of its own, also where another thread was opening one."""
    global _opening
    _opening = Lock()
    _opened.cache_clear()
    open_device.cache_clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_devices)
