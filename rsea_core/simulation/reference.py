"""What a closed loop is to follow, with its first two time derivatives."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rsea_core.errors import InputError
from rsea_core.files.csv_columns import read_columns
from rsea_core.files.toml_tables import nearest, number, require_known
from rsea_core.machine.inputs import checked_times

NEEDED = {
    "sine": ("amplitude_Nm", "frequency_Hz"),
    "step": ("amplitude_Nm",),
    "chirp": ("amplitude_Nm", "frequency_Hz", "end_frequency_Hz", "chirp_s"),
    "csv": ("file",),
}
OPTIONAL = {
    "sine": ("offset_Nm", "phase_rad"),
    "step": ("offset_Nm", "start_s"),
    "chirp": ("offset_Nm",),
    "csv": (),
}


@dataclass(frozen=True, kw_only=True)
class Reference:
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

    kind: str
    amplitude_Nm: float | None = None
    offset_Nm: float | None = None
    frequency_Hz: float | None = None
    end_frequency_Hz: float | None = None
    phase_rad: float | None = None
    start_s: float | None = None
    chirp_s: float | None = None
    file: str | None = None

    def __post_init__(self):
        if self.kind not in NEEDED:
            raise InputError(f"reference {self.kind!r} is unknown; {nearest(self.kind, NEEDED)}")
        for f in fields(self)[1:]:
            value, where = getattr(self, f.name), f"reference {self.kind!r}: {f.name}"
            if value is None and f.name in NEEDED[self.kind]:
                raise InputError(f"{where} is missing")
            if value is None:
                continue
            if f.name not in (*NEEDED[self.kind], *OPTIONAL[self.kind]):
                raise InputError(f"{where} = {value} is of no use to it")
            if f.name == "file":
                continue
            object.__setattr__(self, f.name, number(value, where, InputError))
            if f.name in ("frequency_Hz", "end_frequency_Hz", "chirp_s") and not value > 0.0:
                raise InputError(f"{where} = {value} must be above 0")

    @classmethod
    def from_table(cls, table: Mapping, where: str) -> "Reference":
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
        bend = self.amplitude_Nm * np.where(t < self.chirp_s, growth, 0.0) * np.cos(angle)
        return (self.offset_Nm or 0.0) + value, rate, bend - w**2 * value

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
