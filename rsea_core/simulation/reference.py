"""What a closed loop is to follow, with its first two time derivatives."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError
from rsea_core.files.csv_columns import read_columns
from rsea_core.files.toml_tables import nearest, number, require_known, word
from rsea_core.machine.inputs import checked_times

LARGEST = 1e12  # of a value: beyond it is an error of units


class _Checked:
    """Values that a kind of reference needs or may have, of a class that names its kinds.

    `needed` and `optional` name the values of each kind, `above_zero` those that must be.
    """

    needed: ClassVar[Mapping[str, tuple[str, ...]]]
    optional: ClassVar[Mapping[str, tuple[str, ...]]]
    above_zero: ClassVar[tuple[str, ...]]

    def __post_init__(self):
        if word(self.kind, "reference kind", InputError) not in self.needed:
            raise InputError(
                f"reference {self.kind!r} is unknown; {nearest(self.kind, self.needed)}"
            )
        needed = self.needed[self.kind]
        for f in fields(self)[1:]:
            value, where = getattr(self, f.name), f"reference {self.kind!r}: {f.name}"
            if value is None:
                if f.name in needed:
                    raise InputError(f"{where} is missing")
                continue
            if f.name not in (*needed, *self.optional[self.kind]):
                raise InputError(f"{where} = {value} is of no use to it")
            if f.name == "file":
                word(value, where, InputError)
                continue
            object.__setattr__(self, f.name, number(value, where, InputError))
            if f.name in self.above_zero and not value > 0.0:
                raise InputError(f"{where} = {value} must be above 0")
            if not abs(value) <= LARGEST and not f.name.endswith("_Hz"):  # these: by the samples
                raise InputError(f"{where} = {value:g} must be within +-{LARGEST:g}")

    @classmethod
    def from_table(cls, table: Mapping, where: str) -> Self:
        """The reference of a TOML table.

        Raises
        ------
        InputError
            For an unknown key or an unusable value; `where` names the table.
        """
        require_known(table, [f.name for f in fields(cls)], where, InputError)
        if "kind" not in table:
            raise InputError(f"{where} has no kind ({', '.join(cls.needed)})")
        try:
            return cls(**table)
        except InputError as problem:
            raise InputError(f"{where}: {problem}") from problem


@dataclass(frozen=True, kw_only=True)
class Reference(_Checked):
    """A torque reference.

    Attributes
    ----------
    kind : str
        "sine": offset + amplitude sin(2 pi f t + phase); "step": offset, and amplitude more
        from start_s on; "chirp": a sine whose frequency rises linearly from frequency to
        end_frequency over chirp_s and stays there; "csv": straight lines between the points of
        a file with the columns time_s and reference_torque_Nm, whose first and last value hold
        outside.
    amplitude_Nm, offset_Nm : float
    frequency_Hz, end_frequency_Hz : float
    phase_rad, start_s, chirp_s : float
    file : str or None

    Raises
    ------
    InputError
        If a value that the kind needs is missing, one that it has no use for is given, or a
        frequency or duration is not positive.
    """

    unit: ClassVar[str] = "Nm"
    needed: ClassVar = {
        "sine": ("amplitude_Nm", "frequency_Hz"),
        "step": ("amplitude_Nm",),
        "chirp": ("amplitude_Nm", "frequency_Hz", "end_frequency_Hz", "chirp_s"),
        "csv": ("file",),
    }
    optional: ClassVar = {
        "sine": ("offset_Nm", "phase_rad"),
        "step": ("offset_Nm", "start_s"),
        "chirp": ("offset_Nm",),
        "csv": (),
    }
    above_zero: ClassVar = ("frequency_Hz", "end_frequency_Hz", "chirp_s")

    kind: str
    amplitude_Nm: float | None = None
    offset_Nm: float | None = None
    frequency_Hz: float | None = None
    end_frequency_Hz: float | None = None
    phase_rad: float | None = None
    start_s: float | None = None
    chirp_s: float | None = None
    file: str | None = None

    def sample(self, time_s: ArrayLike) -> NDArray:
        """Value, rate and acceleration at given times, (n, 3) array in Nm, Nm/s, Nm/s^2.

        Raises
        ------
        InputError
            If the file of a "csv" reference cannot be used.
        """
        t = np.asarray(time_s, dtype=float)
        sampled = {"sine": self._sine, "step": self._step, "chirp": self._chirp, "csv": self._csv}
        return np.column_stack(sampled[self.kind](t))

    def _sine(self, t: NDArray):
        w = 2.0 * np.pi * self.frequency_Hz
        angle = w * t + (self.phase_rad or 0.0)
        value, rate = self.amplitude_Nm * np.sin(angle), self.amplitude_Nm * w * np.cos(angle)
        return (self.offset_Nm or 0.0) + value, rate, -(w**2) * value

    def _step(self, t: NDArray):
        high = t >= (self.start_s or 0.0)
        value = (self.offset_Nm or 0.0) + np.where(high, self.amplitude_Nm, 0.0)
        return value, np.zeros(t.size), np.zeros(t.size)

    def _chirp(self, t: NDArray):
        w0, w1 = 2.0 * np.pi * self.frequency_Hz, 2.0 * np.pi * self.end_frequency_Hz
        growth = (w1 - w0) / self.chirp_s
        rising = np.clip(t, 0.0, self.chirp_s)
        w = w0 + growth * rising
        angle = (w0 + 0.5 * growth * rising) * rising + w1 * np.maximum(t - self.chirp_s, 0.0)
        value, rate = self.amplitude_Nm * np.sin(angle), self.amplitude_Nm * w * np.cos(angle)
        second_rate = self.amplitude_Nm * np.where(t < self.chirp_s, growth, 0.0) * np.cos(angle)
        return (self.offset_Nm or 0.0) + value, rate, second_rate - w**2 * value

    def _csv(self, t: NDArray):
        columns = read_columns(
            Path(self.file), InputError, required=("time_s", "reference_torque_Nm")
        )
        try:
            times = checked_times(columns["time_s"])
        except InputError as problem:
            raise InputError(f"{self.file}: {problem}") from problem
        value = np.interp(t, times, columns["reference_torque_Nm"])
        rate = np.gradient(value, t)
        return value, rate, np.gradient(rate, t)


@dataclass(frozen=True, kw_only=True)
class AngleReference(_Checked):
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
    needed: ClassVar = {
        "step": ("amplitude_rad",),
        "ramp": ("amplitude_rad", "rise_s"),
        "sine": ("amplitude_rad", "frequency_Hz"),
    }
    optional: ClassVar = dict.fromkeys(
        needed, ("amplitude_rad", "offset_rad", "frequency_Hz", "rise_s", "start_s")
    )
    above_zero: ClassVar = ("frequency_Hz", "rise_s")

    kind: str
    amplitude_rad: float | None = None
    offset_rad: float = 0.0
    frequency_Hz: float | None = None
    rise_s: float | None = None
    start_s: float = 0.0

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


def largest_amplitude(reference: Reference | AngleReference) -> float:
    """Amplitude of a reference, or its largest value within a minute; 1 where both are zero."""
    stated = getattr(reference, f"amplitude_{reference.unit}")
    if stated:
        return abs(stated)
    return float(np.abs(reference.sample(np.linspace(0.0, 60.0, 6001))[:, 0]).max()) or 1.0
