"""The effects of a diagnosis as terms of a model, so that simulations and controllers can use them.

Each variant names its effect's class and turns its values into the parameters there. What belongs
to recordings (a push in one of them, their contact) is put aside in words; a variant that its
class cannot take is left out, and that is said too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.gear_load_friction import distinguished
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.motor_cogging import MotorCogging
from rsea_core.effects.registry import Term
from rsea_core.effects.residual_table import EFFECT, fault_of
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine, Values
from rsea_core.errors import RigError, RseaError
from rsea_core.files.toml_tables import nearest, number, require_known, table
from rsea_core.machine.rig import Rig

LAW_KEYS = ("effect", "law", "column", "recording", "values")
HEAT_KEYS = ("winding_left_K", "case_left_K")
REST_KEY = "play_rest_rad"
BETWEEN_KEY = "command_between_rows"
FOUND_KEYS = (
    "ambient_C",
    *HEAT_KEYS,
    REST_KEY,
    BETWEEN_KEY,
    "contact_stiffness_Nm_per_rad",
    "contact_damping_Nms_per_rad",
    "contact_angle_rad",
)
ROUND_OFF = 1e-9  # of a bound: a fit that ends on it may miss it by this much
WAVE_VALUES = (("sin", "Nm"), ("cos", "Nm"), ("cycles", "per_rev"))
OF_RECORDINGS = (LoadDisturbance.effect,)


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
        faults = (fault_of,) if law.effect == EFFECT else (_below, _beyond, _lacks)
        fault = next((fault for fault in (f(law, values) for f in faults) if fault), None)
        if fault is not None:
            raise RigError(f"{where}: law {key}: {fault}")
        found.append((_named(law, entry), values))
    return tuple(found)


def _value_names(law: Law) -> list[str]:
    """Values that a law can have in a file; cogging may have further waves."""
    own = [unknown.name for unknown in law.unknowns]
    if law.effect != MotorCogging.effect:
        return own
    return [*own, *(f"{a}_{k}_{b}" for k in (2, 3) for a, b in WAVE_VALUES)]


def _below(law: Law, values: Values) -> str | None:
    """A value that is negative where its law knows none such, in words; None: there is none."""
    for unknown in law.unknowns:
        if unknown.low >= 0.0 and values.get(unknown.name, 0.0) < 0.0:
            return f"{unknown.name} = {values[unknown.name]:g} must not be negative"
    return None


def _beyond(law: Law, values: Values) -> str | None:
    """A value out of bounds that are the parameter's own, in words; None: there is none.

    Other bounds of a law scale with the machine, which a file of laws does not state.
    """
    own = {f.name: f.metadata.get("bounds") for f in fields(law.kind)} if law.kind else {}
    for unknown in law.unknowns:
        bounds, value = (unknown.low, unknown.high), values.get(unknown.name)
        if (
            value is not None
            and own.get(unknown.name) == bounds
            and not bounds[0] <= value <= bounds[1]
        ):
            return f"{unknown.name} = {value:g} is outside [{bounds[0]:g}, {bounds[1]:g}]"
    return None


def _lacks(law: Law, values: Values) -> str | None:
    """A value without which the law cannot be written into a machine, in words; None: it has all.

    Which ones a law can do without only its own writing knows.
    """
    trial = TrialMachine(plant=np.ones(len(PLANT)), fx=np.zeros(N_EFFECTS), stiffness=1.0)
    at = RunConditions(
        index=0, file=law.only or "", kind="contact", ratio=1.0, session_s=0.0, case_rise_K=0.0,
        time_s=np.zeros(2),
    )  # fmt: skip
    try:
        law.write(values, trial, at)
        for _, change in trial.reads:
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
    for law, values in distinguished(laws):
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
        if (term.key, term.law) in seen:
            terms.append(None)
            left_out.append(f"{name} is left out: {term.key} is there already")
        else:
            seen.add((term.key, term.law))
            terms.append(term)
    aside += [f"contact of the recordings: {_contact(key, v)}" for key, v in contact.items()]
    return MappedLaws(terms=tuple(terms), left_out=tuple(left_out), aside=tuple(aside))


def _term(law: Law, values: Values, rig: Rig, ambient_C: float) -> Term:
    given = dict(values) if law.parameters is None else dict(law.parameters(values, rig))
    inside = {name: _inside(law.kind, name, value) for name, value in given.items()}
    if law.kind is DriveThermal:
        inside["ambient_C"] = ambient_C
    if law.sensor is not None:
        inside["column"] = law.sensor
    return law.kind(**inside)


def _inside(kind: type[Term], name: str, value):
    """A value that misses a bound by round-off alone, on the bound."""
    bounds = kind.__dataclass_fields__[name].metadata.get("bounds")
    if bounds is None:
        return value
    low, high = bounds
    margin = ROUND_OFF * max(abs(low), abs(high), abs(value))
    if low - margin <= value < low:
        return low
    return high if high < value <= high + margin else value


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
