"""The physics that a rig file does not state; one file an effect.

The registry is imported before any module of the package, so that the effects' numbers have the
same places in every process (`slots`). What a file of one's own effect needs stands here:
`docs/adding-an-effect.md`.
"""

from rsea_core.effects.base import Context, Free, Parameter, Port, Term, parameter, require_bounds
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.hooks import hook, summed
from rsea_core.effects.layout import N_EFFECTS
from rsea_core.effects.registry import LAWS, TERMS
from rsea_core.effects.slots import slots
from rsea_core.effects.user_effects import load_effects, register

__all__ = [
    "LAWS",
    "N_EFFECTS",
    "TERMS",
    "Context",
    "EffectCurve",
    "Free",
    "Parameter",
    "Port",
    "Term",
    "hook",
    "load_effects",
    "parameter",
    "register",
    "require_bounds",
    "slots",
    "summed",
]
