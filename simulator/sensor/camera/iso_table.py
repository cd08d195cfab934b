"""A camera's measured ISO table, and its interpolation."""

import math
from bisect import bisect
from dataclasses import dataclass, replace
from itertools import pairwise

from simulator.errors import PhotositeError, require
from simulator.sensor.camera.camera_sections import ConversionGainSwitch, IsoSetting

EXTRAPOLATE = "set camera.iso_range: extrapolate"


@dataclass(frozen=True)
class IsoTable:
    """Measured lines by ISO.

    Between two lines, the logarithms of gain, read noise and row noise, and Tukey lambda and colour bias themselves, are
    interpolated linearly in ln ISO. Black and white level are those of the line nearest in ln ISO, the lower of two equal ones.
    A noise that is 0 at one end has no logarithm and is itself interpolated linearly in ln ISO.
    The two sides of a conversion-gain switch are separate tables, between which nothing is interpolated.
    Beyond the lines of a side, gain and noise continue with the slope of its last two lines; lambda and colour bias are those
    of the nearest line.
    """

    lines: dict[int, IsoSetting]
    switch: ConversionGainSwitch | None = None

    def __post_init__(self) -> None:
        line = "100: {gain: 0.1 DN/e-, read_noise: 1 DN}"
        require(bool(self.lines), "camera.iso_table", "{}", f"give at least one line such as `{line}`, or a read_noise_model")
        for iso in self.lines:
            require(iso > 0, "camera.iso_table", iso, "an ISO is above 0")
        for name in ("tukey_lambda", "color_bias_dn"):
            without = [iso for iso, setting in self.lines.items() if getattr(setting, name) is None]
            rule = f"has no {name.removesuffix('_dn')}, others have; give it in every line or in none"
            require(len(without) in (0, len(self.lines)), "camera.iso_table", without[0] if without else None, rule)
        if self.switch is not None:
            rule = "the lines hold the effect of the ratio already; leave it out, or give a read_noise_model"
            require(self.switch.ratio is None, "camera.conversion_gain.ratio", self.switch.ratio, rule)
            rule = "needs measured lines on both sides of it; leave conversion_gain out, or give them"
            require(len(self.sides()) == 2, "camera.conversion_gain.iso", self.switch.iso, rule)

    def sides(self) -> list[list[int]]:
        """Return the measured ISOs, ascending, of low and of high conversion gain; one list where there is no switch."""
        isos = sorted(self.lines)
        if self.switch is None:
            return [isos]
        return [side for high in (False, True) if (side := [iso for iso in isos if (iso >= self.switch.iso) == high])]

    def isos(self) -> tuple[int, ...]:
        """Return the measured ISOs, ascending."""
        return tuple(sorted(self.lines))

    def ranges(self) -> str:
        """Return the measured range of ISOs as text for messages."""
        return " and ".join(f"{side[0]} to {side[-1]}" if len(side) > 1 else f"{side[0]}" for side in self.sides())

    def setting(self, iso: float, extrapolate: bool, camera: str) -> IsoSetting:
        """Return the line at an ISO, measured or interpolated.

        camera: its name, for the message. Raises PhotositeError outside the measured range unless `extrapolate`.
        """
        if iso in self.lines:
            return self.lines[int(iso)]
        require(iso > 0, "exposure.iso", iso, "an ISO is above 0")
        side = self.sides()[-1 if self.switch is not None and iso >= self.switch.iso else 0]
        inside = side[0] <= iso <= side[-1]
        if not inside and not extrapolate:
            raise PhotositeError(
                f"the {camera} was not measured there, but at {self.ranges()}; give an ISO within, or {EXTRAPOLATE}",
                key="exposure.iso",
                value=iso,
            )
        rule = f"one measured line, at ISO {side[0]}, has no slope to extrapolate; give that ISO, or a second line"
        require(len(side) > 1, "exposure.iso", iso, rule)
        low, high = list(pairwise(side))[min(max(bisect(side, iso) - 1, 0), len(side) - 2)]
        return self._between(low, high, math.log(iso / low) / math.log(high / low))

    def _between(self, low: int, high: int, share: float) -> IsoSetting:
        """Return the line interpolated at this fraction of the interval from `low` to `high` in ln ISO."""
        first, second = self.lines[low], self.lines[high]
        nearest, held = (first if share <= 0.5 else second), min(max(share, 0.0), 1.0)
        shape, bias = first.tukey_lambda, first.color_bias_dn
        if shape is not None and second.tukey_lambda is not None:
            shape = (1.0 - held) * shape + held * second.tukey_lambda
        if bias is not None and second.color_bias_dn is not None:
            red, *greens, blue = ((1.0 - held) * a + held * b for a, b in zip(bias, second.color_bias_dn, strict=True))
            bias = (red, greens[0], greens[1], blue)
        return replace(
            nearest,
            gain_dn_per_e=_power_law(first.gain_dn_per_e, second.gain_dn_per_e, share),
            read_noise_dn=_power_law(first.read_noise_dn, second.read_noise_dn, share),
            row_noise_dn=_power_law(first.row_noise_dn, second.row_noise_dn, share),
            tukey_lambda=shape,
            color_bias_dn=bias,
        )


def _power_law(first: float, second: float, share: float) -> float:
    """Interpolate linearly in the logarithm, or linearly where a value is 0; share: fraction of the interval."""
    if min(first, second) > 0:
        return first * (second / first) ** share
    return max((1.0 - share) * first + share * second, 0.0)
