"""Units as annotations: the number is kept in the unit that ends the field's name.

`exposure_time_s: Seconds` holds seconds. The configuration reads the annotation: it drops the
suffix from the key (`exposure_time`) and demands a quantity with a unit (`1/125 s`) there.
No other code reads these objects, so they cost nothing in computations.
"""

from dataclasses import dataclass
from typing import Annotated, get_args

COUNT_SUFFIX = "_px"  # a count of pixels has no unit, and its key no suffix


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
DegreesPerSecond = Annotated[float, Unit("degree / second", "_deg_per_s")]
MetresPerSecond = Annotated[float, Unit("metre / second", "_m_per_s")]
MetresPerSecondSquared = Annotated[float, Unit("metre / second**2", "_m_per_s2")]
Hertz = Annotated[float, Unit("hertz", "_hz")]
Joules = Annotated[float, Unit("joule", "_j")]
FNumber = Annotated[float, Unit("f_number", "")]
TStop = Annotated[float, Unit("t_number", "")]


def unit_of(annotation: object) -> Unit | None:
    """Return the Unit of an annotation, also inside `X | None`; None without one."""
    for part in getattr(annotation, "__metadata__", ()):
        if isinstance(part, Unit):
            return part
    found = [unit_of(part) for part in get_args(annotation) if part is not annotation]
    return next(filter(None, found), None)


def key_of(name: str, annotation: object) -> str:
    """Return the YAML key of a dataclass field: its name without the unit's suffix."""
    unit = unit_of(annotation)
    return name.removesuffix(unit.suffix if unit else COUNT_SUFFIX) or name
