"""The physics terms by name; a new effect is one class and one line here."""

from rsea_core.terms.base import Parameter, Port, Term, parameter, require_bounds
from rsea_core.terms.spring import SpringCurve

TERMS: dict[str, type[Term]] = {term.effect: term for term in (SpringCurve,)}

__all__ = ["TERMS", "Parameter", "Port", "SpringCurve", "Term", "parameter", "require_bounds"]
