"""Whether a spring stays in its plane up to a torque: paths to look along, and judged lines.

A strip at least as wide as thick cannot tip over sideways and is not looked at, unless asked for.
Without contact: where the coils touch first, a path ends just before.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.structure.buckling import Stability, stability
from dftfs.analysis.structure.linear_spring import WholeSpring
from dftfs.analysis.torsion.result import SIGN, StiffnessResult
from dftfs.design import SpringDesign

NEARLY = 0.98  # of the first contact's deflection: the last state without contact
_FLAT = 1.0  # width over thickness below which a strip may tip over (errata S17)
_SHORT = 0.03  # of the torque: the coarser mesh of the stability, and the end before the contact


def may_tip(design: SpringDesign) -> bool:
    """Whether the strip is so low over its thickness that it may leave its plane."""
    return design.width_m < _FLAT * design.spiral.thickness_m


def ends_at_torque_rad(free: StiffnessResult, torque_Nm: float) -> dict[str, float]:
    """Deflection (signed) of a torque per direction, of a curve solved so far.

    Just before the first contact where the coils touch before; the curve's end where it is short.
    """
    ends = {}
    for name, sign in SIGN.items():
        side = sign * free.torque_Nm >= 0
        order = np.argsort(sign * free.torque_Nm[side])
        torque = sign * free.torque_Nm[side][order]
        angle = sign * free.deflection_rad[side][order]
        end = float(np.interp(torque_Nm, torque, angle))
        onset = free.contact_onset.get(name)
        ends[name] = sign * (end if onset is None else min(end, NEARLY * abs(onset.deflection_rad)))
    return ends


def stability_at(design: SpringDesign, ends_rad: Mapping[str, float]) -> dict[str, Stability]:
    """Out-of-plane modes of a design at one deflection per direction; empty if it cannot tip.

    Raises
    ------
    SolveError
        If a solve fails.
    """
    if not may_tip(design):
        return {}
    spring = WholeSpring(design=design, layers=1)
    return {name: stability(spring, [end]) for name, end in ends_rad.items()}


def stability_checks(
    paths: Mapping[str, Stability], torque_Nm: float | None = None
) -> tuple[Check, ...]:
    """Each direction judged up to a torque, the design's operating one; to its end without one.

    A path that loses its stability beyond the torque passes and says where.
    """
    return tuple(_check(name, path, torque_Nm) for name, path in paths.items())


def _check(name: str, path: Stability, torque_Nm: float | None) -> Check:
    states = path.states
    last = states[-1]
    text = f"lowest out-of-plane frequency squared {last.lowest_per_s2:.3g} 1/s2 at the end"
    limit, passed = f"none up to {last.deflection_rad:+.3f} rad", path.stable
    unstable = max(state.unstable for state in states)
    lost_Nm = None
    if path.critical_rad is not None:
        how = "extrapolated to" if path.extrapolated else "at"
        text += f"; stability lost {how} {path.critical_rad:+.3f} rad"
        if not path.extrapolated:
            lost_Nm = _torque_at(states, path.critical_rad)
            text += f", {lost_Nm:.3g} Nm"
    if torque_Nm is not None:
        limit = f"none up to {torque_Nm:g} Nm"
        if lost_Nm is not None and lost_Nm >= torque_Nm:
            passed, unstable = True, 0
        elif path.stable and abs(last.torque_Nm) < (1 - _SHORT) * torque_Nm:
            text += f"; judged up to {abs(last.torque_Nm):.3g} Nm, the end without contact"
    return Check(
        name=f"stays in its plane, {name}",
        value=float(unstable),
        unit="unstable modes",
        limit=limit,
        passed=passed,
        note=text,
        source="tangent of the deflected spring, rim and hub clamped",
    )


def _torque_at(states: Sequence, deflection_rad: float) -> float:
    angles = [abs(state.deflection_rad) for state in states]
    torques = [abs(state.torque_Nm) for state in states]
    return float(np.interp(abs(deflection_rad), angles, torques))
