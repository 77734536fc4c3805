"""The physics of a scenario beyond its rig: terms, environment, disturbance, sensors.

[[terms]]                      # any effect of the registry, any number of them
effect = "gear-friction"
coulomb_Nm = 0.02

[environment]                  # contact-nonlinear, with the load "contact"
[disturbance]                  # load-disturbance
[sensors]                      # encoders in place of the rig's; 0 reads exactly
"""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

from rsea_core.effects.contact_nonlinear import ContactNonlinear
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.registry import LAWS, Term
from rsea_core.errors import ScenarioError
from rsea_core.files.toml_tables import nearest, number, require_known, table, word
from rsea_core.machine.rig import Rig

SENSORS = ("motor_encoder_counts_per_rev", "load_encoder_counts_per_rev")
NAMED = {"environment": ContactNonlinear.effect, "disturbance": LoadDisturbance.effect}


def scenario_terms(tables: Mapping) -> tuple[Term, ...]:
    """The terms of a scenario's tables.

    Raises
    ------
    ScenarioError
        For an unknown effect, law or parameter, naming the nearest known one.
    TermError
        If a parameter is outside its bounds.
    """
    listed = tables.get("terms", [])
    if not isinstance(listed, Sequence) or isinstance(listed, str):
        raise ScenarioError("terms must be tables [[terms]], each with its effect")
    found = [
        _term(table(entry, f"terms[{index}]", ScenarioError), f"[[terms]] number {index + 1}")
        for index, entry in enumerate(listed)
    ]
    for name, effect in NAMED.items():
        if name in tables:
            entries = table(tables[name], name, ScenarioError)
            if "effect" in entries:
                raise ScenarioError(f"[{name}] is {effect}; other effects belong in [[terms]]")
            found.append(_term({"effect": effect, **entries}, f"[{name}]"))
    return tuple(found)


def with_sensors(rig: Rig, entries: Mapping) -> Rig:
    """The rig with the encoders of a [sensors] table.

    Raises
    ------
    ScenarioError
        For an unknown key.
    RigError
        If a count is not a whole number of at least 1, or 0.
    """
    require_known(entries, SENSORS, "[sensors]", ScenarioError)
    counts = {
        key: number(value, f"[sensors] {key}", ScenarioError) or None
        for key, value in entries.items()
    }
    return replace(rig, **counts)


def _term(entries: Mapping, where: str) -> Term:
    if "effect" not in entries:
        raise ScenarioError(f"{where}: effect is missing ({', '.join(LAWS)})")
    effect = word(entries["effect"], f"{where}: effect", ScenarioError)
    if effect not in LAWS:
        raise ScenarioError(f"{where}: effect {effect!r} is unknown; {nearest(effect, LAWS)}")
    laws = LAWS[effect]
    law = word(entries.get("law", next(iter(laws))), f"{where}: law", ScenarioError)
    if law not in laws:
        raise ScenarioError(f"{where}: law {law!r} is unknown; {nearest(law, laws)}")
    kind = laws[law]
    known = {f.name: f for f in fields(kind) if f.name != "contact_onset_rad"}
    values = {key: value for key, value in entries.items() if key not in ("effect", "law")}
    require_known(values, known, f"{where} {effect}", ScenarioError)
    given = {
        key: number(value, f"{where} {effect}: {key}", ScenarioError)
        if "bounds" in known[key].metadata
        else value
        for key, value in values.items()
    }
    try:
        return kind(**given)
    except (TypeError, ValueError) as problem:
        needed = [f.name for f in fields(kind) if f.default is f.default_factory]
        missing = ", ".join(name for name in needed if name not in given)
        what = f"needs {missing}" if missing else f"cannot be used: {problem}"
        raise ScenarioError(f"{where}: {effect} {what}") from problem
