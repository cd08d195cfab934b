"""Prints, as JSON, the checksum of a capture in each of two workers: python capture_in_workers.py METHOD USES_OPENCL_BEFORE."""

import json
import multiprocessing
import sys
import zlib

import numpy as np

from simulator.device import open_device
from simulator.sensor.camera.published_noise_model import noise_model_stages
from simulator.sensor.frame_stack import FrameSetting, expose_frame_stack
from simulator.sensor.seeds import Seeds


def checksum(frame: int) -> int:
    """Of the codes of one frame."""
    setting = FrameSetting(noise_model_stages(1.0, 2.0, bit_depth=14, black_level_dn=64.0), Seeds(frame=frame))
    return zlib.crc32(expose_frame_stack(open_device(), np.full((1, 32, 64), 50.0), [setting]).tobytes())


def main() -> None:
    """Work in the workers, then in this process, which is the expected."""
    method, before = sys.argv[1], sys.argv[2] == "True"
    if before:
        checksum(0)
    with multiprocessing.get_context(method).Pool(2) as pool:
        found = pool.map_async(checksum, range(4)).get(timeout=60)
    print(json.dumps({"workers": found, "expected": [checksum(frame) for frame in range(4)]}))


if __name__ == "__main__":
    main()
