"""An effect and how large it is, in words that somebody who has not read the contract knows.

Each effect has its own sentence (`Term.sentence`); the contract's name stays beside the words.
"""

from collections.abc import Mapping

from rsea_core.effects.figure_text import Figure, FigureText
from rsea_core.effects.registry import LAWS


def effect_text(
    effect: str,
    subsystem: str,
    figures: Mapping[str, Figure],
    *,
    law: str = "",
    linear: bool = False,
    command_unit: str = "",
) -> str | None:
    """What an effect is and how large; None where the figures do not say it.

    Parameters
    ----------
    subsystem : str
        As in the contract: "gear", "sensor:torque_Nm".
    figures : mapping
        Reported figures by their names, SI units and radians.
    law : str
        Its law, which may have a sentence of its own.
    linear : bool
        As in `figure_text.amount`.
    command_unit : str
        As in `FigureText`.
    """
    laws = LAWS.get(effect, {})
    text = FigureText(figures, subsystem.partition(":")[2], linear, command_unit)
    for kind in (laws.get(law), *laws.values()):
        if kind is not None:
            try:
                return kind.sentence(text)
            except KeyError:
                pass
    return None
