"""The ELD model in PyTorch on the CPU with all threads, as training loops write it, in float32 and in place."""

import os

import numpy as np
import torch
from measuring.contest import Contestant
from measuring.work import Sensor

NAME = f"PyTorch {torch.__version__} CPU, {os.cpu_count()} threads"


@torch.inference_mode()
def frame(mean_e: torch.Tensor, sensor: Sensor) -> torch.Tensor:
    """Codes (height, width) uint16."""
    signal = torch.poisson(mean_e)
    signal *= sensor.gain_dn_per_e
    u = torch.rand_like(signal).clamp_(2**-25, 1 - 2**-24)
    noise = u.pow(sensor.tukey_lambda)
    noise -= u.neg_().add_(1).pow_(sensor.tukey_lambda)
    signal.add_(noise, alpha=sensor.tukey_scale_dn / sensor.tukey_lambda)
    signal += sensor.row_dn * torch.randn(len(signal), 1)
    for place, bias in enumerate(sensor.color_bias_dn):
        signal[place // 2 :: 2, place % 2 :: 2] += bias
    signal += sensor.black_level_dn
    return signal.round_().clamp_(0, sensor.max_code).to(torch.uint16)


def contestant(mean_e: np.ndarray, sensor: Sensor) -> Contestant:
    torch.set_num_threads(os.cpu_count())
    torch.manual_seed(1)
    light, last = torch.from_numpy(mean_e), {}
    return Contestant(NAME, lambda: last.update(codes=frame(light, sensor)), lambda: last["codes"].numpy())
