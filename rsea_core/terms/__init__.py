"""The physics terms by name; a new effect is one class and one line here."""

from rsea_core.terms.base import Parameter, Port, Term, parameter, require_bounds
from rsea_core.terms.gear import GearFriction, GearLoadFriction
from rsea_core.terms.load import LoadFriction
from rsea_core.terms.spring import SpringCurve

TERMS: dict[str, type[Term]] = {
    term.effect: term
    for term in (
        SpringCurve,
        GearFriction,
        GearLoadFriction,
        LoadFriction,
    )
}

__all__ = [
    "TERMS",
    "GearFriction",
    "GearLoadFriction",
    "LoadFriction",
    "Parameter",
    "Port",
    "SpringCurve",
    "Term",
    "parameter",
    "require_bounds",
]
