"""Kernels over the field: those of mirrored places are mirrored."""

from dataclasses import replace

import numpy as np
import pytest

from simulator.optics.lens.wavefront import Aberrations
from simulator.optics.psf.field_psf import FieldPsf
from simulator.optics.psf.pixel_aperture import Sampling
from simulator.optics.psf.wavefront_psf import WavefrontPsf
from simulator.optics.pupil.pupil import Pupil


@pytest.mark.parametrize("over", [1, 2])
@pytest.mark.parametrize("sampling", [Sampling(), Sampling(0.6, 3.0)])
def test_kernels_of_mirrored_places_are_those_computed_there(over, sampling):
    """Coma and astigmatism, every node, against a fine table of the same lens, whose kernels are turned to each place alone."""
    lens = WavefrontPsf(Aberrations(coma_um=0.6, astigmatism_um=0.4), 4.0, 5.0, ((550.0,),), 1, 1)
    psf = FieldPsf(lens, Pupil(), sampling, 5.0, over, (0.0,), True, (600, 400), (5, 4), field_steps=8)
    table = replace(psf, lens_psf=psf.fit_kernel(0.0).table([0.0], np.linspace(0.0, 1.0, 33)))
    for row, column in np.ndindex(*psf.nodes):
        found, wanted = (each.kernel(0, 0, False, row, column) for each in (psf, table))
        np.testing.assert_allclose(found, wanted, rtol=0, atol=2e-3 * wanted.max())
    first, last = (psf.kernel(0, 0, False, *node) for node in ((0, 0), (4, 3)))
    assert np.abs(first - last).max() > 1e-2 * first.max()
