"""Units of logs, by pint, to SI; the spellings of data sheets and loggers on top of pint's own."""

import functools
import re

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RecordingError

# the longest ending that fits is a column's unit
ENDINGS = {
    "_rad_per_s": "rad/s",
    "_rad": "rad",
    "_Nm": "N*m",
    "_A": "A",
    "_V": "V",
    "_C": "degC",
    "_s": "s",
}
SPELLINGS = (
    (r"^(deg(ree)?s?\s*C|°\s*C|celsius)$", "degC"),
    (r"°", "deg"),
    (r"\bdegs\b|\bdegrees\b|\bgrad\b|\bgrados?\b", "deg"),  # grad: German, not the gon
    (r"\b(revs?|turns?|rotations?|revolutions?|U|tr)\b", "turn"),
    (r"\b(counts?|cts?|ticks?|pulses|inc|incr|increments?|lsb)\b", "count"),
    (r"\b(sec|secs|seconds)\b", "s"),
    (r"\b(msec|msecs|millis)\b", "ms"),
    (r"\b(usec|usecs|micros)\b", "us"),
    (r"\bohms?\b", "ohm"),
    (r"\b([mkµuc]?)N[\s.·*-]?([mc]?m)\b", r"\1N*\2"),
    (r"\bkgf?[\s.·*-]?cm\b", "kgf*cm"),
    (r"\boz[\s.·*-]?in\b", "ozf*in"),
    (r"\b(amps?|amperes?)\b", "A"),
    (r"\b(volts?)\b", "V"),
    (r"(?<=[A-Za-z])s-1\b", "/s"),
    (r"^(pct|per ?cent|%)$", "percent"),
    (r"^(-|1|pu|p\.u\.)$", "dimensionless"),
)


@functools.cache
def _registry():
    import pint  # takes a second to load: only a log in own units needs it

    # without pint's cache: it keeps paths of the environment that filled it, which may be gone
    return pint.UnitRegistry()


LINEAR = {"rad": "m", "rad/s": "m/s", "N*m": "N"}
"""Units of a linear axis, of which 1 m is written as 1 rad and 1 N as 1 Nm."""


@functools.cache
def factor_and_offset(
    unit: str, target: str, counts_per_rev: float | None = None, *, linear: bool = False
) -> tuple[float, float]:
    """SI value = factor * reading + offset.

    Parameters
    ----------
    unit : str
        As the log has it: "deg", "mA", "rpm", "percent", "count", "ms".
    target : str
        The unit of the contract's column.
    counts_per_rev : float or None
        Of an encoder whose readings are counts.
    linear : bool
        Whether the axis is linear: metres and newtons are units of it too.

    Raises
    ------
    RecordingError
        If the unit is unknown or of another dimension than the target.
    """
    registry = _registry()
    text = unit.strip()
    for pattern, instead in SPELLINGS:
        text = re.sub(pattern, instead, text, flags=re.I if "N[" not in pattern else 0)
    try:
        given, wanted = registry.Unit(text), registry.Unit(target)
        if linear and target in LINEAR and given.dimensionality == _dimensions(LINEAR[target]):
            wanted = registry.Unit(LINEAR[target])
        is_count = "count" in str(given)
        if is_count and counts_per_rev is None:
            raise RecordingError(f'unit "{unit}" needs counts_per_rev')
        zero, one = (registry.Quantity(v, given).to(wanted).magnitude for v in (0.0, 1.0))
    except RecordingError:
        raise
    except Exception as problem:  # pint raises many kinds for text that is no unit
        if "Dimensionality" in type(problem).__name__:
            raise RecordingError(f'unit "{unit}" is no unit of {target}') from problem
        raise RecordingError(f'unit "{unit}" is not known') from problem
    angular = wanted in (registry.Unit("rad"), registry.Unit("rad/s"))
    plain = registry.Unit(text).dimensionless and text in ("percent", "dimensionless", "%")
    if angular and plain:
        raise RecordingError(f'unit "{unit}" is no unit of {target}')
    scale = 2.0 * np.pi / counts_per_rev if is_count else 1.0
    return float(one - zero) * scale, float(zero)


def _dimensions(unit: str):
    return _registry().Unit(unit).dimensionality


def to_si(
    values: NDArray, unit: str, target: str, counts_per_rev: float | None = None, *,
    linear: bool = False,
) -> NDArray:  # fmt: skip
    """Readings in the unit of the contract's column; errors as `factor_and_offset`."""
    factor, offset = factor_and_offset(unit, target, counts_per_rev, linear=linear)
    return values if (factor, offset) == (1.0, 0.0) else factor * values + offset


def unit_of_column(column: str) -> str:
    """The unit that a column of the contract ends with; "dimensionless" without one."""
    found = [end for end in ENDINGS if column.endswith(end)]
    return ENDINGS[max(found, key=len)] if found else "dimensionless"
