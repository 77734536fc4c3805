"""How an effect is drawn: what over what, from the very numbers that the engines run on."""

from collections.abc import Callable
from dataclasses import dataclass

from numpy.typing import NDArray

from rsea_core.effects.variant import TrialMachine, Values

Evaluate = Callable[[TrialMachine, Values, NDArray], NDArray]


@dataclass(frozen=True, kw_only=True)
class EffectCurve:
    """How one effect is drawn.

    Attributes
    ----------
    over : str
        The quantity along the x axis; what a machine passed through gives its ends.
    evaluate : function of (trial, values, x), the curve (n,)
    """

    title: str
    x_label: str
    y_label: str
    over: str
    evaluate: Evaluate
