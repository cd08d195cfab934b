"""A small U-Net for packed raw planes, after Ronneberger, Fischer, Brox, MICCAI 2015, as raw denoisers use it."""

import torch
from torch import nn
from torch.nn import functional


def _block(inside: int, outside: int) -> nn.Sequential:
    first, second = nn.Conv2d(inside, outside, 3, padding=1), nn.Conv2d(outside, outside, 3, padding=1)
    return nn.Sequential(first, nn.LeakyReLU(0.2), second, nn.LeakyReLU(0.2))


class SmallUnet(nn.Module):
    """Four planes to four planes, (batch, 4, height, width) float32; height and width are multiples of 4.

    width: channels of the finest of three levels. 8 gives 29,564 weights.
    """

    def __init__(self, width: int = 8) -> None:
        super().__init__()
        self.down = nn.ModuleList([_block(4, width), _block(width, 2 * width), _block(2 * width, 4 * width)])
        self.rise = nn.ModuleList(nn.ConvTranspose2d(2 * side, side, 2, 2) for side in (2 * width, width))
        self.up = nn.ModuleList(_block(2 * side, side) for side in (2 * width, width))
        self.last = nn.Conv2d(width, 4, 1)

    def forward(self, planes: torch.Tensor) -> torch.Tensor:
        """Return the clean planes."""
        seen = [self.down[0](planes)]
        for block in self.down[1:]:
            seen.append(block(functional.max_pool2d(seen[-1], 2)))
        found = seen.pop()
        for rise, block in zip(self.rise, self.up, strict=True):
            found = block(torch.cat([rise(found), seen.pop()], dim=1))
        return self.last(found)
