"""An effect and how large it is, in words that somebody who has not read the contract knows.

Each effect has its own sentence (`Term.sentence`); the contract's name stays beside the words.
"""

from collections.abc import Mapping

from rsea_core.effects.figure_text import Figure, FigureText
from rsea_core.effects.registry import TERMS


def effect_text(
    effect: str, subsystem: str, figures: Mapping[str, Figure], *, linear: bool = False
) -> str | None:
    """What an effect is and how large; None where the figures do not say it.

    Parameters
    ----------
    subsystem : str
        As in the contract: "gear", "sensor:torque_Nm".
    figures : mapping
        Reported figures by their names, SI units and radians.
    linear : bool
        As in `figure_text.amount`.
    """
    kind = TERMS.get(effect)
    if kind is None:
        return None
    try:
        return kind.sentence(FigureText(figures, subsystem.partition(":")[2], linear))
    except KeyError:
        return None
