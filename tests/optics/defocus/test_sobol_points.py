"""Sobol' points without SciPy are those of SciPy."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.stats import qmc

from simulator.color.color_tables import CONFIGS
from simulator.optics.defocus.aperture_samples import MOST_OF_ALL
from simulator.optics.defocus.sobol_points import MOST, sobol_points


@pytest.mark.parametrize("power", [0, 1, 5, 10, 13])
def test_they_are_those_of_scipy(power):
    assert np.array_equal(sobol_points(2**power), qmc.Sobol(5, seed=1).random_base2(power))


def test_there_are_as_many_as_a_block_may_take():
    assert MOST == MOST_OF_ALL == 2**13
    with pytest.raises(ValueError, match="8193 points"):
        sobol_points(MOST + 1)


def test_a_blurred_shot_does_not_wait_for_scipys_statistics():
    code = """
import sys
from simulator.optics.defocus.aperture_samples import aperture_samples
from simulator.optics.pupil.pupil import Pupil
aperture_samples(Pupil(), 64, 1)
print("scipy.stats" in sys.modules)
"""
    environment = os.environ | {"PYTHONPATH": str(CONFIGS.parent)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
    assert done.stdout.strip() == "False"
