"""Fatigue of a notch under a load spectrum: Goodman, Smith-Watson-Topper, Palmgren-Miner.

The S-N line runs, in log-log, from a share f of the ultimate strength at 1e3 cycles to the fatigue
strength of the material at its cycles, times what surface, notch and survival leave of it
(`dftfs.analysis.strength.fkm`); beyond them it continues with
the same slope where the material has no endurance limit (aluminium) - conservative for steel.

Source: Budynas & Nisbett, Shigley's Mechanical Engineering Design, 9th ed., ch. 6 (eqs. 6-8 to
6-11 and Fig. 6-18 for f, 6-14, 6-46); Smith, Watson & Topper, J. Mater. 5 (1970) 767; Dowling,
Mechanical Behavior of Materials, 4th ed., 9.7 and 9.9; Miner, J. Appl. Mech. 12 (1945) A159.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, log, sqrt

from dftfs.errors import DesignError

_STATIC_CYCLES, _MOST_STATIC_SHARE = 1e3, 0.9
_TRUE_OVER_ULTIMATE_PA = 345e6  # 50 kpsi: true fracture strength over the ultimate, Shigley 6-11
_ENDURANCE_SHARE, _MOST_ENDURANCE_PA = 0.5, 700e6  # of a smooth steel specimen, Shigley 6-8
_ENDURANCE_REVERSALS = 2e6


@dataclass(frozen=True, kw_only=True)
class LoadBlock:
    """Torque between two values, so often. Signs: + winds.

    Raises
    ------
    DesignError
        If a number is not finite, the order is wrong or there are no cycles.
    """

    low_Nm: float
    high_Nm: float
    cycles: float

    def __post_init__(self) -> None:
        if not (isfinite(self.low_Nm) and isfinite(self.high_Nm) and self.low_Nm <= self.high_Nm):
            raise DesignError(
                f"load block {self.low_Nm}..{self.high_Nm} Nm: low must not be above"
                " high, for example --load -8 8 1e6"
            )
        if not (isfinite(self.cycles) and self.cycles > 0):
            raise DesignError(f"load block: cycles = {self.cycles} must be above 0, e.g. 1e6")


def static_share(ultimate_Pa: float) -> float:
    """Share f of the ultimate strength that is survived 1e3 times, at most 0.9.

    Coffin-Manson's elastic line sigma = sF (2 N)^b from sF = Su + 345 MPa to the endurance limit
    Se' = Su / 2 (at most 700 MPa) at 1e6 cycles:

        b = -lg(sF / Se') / lg(2e6),   f = sF / Su (2e3)^b

    Written for steels and used for all metals. 0.9 up to 480 MPa, 0.86 at 620 MPa (90 kpsi), 0.77
    at 1380 MPa. Source: Shigley, 9th ed., eqs. 6-8 to 6-11, Fig. 6-18.
    """
    true = ultimate_Pa + _TRUE_OVER_ULTIMATE_PA
    endurance = min(_ENDURANCE_SHARE * ultimate_Pa, _MOST_ENDURANCE_PA)
    slope = -log(true / endurance) / log(_ENDURANCE_REVERSALS)
    return min(true / ultimate_Pa * (2 * _STATIC_CYCLES) ** slope, _MOST_STATIC_SHARE)


@dataclass(frozen=True, kw_only=True)
class SNLine:
    """Amplitude over cycles: amplitude = first (cycles / 1e3)^slope."""

    first_Pa: float
    slope: float

    def cycles(self, amplitude_Pa: float) -> float:
        """Cycles to failure; below 1e3 the line is extended, infinite at no amplitude."""
        if amplitude_Pa <= 0:
            return inf
        return _STATIC_CYCLES * (amplitude_Pa / self.first_Pa) ** (1 / self.slope)

    def amplitude_Pa(self, cycles: float) -> float:
        """Amplitude that is survived so often."""
        return self.first_Pa * (cycles / _STATIC_CYCLES) ** self.slope


def sn_line(
    *, ultimate_Pa: float, fatigue_Pa: float, fatigue_cycles: float, stress_ratio: float,
    factor: float,
) -> SNLine:  # fmt: skip
    """The fully reversed line of a material, its fatigue strength times ``factor``.

    A strength at another stress ratio is brought to -1 by Goodman's line.

    Raises
    ------
    DesignError
        If the line would not fall.
    """
    mean_over_amplitude = (1 + stress_ratio) / (1 - stress_ratio)
    reversed_Pa = fatigue_Pa / (1 - fatigue_Pa * mean_over_amplitude / ultimate_Pa)
    low, high = factor * reversed_Pa, static_share(ultimate_Pa) * ultimate_Pa
    if not (0 < low < high and fatigue_cycles > _STATIC_CYCLES):
        raise DesignError(
            f"fatigue: {low / 1e6:.4g} MPa at {fatigue_cycles:.3g} cycles must lie below"
            f" {high / 1e6:.4g} MPa at {_STATIC_CYCLES:.0f}"
        )
    slope = log(low / high) / log(fatigue_cycles / _STATIC_CYCLES)
    return SNLine(first_Pa=high, slope=slope)


def goodman_amplitude_Pa(low_Pa: float, high_Pa: float, ultimate_Pa: float) -> float:
    """Fully reversed amplitude that does as much: a / (1 - m / Su), Shigley eq. 6-46.

    A mean in compression gives no credit; infinite where the mean reaches the strength.
    """
    amplitude, mean = (high_Pa - low_Pa) / 2, max((high_Pa + low_Pa) / 2, 0.0)
    return amplitude / (1 - mean / ultimate_Pa) if mean < ultimate_Pa else inf


def swt_amplitude_Pa(low_Pa: float, high_Pa: float) -> float:
    """Smith, Watson and Topper: sqrt(largest x amplitude) of the principal stress.

    0 where nothing is in tension.
    """
    return sqrt(max(high_Pa, 0.0) * (high_Pa - low_Pa) / 2)


def damage(amplitudes_Pa: Sequence[float], cycles: Sequence[float], line: SNLine) -> float:
    """Palmgren-Miner: sum of cycles over cycles to failure; 1 is failure."""
    return sum(n / line.cycles(a) if a < inf else inf for a, n in zip(amplitudes_Pa, cycles))
