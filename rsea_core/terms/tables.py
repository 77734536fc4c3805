"""A term as a [[term]] table of TOML, in a model or in the rig file of a case.

    [[term]]
    effect = "gear-friction"
    law = "coulomb-stribeck"   may be absent: the effect's first law
    coulomb_Nm = 0.012

Numbers are written so that reading them back gives the same ones to the bit.
"""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from rsea_core.effects.base import Term
from rsea_core.effects.registry import LAWS, SpringCurve
from rsea_core.errors import TermError
from rsea_core.files.toml_tables import nearest, number, require_known, toml_string, word

TOLERANCE = "tolerance"  # how well its values are known, relative; a diagnosis uses it
ONSETS = ("negative_contact_onset_rad", "positive_contact_onset_rad")  # of a spring curve


def term_to_toml(term: Term) -> str:
    """The [[term]] table of one term."""
    lines = ["[[term]]", f'effect = "{term.effect}"', f'law = "{term.law}"']
    lines += [f"{name} = {_toml(value)}" for name, value in _entries(term).items()]
    return "\n".join(lines) + "\n"


def term_from_table(table: object, position: int) -> Term:
    """The term of one [[term]] table; its position in the file is for messages.

    Raises
    ------
    TermError
        For an unknown effect, law or key (with the nearest known one), a missing or
        impossible value.
    """
    where = f"term {position}"
    if not isinstance(table, Mapping) or not isinstance(table.get("effect"), str):
        raise TermError(f"{where}: needs effect, the name of one of {', '.join(LAWS)}")
    values = dict(table)
    effect = values.pop("effect")
    if effect not in LAWS:
        raise TermError(f"{where}: unknown effect {effect!r}; {nearest(effect, LAWS)}")
    where = f"{where} ({effect})"
    share = number(values.pop(TOLERANCE, 1.0), f"{where}: {TOLERANCE}", TermError)
    if not share > 0.0:
        raise TermError(f"{where}: {TOLERANCE} = {share:g} must be above 0 (0.3 is 30 %)")
    law = word(values.pop("law", next(iter(LAWS[effect]))), f"{where}: law", TermError)
    if law not in LAWS[effect]:
        raise TermError(f"{where}: unknown law {law!r}; {nearest(law, LAWS[effect])}")
    kind = LAWS[effect][law]
    known = {f.name: f for f in fields(kind) if f.name != "contact_onset_rad"}
    if kind is SpringCurve:
        known |= dict.fromkeys(ONSETS)
    require_known(values, known, where, TermError)
    for name, value in values.items():
        if known[name] is not None and "bounds" in known[name].metadata:
            values[name] = number(value, f"{where}: {name}", TermError)
    if kind is SpringCurve:
        values["contact_onset_rad"] = tuple(values.pop(name, None) for name in ONSETS)
    try:
        return kind(**values)
    except (TypeError, ValueError) as problem:
        needed = [f.name for f in fields(kind) if f.default is f.default_factory]
        missing = ", ".join(name for name in needed if name not in values)
        raise TermError(f"{where}: {f'lacks {missing}' if missing else problem}") from None


def _entries(term: Term) -> dict:
    found = {f.name: getattr(term, f.name) for f in fields(term)}
    if isinstance(term, SpringCurve):
        onsets = zip(ONSETS, found.pop("contact_onset_rad"), strict=True)
        found |= {name: onset for name, onset in onsets if onset is not None}
    return found


def _toml(value: object) -> str:
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, np.ndarray):
        return "[" + ", ".join(repr(float(item)) for item in value) + "]"
    return repr(float(value))
