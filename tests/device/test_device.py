"""The device layer: choice of device, binding by name, builds, and its messages."""

import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyopencl as cl
import pytest
from helpers.kernel_bench import device_like

from simulator.device import default_order, devices, open_device
from simulator.errors import PhotositeError
from simulator.optics.geometry.projection import ANY_CFA, Projection


def test_a_device_is_found_by_part_of_its_label():
    info = devices()[0]
    assert open_device(info.label[2:20].upper()).info == info


def test_the_environment_names_the_device(monkeypatch):
    monkeypatch.setenv("PHOTOSITE_DEVICE", "no such thing")
    open_device.cache_clear()
    with pytest.raises(PhotositeError, match="no such thing"):
        open_device()
    open_device.cache_clear()


def test_each_device_can_be_named_by_the_environment(monkeypatch):
    for info in devices():
        monkeypatch.setenv("PHOTOSITE_DEVICE", info.label)
        open_device.cache_clear()
        assert open_device().info.label == info.label
    monkeypatch.undo()
    open_device.cache_clear()


def listed(kind: str, version: str, **lacking: bool) -> SimpleNamespace:
    """A device as pyopencl lists it."""
    there = {"available": True, "compiler_available": True} | lacking
    return SimpleNamespace(type=getattr(cl.device_type, kind), platform=SimpleNamespace(version=f"OpenCL {version}"), **there)


def test_a_gpu_comes_before_a_cpu_and_a_newer_pocl_before_an_older():
    expected = [
        listed("GPU", "3.0 CUDA 12.4"),
        listed("GPU", "2.1 AMD-APP"),
        listed("GPU", "3.0 PoCL 6.0  Linux, CUDA"),
        listed("CPU", "3.0 PoCL 10.0  Linux"),
        listed("CPU", "3.0 PoCL 3.1+debian  Linux"),
        listed("CPU", "3.0 PoCL 3.0-rc2  Linux"),
        listed("CPU", "3.0 LINUX"),
        listed("ACCELERATOR", "1.2 FPGA"),
        listed("GPU", "3.0 CUDA 12.4", compiler_available=False),
    ]
    keys = [default_order(one) for one in expected]
    assert keys == sorted(keys) and keys[0] == keys[1]  # makers' GPUs stay in the loader's order
    assert len(set(keys)) == len(keys) - 1


ROOT = Path(__file__).parents[2]
SWEEP = """\
scene: {chart: flat_field, luminance: 100 cd/m^2}
lens: {focal_length: 50 mm, f_number: f/4, focus_distance: 2 m}
exposure: {time: 1/60 s, iso: 100}
camera: {base: sony_a7s2, window: {x: 0, y: 0, width: 64, height: 48}}
sweep: {vary: {exposure.iso: [100, 200]}}
"""
# What Python lacks on Windows.
WINDOWS = """
import os, signal, sys
posix = ("sysconf", "sysconf_names", "fork", "register_at_fork", "posix_fallocate", "sched_getaffinity", "getuid", "statvfs")
for name in posix:
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGKILL", "SIGALRM", "SIGUSR1", "SIGCHLD"):
    delattr(signal, name)
for name in ("fcntl", "resource", "pwd", "grp", "termios"):
    sys.modules[name] = None
"""


@pytest.mark.parametrize("system", ["", WINDOWS], ids=["this system", "a system without POSIX"])
def test_the_command_takes_a_sweep_and_names_its_device_once(tmp_path, system):
    (tmp_path / "s.yaml").write_text(SWEEP)
    program = system + "import sys\nfrom data_gen.command_line import main\nmain(sys.argv[1:])\n"
    command = [sys.executable, "-c", program, "simulate", tmp_path / "s.yaml", "--out", tmp_path / "out"]
    environment = os.environ | {"PYTHONPATH": f"{ROOT}"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    named = [line for line in done.stderr.splitlines() if line.startswith("device: ")]
    assert done.returncode == 0 and len(named) == 1, done.stderr
    assert named[0].removeprefix("device: ") in [info.label for info in devices()]
    ends = ("dng", "json", "truth.exr", "yaml")
    assert sorted(os.listdir(tmp_path / "out")) == ["manifest.csv"] + [f"s_000{one}.{end}" for one in (0, 1) for end in ends]


def test_compilers_find_no_fault_with_kernels_of_motion(tmp_path):
    shot = SWEEP.split("sweep")[0].replace("flat_field", "color_checker")
    (tmp_path / "s.yaml").write_text(shot + "motion: {camera: {roll: 90 deg/s}}\n")
    command = [sys.executable, "-c", "from data_gen.command_line import main\nmain()", "simulate", tmp_path / "s.yaml"]
    environment = os.environ | {"PYTHONPATH": f"{ROOT}", "POCL_CACHE_DIR": f"{tmp_path}", "PYOPENCL_NO_CACHE": "1"}
    done = subprocess.run([*command, "--out", tmp_path / "out"], capture_output=True, text=True, env=environment, timeout=120)
    words = [line for line in done.stderr.splitlines() if not line.startswith("device: ")]
    assert done.returncode == 0 and not words, done.stderr


def test_all_modules_can_be_imported_without_posix():
    found = [path for house in ("simulator", "data_gen") for path in (ROOT / house).rglob("*.py")]
    files = [path.relative_to(ROOT).with_suffix("") for path in found]
    names = sorted(".".join(file.parts) for file in files if file.name not in ("__init__", "__main__", "torch"))
    program = WINDOWS + "import importlib\nfor name in sys.argv[1:]:\n    importlib.import_module(name)\n"
    environment = os.environ | {"PYTHONPATH": f"{ROOT}"}
    command = [sys.executable, "-c", program, *names]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)
    assert done.returncode == 0, done.stderr


def test_an_unknown_device_lists_those_there_are():
    with pytest.raises(PhotositeError) as failure:
        open_device("abacus")
    assert "abacus" in str(failure.value) and devices()[0].label in str(failure.value)


def test_arguments_are_bound_by_name_and_a_misspelt_one_is_an_error(device):
    kernel = device.kernel("camera_planes", {"BANDS": 1, "CHANNELS": 1})
    buffer = device.upload(np.ones(4, np.float32))
    with pytest.raises(TypeError, match="planes.*scene.*weights"):
        device.run(kernel, (4, 1), None, scene=buffer, wieghts=buffer, planes=device.empty((4,), np.float32))


def test_a_kernel_is_built_once(device):
    defines = {"BANDS": 7, "CHANNELS": 2}
    assert device.kernel("camera_planes", defines) is device.kernel("camera_planes", defines)


def test_kernels_of_one_file_and_the_same_macros_share_a_build(device):
    """A build that the driver has on disk still takes a fiftieth of a second."""
    defines = Projection(0.7, -1.0, -0.5, 5, 4, 1, False).defines(ANY_CFA) | {"SPAN": 1}
    kernels = [device.kernel(name, defines, file="projection.cl") for name in ("projection_planes", "projection_radius")]
    assert len({kernel.function.get_info(cl.kernel_info.PROGRAM).int_ptr for kernel in kernels}) == 1


def test_a_broken_kernel_is_one_message(device):
    with pytest.raises(PhotositeError, match="cannot build the kernel broken"):
        device.build("kernel void broken( {", "broken", {})


def test_a_compiler_older_than_the_processor_says_what_to_install(device):
    """PoCL from pip on a processor of later years says so of every kernel."""
    device.check()
    with pytest.raises(PhotositeError, match="older than this processor.*apt install pocl-opencl-icd"):
        device.build("#error unknown target CPU 'generic'\nkernel void any() {}", "any", {})


def test_too_large_a_buffer_says_what_did_not_fit(device):
    with pytest.raises(PhotositeError, match="out of memory.*MiB.*camera.window"):
        device.empty((2**50,), np.float32)


def test_macros_that_a_file_does_not_read_need_no_build_of_their_own(device):
    defines = {"BANDS": 1, "CHANNELS": 1}
    kernel = device.kernel("camera_planes", defines)
    assert device.kernel("camera_planes", defines | {"CFA_00": 3, "NODES_PER_PX": "2.0f"}) is kernel
    assert device.kernel("camera_planes", defines | {"CHANNELS": 2}) is not kernel


GROUP = """kernel void group(global uint *size) {
    size[get_global_id(1) * get_global_size(0) + get_global_id(0)] = get_local_size(0);
}"""


@pytest.fixture(scope="module")
def group_of(device):
    """Returns the number of work-items of a group of a launch of this size, on a device with other settings."""
    kernel = device.build(GROUP, "group", {})

    def size(width: int, height: int, **settings: int) -> int:
        found = device.zeros((height, width), np.uint32)
        device_like(device, **settings).run(kernel, (width, height), None, size=found)
        (one,) = set(device.download(found, (height, width), np.uint32).ravel().tolist())
        return one

    return size


@pytest.mark.parametrize(
    ("width", "height", "items"), [(43, 30, 1), (90, 40, 2), (240, 100, 16), (240, 273, 16), (240, 274, 240)]
)
def test_small_launches_share_few_sizes_of_groups(group_of, width, height, items):
    """PoCL compiles a kernel for each size; 240 x 273 are 4095 groups of 16."""
    assert group_of(width, height, few_groups=4096) == items


@pytest.mark.parametrize(("width", "items"), [(240, 240), (2040, 1020)])
def test_other_launches_have_the_longest_groups_that_divide_a_row(group_of, width, items):
    assert group_of(width, 2, few_groups=0, row_px=1024) == items


def test_only_pocl_gets_few_sizes_of_groups():
    for info in devices():
        assert (open_device(info.label).few_groups > 0) == ("PoCL" in info.version)


def test_a_view_is_what_a_buffer_holds_and_cannot_be_changed(device):
    """Of the first elements; kernels may write to the buffer again afterwards."""
    buffer = device.upload(np.arange(6, dtype=np.float32))
    with device.view(buffer, (2, 2), np.float32) as seen:
        assert seen.tolist() == [[0.0, 1.0], [2.0, 3.0]]
        assert not (device.shares_memory and seen.flags.writeable)
    device.fill(buffer, np.float32(7.0), 0)
    with device.view(buffer, (6,), np.float32) as seen:
        assert (seen == 7.0).all()
