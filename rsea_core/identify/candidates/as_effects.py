"""The laws of a diagnosis as terms of a model, so that simulations and controllers can use them.

Most laws have a term with parameters of the same names; the rest are turned into one here:
amplitude and phase for a pair of waves, a heat flow for a time constant, a stiffness for a
frequency. What belongs to recordings (a push in one of them, their contact) is put aside in
words; a law without a term is left out, and that is said too.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from rsea_core.effects.drive_thermal import COPPER_per_K
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.registry import (
    LAWS,
    DriveThermal,
    GearBacklash,
    GearEfficiency,
    GearFriction,
    GearTransmissionError,
    LoadFlexibility,
    LoadFriction,
    LoadPositionTorque,
    LoadUnbalance,
    MotorCogging,
    SensorTable,
    SpringBoucWen,
    SpringContact,
    SpringHysteresis,
    Term,
)
from rsea_core.effects.spring_contact import FAR_rad
from rsea_core.errors import RigError, RseaError
from rsea_core.files.toml_tables import nearest, number, require_known, table
from rsea_core.identify.candidates.candidate import PLANT, Draft, Law, Where
from rsea_core.identify.candidates.catalogue import laws_by_key
from rsea_core.identify.candidates.residual_tables import (
    EFFECT,
    PLACE,
    SPEED,
    TURN,
    VALUE,
    fault_of,
    nodes_of,
)
from rsea_core.identify.candidates.writers import slips_of
from rsea_core.machine.rig import Rig

LAW_KEYS = ("effect", "law", "column", "recording", "values")
HEAT_KEYS = ("winding_left_K", "case_left_K")
REST_KEY = "play_rest_rad"
FOUND_KEYS = (
    "ambient_C",
    *HEAT_KEYS,
    REST_KEY,
    "contact_stiffness_Nm_per_rad",
    "contact_damping_Nms_per_rad",
    "contact_angle_rad",
)
WHEEL_kgm2 = 2e-3  # inertia that the backlash law of the fits puts behind the play, at most
ROUNDEST = 1.8  # onsets: width of a knee, at most; as the contact law of the fits has it
ROUND_OFF = 1e-9  # of a bound: a fit that ends on it may miss it by this much
WAVE_VALUES = (("sin", "Nm"), ("cos", "Nm"), ("cycles", "per_rev"))
OVER = {VALUE: "value", TURN: "turn", SPEED: "speed"}
THREAD, VELOCITY = "gear-load-friction", "stribeck_velocity_rad_per_s"
OF_RECORDINGS = ("load-disturbance",)


@dataclass(frozen=True, kw_only=True)
class MappedLaws:
    """What became of a diagnosis' laws.

    Attributes
    ----------
    terms : tuple of Term or None
        In the order of the laws, None where a law has no term.
    left_out : tuple of str
        A sentence for each law that a simulation goes without.
    aside : tuple of str
        What belongs to recordings and is a scenario's to say; what a neighbouring law stands for.
    """

    terms: tuple[Term | None, ...]
    left_out: tuple[str, ...]
    aside: tuple[str, ...]


Values = Mapping[str, float]
Turn = Callable[[Values, Rig], tuple[type[Term], dict[str, float]]]


def read_laws(listed: Sequence, where: str) -> tuple[tuple[Law, dict[str, float]], ...]:
    """The laws of the [[law]] tables of a `model.toml`, with their values.

    Raises
    ------
    RigError
        If a law, column or value is not known, or a value cannot be; `where` names the file.
    """
    if not isinstance(listed, Sequence) or isinstance(listed, str):
        raise RigError(f"{where}: law must be a list, each one written [[law]]")
    found, known = [], laws_by_key()
    for position, given in enumerate(listed, start=1):
        entry = table(given, f"{where}: law {position}", RigError)
        require_known(entry, LAW_KEYS, f"{where}: law {position}", RigError)
        key = f"{entry.get('effect')}/{entry.get('law')}"
        if entry.get("column"):
            key += f"@{entry['column']}"
        plain = key if key in known else f"{entry.get('effect')}/*"
        if plain not in known:
            raise RigError(f"{where}: unknown law {key!r}; {nearest(key, known)}")
        law = known[plain]
        values = {
            name: number(v, f"{where}: law {key}: {name}", RigError)
            for name, v in table(entry.get("values", {}), "law.values", RigError).items()
        }
        require_known(values, _value_names(law), f"{where}: law {key}", RigError)
        faults = (fault_of,) if law.effect == EFFECT else (_below, _lacks)
        fault = next((said for said in (f(law, values) for f in faults) if said), None)
        if fault is not None:
            raise RigError(f"{where}: law {key}: {fault}")
        found.append((_named(law, entry), values))
    return tuple(found)


def _value_names(law: Law) -> list[str]:
    """Values that a law can have in a file; cogging may have further waves."""
    own = [knob.name for knob in law.knobs]
    if law.effect != "motor-cogging":
        return own
    return [*own, *(f"{a}_{k}_{b}" for k in (2, 3) for a, b in WAVE_VALUES)]


def _below(law: Law, values: Values) -> str | None:
    """A value that is negative where its law knows none such, in words; None: there is none."""
    for knob in law.knobs:
        if knob.low >= 0.0 and values.get(knob.name, 0.0) < 0.0:
            return f"{knob.name} = {values[knob.name]:g} must not be negative"
    return None


def _lacks(law: Law, values: Values) -> str | None:
    """A value without which the law cannot be written into a machine, in words; None: it has all.

    Which ones a law can do without only its own writing knows.
    """
    draft = Draft(plant=np.ones(len(PLANT)), fx=np.zeros(N_EFFECTS), stiffness=1.0)
    at = Where(
        index=0, file=law.only or "", kind="contact", ratio=1.0, session_s=0.0, case_rise_K=0.0,
        time_s=np.zeros(2),
    )  # fmt: skip
    try:
        law.write(values, draft, at)
        for _, change in draft.reads:
            change(np.zeros(2))
    except KeyError as missing:
        return f"lacks {missing.args[0]}"
    return None


def _named(law: Law, entry: Mapping) -> Law:
    """The law with the name that its file gives, and its recording."""
    only = entry.get("recording")
    if entry["law"] == law.law and only is None:
        return law
    own = {f.name: getattr(law, f.name) for f in fields(Law)}
    return Law(**(own | {"law": entry["law"], "only": only}))


def map_laws(
    rig: Rig, laws: Sequence[tuple[Law, Values]], *, ambient_C: float, contact: Values
) -> MappedLaws:
    """The terms of a diagnosed machine's laws.

    Parameters
    ----------
    rig : Rig
        As corrected: inertias of wheel and link are its own.
    contact : mapping
        Factors of stiffness and damping, shift of the angle, of the recordings' contact.
    """
    terms: list[Term | None] = []
    left_out, aside, seen = [], [], set()
    for law, values in _told_apart(laws):
        name = f"{law.effect} ({law.law})"
        if law.effect in OF_RECORDINGS:
            terms.append(None)
            aside.append(f"{name} acted in {law.only or 'one recording'} alone: {_pulse(values)}")
            continue
        try:
            term = _term(law, values, rig, ambient_C)
        except RseaError as problem:
            terms.append(None)
            left_out.append(f"{name} is left out: {problem}")
            continue
        if term is None:
            terms.append(None)
            left_out.append(f"{name} is left out: no term has {', '.join(values)}")
        elif (term.key, term.law) in seen:
            terms.append(None)
            left_out.append(f"{name} is left out: {term.key} is there already")
        else:
            seen.add((term.key, term.law))
            terms.append(term)
    aside += [f"contact of the recordings: {_contact(key, v)}" for key, v in contact.items()]
    return MappedLaws(terms=tuple(terms), left_out=tuple(left_out), aside=tuple(aside))


PRESLIDING, STRIBECK = ("presliding_rad", "bristle_rad"), ("stribeck_rise", VELOCITY)


def _told_apart(laws: Sequence[tuple[Law, Values]]) -> list[tuple[Law, Values]]:
    """The laws of a gear's dry friction and of its load's, each with what it has the last word in.

    Both have bristles and a Stribeck curve, of which a fit takes those that are written last
    (`writers`): the thread's bristles, if they are, carry Coulomb friction too.
    """
    found = [(law, dict(values)) for law, values in laws]
    gear = [(law.effect, v) for law, v in found if law.effect in ("gear-friction", THREAD)]
    if len(gear) != 2 or gear[0][0] == gear[1][0] or "bristle_rad" not in dict(gear)[THREAD]:
        return found
    dry, thread, last = dict(gear)["gear-friction"], dict(gear)[THREAD], gear[1][0]
    efficiencies = thread["drive_efficiency"], thread["backdrive_efficiency"]
    if dry["coulomb_Nm"] == 0.0 or efficiencies == (1.0, 1.0):  # no friction writes nothing
        return found
    faded = "stribeck_rise" in thread
    if ("stribeck_rise" in dry and last != THREAD) or not faded:
        # its own curve, by the thread's power of the speed where that has one
        if faded:
            dry["stribeck_shape"] = 1.0
        _drop(thread, STRIBECK)
    else:
        _drop(dry, STRIBECK)
    if last == THREAD:
        _drop(dry, PRESLIDING)
    elif "bristle_rad" in dry:
        _drop(thread, PRESLIDING)
    elif "presliding_rad" in dry:
        thread["bristle_rad"] = dry.pop("presliding_rad")
    return found


def _drop(values: dict[str, float], names: Sequence[str]) -> None:
    for name in names:
        values.pop(name, None)


def _term(law: Law, values: Values, rig: Rig, ambient_C: float) -> Term | None:
    if law.effect == EFFECT:
        return _table(law, values)
    if law.effect in TURNED:
        kind, given = TURNED[law.effect](values, rig)
    else:
        given = dict(values) | BY_NAME.get(law.key, {})
        if law.sensor is not None:
            given.pop("session", None)  # where a drift began is the session's
        kind = next(
            (k for k in LAWS.get(law.effect, {}).values() if given.keys() <= _names(k)), None
        )
    if kind is None:
        return None
    inside = {name: _inside(kind, name, value) for name, value in given.items()}
    if kind is DriveThermal:
        inside["ambient_C"] = ambient_C
    if law.sensor is not None:
        inside["column"] = law.sensor
    return kind(**inside)


def _table(law: Law, values: Values) -> Term:
    """What no effect explains: a torque on the load, or the error of a reading."""
    places, entries = nodes_of(values)
    if law.law == PLACE:
        return LoadPositionTorque(first_rad=places[0], last_rad=places[-1], node_Nm=entries)
    return SensorTable(
        column=law.sensor, over=OVER[law.law], first=places[0], last=places[-1], errors=entries
    )


def _names(kind: type[Term]) -> set[str]:
    return {f.name for f in fields(kind)}


def _inside(kind: type[Term], name: str, value: float) -> float:
    """A value that misses a bound by round-off alone, on the bound."""
    low, high = kind.__dataclass_fields__[name].metadata["bounds"]
    margin = ROUND_OFF * max(abs(low), abs(high), abs(value))
    if low - margin <= value < low:
        return low
    return high if high < value <= high + margin else value


# ---- laws whose values are not their term's


def _wave(v: Values, sin: str, cos: str) -> tuple[float, float]:
    """Amplitude and phase of v[sin] sin x + v[cos] cos x."""
    return math.hypot(v[sin], v[cos]), math.atan2(v[cos], v[sin])


def _transmission_error(v: Values, rig: Rig):
    given = {}
    for at in ("wheel", "worm"):
        for wave, which in (("", ""), ("2_", "second_"), ("3_", "third_")):
            if f"{at}_sin_{wave}rad" in v:
                amplitude, phase = _wave(v, f"{at}_sin_{wave}rad", f"{at}_cos_{wave}rad")
                given[f"{at}_{which}amplitude_rad"] = amplitude
                given[f"{at}_{which}phase_rad"] = phase
    return GearTransmissionError, given


def _cogging(v: Values, rig: Rig):
    given = {}
    for wave in ("", "2_", "3_"):
        if f"sin_{wave}Nm" in v:
            amplitude, phase = _wave(v, f"sin_{wave}Nm", f"cos_{wave}Nm")
            given |= {
                f"amplitude_{wave}Nm": amplitude,
                f"cycles_{wave}per_rev": v[f"cycles_{wave}per_rev"],
                f"phase_{wave}rad": phase,
            }
    return MotorCogging, given


def _unbalance(v: Values, rig: Rig):
    amplitude, phase = _wave(v, "sin_Nm", "cos_Nm")
    return LoadUnbalance, {"torque_amplitude_Nm": amplitude, "angle_rad": phase}


def _backlash(v: Values, rig: Rig):
    """The wheel behind the play is the one that the fit took."""
    ratio = rig.gear_ratio or 1.0
    whole = ratio**2 * (rig.motor_inertia_kgm2 or 0.0) + (rig.output_inertia_kgm2 or 0.0)
    drag = ratio**2 * (rig.motor_viscous_Nms_per_rad or 0.0)
    drag += rig.output_viscous_Nms_per_rad or 0.0
    return GearBacklash, {
        "width_rad": v["width_rad"],
        "wheel_inertia_kgm2": min(v.get("wheel_inertia_kgm2", WHEEL_kgm2), 0.5 * whole),
        "wheel_damping_Nms_per_rad": min(v.get("wheel_damping_Nms_per_rad", 0.0), 0.5 * drag),
        "rebound": v.get("rebound", 0.0),
    }


def _thermal(v: Values, rig: Rig):
    capacity = v["winding_heat_capacity_J_per_K"]
    given = {
        "winding_heat_capacity_J_per_K": capacity,
        "winding_to_case_W_per_K": capacity / v["winding_time_s"],
        "resistance_rise_per_K": COPPER_per_K,
    }
    pauses = ("winding_time_s", "pause_s")  # how long the motor rested is the recordings'
    rest = {k: x for k, x in v.items() if k not in (*pauses, *given)}
    return DriveThermal, given | rest


def _spring_contact(v: Values, rig: Rig):
    """A knee on one side: the other lies where no spring goes."""
    onset, side = v["onset_rad"], v.get("side", 0.0)
    backward = v.get("onset_backward_rad", onset)
    given = {"onset_rad": onset, "stiffness_ratio": v["stiffness_after_over_before"]}
    if "onset_backward_rad" in v:
        given["negative_onset_rad"] = backward
    if side > 0.0:
        given["negative_onset_rad"] = backward = FAR_rad
    elif side < 0.0:
        onset = FAR_rad
        given |= {"onset_rad": FAR_rad, "negative_onset_rad": backward}
    if "round_rad" in v:  # a knee may not reach back to zero
        given["knee_width_rad"] = min(v["round_rad"], ROUNDEST * min(onset, backward))
    return SpringContact, given


def _motor_side_damping(rig: Rig) -> float:
    """Viscous friction of all that turns rigidly with the motor [Nms/rad]."""
    output = rig.output_viscous_Nms_per_rad or 0.0
    if rig.has("load") and not rig.has("spring"):
        output += rig.load_viscous_Nms_per_rad or 0.0
    return (rig.motor_viscous_Nms_per_rad or 0.0) + output / (rig.gear_ratio or 1.0) ** 2


def _friction(kind: type[Term]) -> Turn:
    """Dry friction; the share of the viscous one that has a side is the rig's."""

    def turn(v: Values, rig: Rig):
        given = dict(v)
        if "viscous_asymmetry" in v:
            share = given.pop("viscous_asymmetry")
            given["viscous_skew_Nms_per_rad"] = share * _motor_side_damping(rig)
        return kind, given

    return turn


def _slips(v: Values, rig: Rig):
    """Elements one by one, however the law spaces them; Bouc-Wen's are its term's own.

    How a spring came to where a recording begins is the recording's.
    """
    if "yield_1_rad" not in v:
        return SpringBoucWen, {name: x for name, x in v.items() if name != "start_relaxed"}
    given = {}
    for j, (stiffness, yield_rad) in enumerate(slips_of(v), start=1):
        given[f"stiffness_{j}_Nm_per_rad"], given[f"yield_{j}_rad"] = stiffness, yield_rad
    return SpringHysteresis, given


def _link(v: Values, rig: Rig):
    """Both parts against each other, joint free, have the law's frequency and damping ratio."""
    rig.need("the flexible link found", "load_inertia_kgm2")
    share = v["tip_share"]
    outer = share * rig.load_inertia_kgm2
    stiffness = outer * (1.0 - share) * (2.0 * math.pi * v["frequency_Hz"]) ** 2
    return LoadFlexibility, {
        "link_stiffness_Nm_per_rad": stiffness,
        "outer_fraction": share,
        "link_damping_Nms_per_rad": 2.0 * v["damping_ratio"] * math.sqrt(stiffness * outer),
    }


BY_NAME = {
    "drive-saturation/sag, one way": {"returned_share": 0.0},
    "drive-saturation/sag, no capacitor": {"ripple_share": 1.0},
}
"""What of a term only the name of a law says."""
TURNED: dict[str, Turn] = {
    "gear-friction": _friction(GearFriction),
    "gear-load-friction": lambda v, rig: (GearEfficiency, v),
    "load-friction": _friction(LoadFriction),
    "spring-hysteresis": _slips,
    "gear-transmission-error": _transmission_error,
    "motor-cogging": _cogging,
    "load-unbalance": _unbalance,
    "gear-backlash": _backlash,
    "drive-thermal": _thermal,
    "spring-contact": _spring_contact,
    "load-flexibility": _link,
}


# ---- what belongs to recordings


def _pulse(v: Values) -> str:
    end = v["start_s"] + v["width_s"]
    return (
        "in a scenario [disturbance]"
        f" start_s = {v['start_s']!r}, end_s = {end!r}, peak_Nm = {v['peak_Nm']!r}"
        + (", without its flanks" if v.get("taper", 0.0) > 0.0 else "")
    )


def _contact(key: str, value: float) -> str:
    if key == "contact_angle_rad":
        return f"add {value!r} to {key} of a scenario's [load]"
    return f"multiply {key} of a scenario's [load] by {value!r}"
