"""Write tests/files/envi.hdr and envi.img with Spectral Python (0.25 was used): python tests/files/write_envi.py."""

from pathlib import Path

import numpy as np
import spectral.io.envi as envi

if __name__ == "__main__":
    rows, columns, bands = np.indices((3, 4, 5))
    envi.save_image(
        str(Path(__file__).with_name("envi.hdr")),
        (1000 * rows + 100 * columns + 10 * bands + 1).astype(np.uint16),
        interleave="bil",
        metadata={
            "wavelength": [0.45, 0.5, 0.55, 0.6, 0.65],
            "wavelength units": "Micrometers",
            "reflectance scale factor": 10000,
            "bbl": [1, 1, 1, 1, 0],
        },
        force=True,
    )
