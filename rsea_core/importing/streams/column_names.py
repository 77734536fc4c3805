"""What the name of a logged column tells: quantity, side of the gear, unit, if it is a goal."""

import re
import unicodedata
from dataclasses import dataclass

TERMS = {
    "time": "t time times timestamp timestamps stamp clock zeit tick ticktime log "
    "temps tiempo tempo uhrzeit",
    "duty": "duty pwm dutycycle bridge tastgrad tastverhaltnis stellgrad",
    "supply": "supply vbus vbat ubat battery bus vdc vsupply",
    "voltage": "voltage volt volts v u vcmd vq umot uq ucmd vmot uset vset uref vref usoll "
    "spannung",
    "current": "current currents cur curr i iq amp amps im imot strom iphase courant "
    "corriente corrente icmd iref iset isoll iqcmd iqref iqset iqsoll",
    "torque": "torque torques tau tq trq moment effort loadcell taus ts drehmoment tauext "
    "couple coppia force forces kraft cell",
    "velocity": "vel velocity velocities speed omega w qd dq dtheta thetad qdot wm wl dqm dql qdm "
    "qdl rate drehzahl omegam omegal speeds vitesse velocidad velocita geschwindigkeit n nmot "
    "tacho",
    "angle": "angle angles pos position positions theta th phi q enc encoder ang qm ql thm thl "
    "thetam thetal winkel phim phil posm posl rot rotation",
    "temperature": "temp temperature",
    "enabled": "enable enabled en active armed driveon",
    "deflection": "deflection defl twist spring delta",
}  # fmt: skip
SIDES = {
    "motor": "motor mot mtr m rotor drive act actuator qm thm wm dqm qdm thetam phim posm omegam "
    "im imot antrieb moteur motore",
    "load": "load l link lnk output out arm joint pend pendulum ql thl wl dql qdl thetal phil posl "
    "omegal abtrieb last charge carga carico",
}
GOALS = (
    "goal goals ref reference des desired target set setpoint sp cmd command soll want icmd iref"
    " iset isoll iqcmd iqref iqset iqsoll ucmd vcmd uset vset uref vref usoll"
)
LINEAR_TERMS = {
    "angle": "x pos position lin linear scale carriage table slide stroke weg hub travel schlitten",
    "torque": "force forces f kraft thrust loadcell",
}
"""Of a linear axis: what its columns are named, beside the words above."""
UNITS = {
    "ms": "ms", "us": "us", "ns": "ns", "s": "s", "sec": "s", "seconds": "s", "msec": "ms",
    "usec": "us", "nsec": "ns", "millis": "ms", "micros": "us", "deg": "deg", "degrees": "deg",
    "rad": "rad", "rev": "turn", "revs": "turn", "turns": "turn", "cnt": "count", "cnts": "count",
    "counts": "count", "count": "count", "ticks": "count", "rpm": "rpm", "dps": "deg/s",
    "ma": "mA", "mnm": "mN*m", "nm": "N*m", "pct": "percent", "percent": "percent", "mv": "mV",
    "rads": "rad/s", "degs": "deg/s", "ncm": "N*cm",
}  # fmt: skip
LAST_UNITS = {"A": "A", "V": "V", "C": "degC", "mA": "mA", "mNm": "mN*m", "Nm": "N*m"}
"""Units as the last part of a name only, in their own case."""
TURNS_PER_MINUTE = ("n", "nmot", "drehzahl", "tacho", "tours", "giri")
LEROBOT = ("action", "observation.state")  # of its data sets: goals and angles of the joints
LAST_TIME = ("time", "timestamp", "stamp", "times")
LINEAR_UNITS = {
    "m": "angle", "mm": "angle", "um": "angle", "\u00b5m": "angle", "\u03bcm": "angle",
    "cm": "angle", "m/s": "velocity", "mm/s": "velocity", "N": "torque", "kN": "torque",
}  # fmt: skip
OF_UNIT = {
    "ms": "time", "us": "time", "ns": "time", "s": "time", "deg": "angle", "rad": "angle",
    "turn": "angle", "count": "angle", "rpm": "velocity", "deg/s": "velocity",
    "rad/s": "velocity", "mA": "current", "A": "current", "mN*m": "torque", "N*m": "torque",
    "N*cm": "torque", "percent": "duty", "V": "voltage", "mV": "voltage", "degC": "temperature",
}  # fmt: skip
_QUANTITY = {w: q for q, text in TERMS.items() for w in text.split()}
_SIDE = {w: side for side, text in SIDES.items() for w in text.split()}
_LINEAR = {w: q for q, text in LINEAR_TERMS.items() for w in text.split()}
_GOAL = frozenset(GOALS.split())


@dataclass(frozen=True, kw_only=True)
class NameEvidence:
    """What a name says; None where it is silent.

    Attributes
    ----------
    quantity : str or None
        A key of `TERMS`.
    side : "motor", "load" or None
    unit : str or None
    is_goal : bool
    is_rate_of_turns : bool
        Of a speed: one of the words for turns per minute.
    """

    quantity: str | None
    side: str | None
    unit: str | None
    is_goal: bool
    is_rate_of_turns: bool = False


def name_evidence(
    name: str, stated_unit: str | None = None, *, linear: bool = False
) -> NameEvidence:
    """What a column's name and the unit that the file states for it say.

    Parameters
    ----------
    linear : bool
        Whether the axis is linear: lengths and forces are then its angles and torques
        (1 m is written as 1 rad), and they are the load's.
    """
    if name in LEROBOT:
        is_goal = name == "action"
        return NameEvidence(quantity="angle", side=None, unit=stated_unit, is_goal=is_goal)
    plain = unicodedata.normalize("NFKD", name)  # letters without their marks
    plain = "".join(c for c in plain if not unicodedata.combining(c))
    bare = re.sub(r"[\[(].*?[\])]", " ", plain)
    inside = re.findall(r"[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$", name)
    per = re.search(r"_(rad|deg)_per_s\b", bare)
    bare = re.sub(r"_(rad|deg)_per_s\b", "", bare)
    unit = stated_unit or (inside[0] if inside and not inside[0].isdigit() else None)
    pieces = re.split(r"[_\s.]+", bare.strip())
    if per:
        unit = f"{per.group(1)}/s"
    elif unit is None:
        last = pieces[-1]
        unit = LAST_UNITS.get(last) if len(pieces) > 1 else None
        if linear and len(pieces) > 1 and last in LINEAR_UNITS and last != "m":  # motor
            unit = last
        is_time = _QUANTITY.get(pieces[0].lower()) == "time"  # the s of tau_s is a spring
        unit = unit or (UNITS.get(last.lower()) if last.lower() != "s" or is_time else None)
        bare = " ".join(pieces[:-1]) if unit is not None and len(pieces) > 1 else bare
    parts = [w.lower() for w in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", bare)]
    quantity, side = _quantity(parts, unit), next((_SIDE[w] for w in parts if w in _SIDE), None)
    if linear and unit in LINEAR_UNITS:
        quantity, side = LINEAR_UNITS[unit], "load"
    elif linear and quantity in (None, "angle", "torque"):
        own = next((_LINEAR[w] for w in parts if w in _LINEAR), None)
        quantity, side = own or quantity, "load" if own and quantity is None else side
    return NameEvidence(
        quantity=quantity,
        side=side,
        unit=unit,
        is_goal=any(w in _GOAL for w in parts),
        is_rate_of_turns=any(w in TURNS_PER_MINUTE for w in parts),
    )


def _quantity(parts: list[str], unit: str | None) -> str | None:
    of_unit = OF_UNIT.get(unit or "")
    if parts and parts[-1] in LAST_TIME and of_unit in (None, "time"):
        return "time"  # each signal of a struct has its own
    found = [_QUANTITY[w] for w in parts if w in _QUANTITY]
    if "spring" in parts and {"torque", "angle", "velocity"} & set(found):
        found.remove("deflection")  # the spring's torque, the angle of its end
    if of_unit == "angle" and "velocity" in found:
        return "velocity"
    if of_unit == "angle" and ("time" in found or "current" in found) and "angle" not in found:
        return found[0]  # counts of a timer or a converter
    if of_unit is not None and of_unit != "duty":
        if of_unit == "voltage" and "supply" in found:
            return "supply"
        if of_unit == "angle" and "deflection" in found:
            return "deflection"
        return of_unit
    order = ("supply", "duty", "velocity", "deflection", "temperature", "enabled", "torque",
             "current", "angle", "voltage", "time")  # fmt: skip
    return next((q for q in order if q in found), of_unit)
