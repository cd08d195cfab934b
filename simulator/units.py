"""Units as annotations: the number is kept in the unit that ends the field's name.

`exposure_time_s: Seconds` holds seconds. The configuration reads the annotation: it drops the
suffix from the key (`exposure_time`) and demands a quantity with a unit (`1/125 s`) there.
Nothing else looks at these objects, so computing code pays nothing for them.
"""

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Unit:
    """Unit of a float field.

    symbol: pint expression of the unit the number is kept in.
    suffix: what ends the field's name and is absent from the configuration key.
    """

    symbol: str
    suffix: str


Seconds = Annotated[float, Unit("second", "_s")]
Metres = Annotated[float, Unit("metre", "_m")]
Millimetres = Annotated[float, Unit("millimetre", "_mm")]
Micrometres = Annotated[float, Unit("micrometre", "_um")]
Nanometres = Annotated[float, Unit("nanometre", "_nm")]
Degrees = Annotated[float, Unit("degree", "_deg")]
Kelvins = Annotated[float, Unit("kelvin", "_k")]
CandelasPerSquareMetre = Annotated[float, Unit("candela / metre**2", "_cd_m2")]
Electrons = Annotated[float, Unit("electron", "_e")]
ElectronsPerSecond = Annotated[float, Unit("electron / second", "_e_per_s")]
DigitalNumbers = Annotated[float, Unit("DN", "_dn")]
DigitalNumbersPerElectron = Annotated[float, Unit("DN / electron", "_dn_per_e")]
FNumber = Annotated[float, Unit("f_number", "")]
