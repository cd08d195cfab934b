"""Share of photosites that are clipped."""

from dataclasses import dataclass

import numpy as np

from simulator.measurement.quantities.measured_frame import Area, MeasuredFrame, Plane
from simulator.measurement.quantities.quantity import Figure, Measured


@dataclass(frozen=True)
class ClippedShare:
    """Share of codes at the white level or above, and of codes at 0, where a camera without pedestal ends.

    white = photosites with code >= white level / photosites; black = photosites with code 0 / photosites. Counts, exact.

    area: [top, left, height, width] in photosites; left out, the whole frame.
    plane: R, G, Gr, Gb, B or MONO; left out, all photosites.
    """

    area: Area | None = None
    plane: Plane | None = None

    def measure(self, frame: MeasuredFrame) -> Measured:
        """Count. Raises PhotositeError for an area or a colour that the frame does not have."""
        if self.plane is None:
            codes = frame.dn[frame.cut(self.area)].ravel()
        else:
            codes = np.concatenate([part.ravel() for part in frame.planes(frame.dn, self.plane, self.area)])
        shares = {"white": np.mean(codes >= frame.white_level_dn), "black": np.mean(codes == 0)}
        return Measured({name: Figure(float(share), "", 0.0) for name, share in shares.items()})
