"""What a joint is to follow in angle, with its first two time derivatives."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError
from rsea_core.files.toml_tables import nearest, number, require_known

NEEDED = {
    "step": ("amplitude_rad",),
    "ramp": ("amplitude_rad", "rise_s"),
    "sine": ("amplitude_rad", "frequency_Hz"),
}


@dataclass(frozen=True, kw_only=True)
class AngleReference:
    """A reference for the load's angle.

    Attributes
    ----------
    kind : str
        "step": offset, and amplitude more from start_s on; "ramp": the same, risen smoothly (a
        polynomial of degree five without jerk at its ends) within rise_s; "sine": offset +
        amplitude sin(2 pi f (t - start_s)) from start_s on.
    amplitude_rad, offset_rad, frequency_Hz, rise_s, start_s : float

    Raises
    ------
    InputError
        If the kind is unknown, a value that it needs is missing, or a time is not positive.
    """

    unit: ClassVar[str] = "rad"

    kind: str
    amplitude_rad: float | None = None
    offset_rad: float = 0.0
    frequency_Hz: float | None = None
    rise_s: float | None = None
    start_s: float = 0.0

    def __post_init__(self):
        if self.kind not in NEEDED:
            raise InputError(f"reference {self.kind!r} is unknown; {nearest(self.kind, NEEDED)}")
        for f in fields(self)[1:]:
            value, where = getattr(self, f.name), f"reference {self.kind!r}: {f.name}"
            if value is None:
                if f.name in NEEDED[self.kind]:
                    raise InputError(f"{where} is missing")
                continue
            object.__setattr__(self, f.name, number(value, where, InputError))
            if f.name in ("frequency_Hz", "rise_s") and not value > 0.0:
                raise InputError(f"{where} = {value} must be above 0")

    @classmethod
    def from_table(cls, table: Mapping, where: str) -> "AngleReference":
        """The reference of a TOML table.

        Raises
        ------
        InputError
            For an unknown key or an unusable value; `where` names the table.
        """
        require_known(table, [f.name for f in fields(cls)], where, InputError)
        if "kind" not in table:
            raise InputError(f"{where} has no kind ({', '.join(NEEDED)})")
        try:
            return cls(**table)
        except InputError as problem:
            raise InputError(f"{where}: {problem}") from problem

    def sample(self, time_s: ArrayLike) -> NDArray:
        """Angle, rate and acceleration at given times, (n, 3) array in rad, rad/s, rad/s^2."""
        t = np.asarray(time_s, dtype=float) - self.start_s
        on, zero = t >= 0.0, np.zeros(t.size)
        if self.kind == "step":
            parts = np.where(on, self.amplitude_rad, 0.0), zero, zero
        elif self.kind == "ramp":
            x = np.clip(t / self.rise_s, 0.0, 1.0)
            a, T = self.amplitude_rad, self.rise_s
            parts = (
                a * x**3 * (10.0 - 15.0 * x + 6.0 * x**2),
                a / T * 30.0 * x**2 * (1.0 - x) ** 2,
                a / T**2 * 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x),
            )
        else:
            w = 2.0 * np.pi * self.frequency_Hz
            a = np.where(on, self.amplitude_rad, 0.0)
            parts = a * np.sin(w * t), a * w * np.cos(w * t), -a * w**2 * np.sin(w * t)
        return np.column_stack((self.offset_rad + parts[0], parts[1], parts[2]))
