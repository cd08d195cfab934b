"""Frames share a build of a kernel where they have the same of the stages that it runs."""

import pytest

from simulator.sensor.kernel.kernel_launch import FrameSetting, KernelPart, form_launch_groups
from simulator.sensor.kernel.noise_free import STAGES
from simulator.sensor.stages.adc import Adc
from simulator.sensor.stages.analog_gain import AnalogGain
from simulator.sensor.stages.column_offset import ColumnOffset
from simulator.sensor.stages.full_well import FullWell
from simulator.sensor.stages.prnu import Prnu

PLAIN = (AnalogGain(2.0), Adc(12, 64.0))


@pytest.mark.parametrize(
    ("stems", "numbers"),
    [
        (KernelPart.WHOLE.stems, [3, 4, 4, 4]),
        (KernelPart.CHARGE.stems, [0, 1, 1]),
        (KernelPart.READOUT.stems, [3, 4]),
        (STAGES, [3, 4]),
    ],
)
def test_stages_that_a_kernel_does_not_run_need_no_build(stems, numbers):
    """A plain frame, one with PRNU, one with a full well, one with column offsets; gain, black and white level are numbers."""
    settings = [FrameSetting((*PLAIN, *more)) for more in ((), (Prnu(0.01),), (FullWell(1000.0),), (ColumnOffset(1.0),))]
    groups = list(form_launch_groups(settings, stems, 2**16))
    assert sorted(group.numbers.shape[1] for group in groups) == numbers
    assert sorted(place for group in groups for place in group.places) == [0, 1, 2, 3]
