"""What a spring's explanation says, as text."""

import numpy as np

from rsea_core.identify.spring_bench.candidate import SpringCandidate
from rsea_core.identify.spring_bench.file_checks import (
    is_other_unit,
)
from rsea_core.identify.spring_bench.regression import (
    ASYMMETRY,
    KNEE,
    LAG,
    SLIP,
)

ONE_SIDED = 0.3  # of the larger deflection: less the other way shows no difference of directions
NEARLY_ALL = 0.75  # of the stiffness in the slider: the joint slips as a whole

PHRASES = {
    "hardening": "its stiffness varies differently with deflection",
    "asymmetry": "it is stiffer in one direction than in the other",
    "one side": "its stiffness changes with deflection",
    "knee both ways": "its coils touch beyond a deflection in both directions",
    "contact friction": "friction between its coils grows with the torque",
}


def explanation_sentence(
    best: SpringCandidate,
    plain: SpringCandidate,
    known: bool,
    ratio: float,
    ratio_std: float,
    stiffness: float,
) -> str:
    if not best.scale > 0.0:
        head = "No elastic stiffness was found: the torque does not rise with the deflection"
    elif known and is_other_unit(best.scale):
        head = f"The torque rises {best.scale:.3g} times as steeply as the design's: no tolerance"
        head += " does that, so a unit is wrong or it is another spring"
    elif known:
        size = 100.0 * (best.scale - 1.0)
        head = f"The spring's elastic stiffness is {size:+.1f} ± {100 * best.scale_std:.1f} % off"
        head += f" its design: a strip {100 * (ratio - 1.0):+.2f} ± {100 * ratio_std:.2f} % thick"
    else:
        measured = best.scale * stiffness
        head = f"The spring's elastic stiffness is {measured:.4g} ±"
        head += f" {best.scale_std * stiffness:.2g} Nm/rad"
    if not best.pieces:
        return f"{head}, and nothing else explains the loops better."
    parts = [phrase_of(best, piece) for piece in dict.fromkeys(best.pieces)]
    gained = f"(error {100 * plain.error:.2g} % to {100 * best.error:.2g} %)"
    return f"{head}, and {', '.join(parts)} {gained}."


def phrase_of(best: SpringCandidate, piece: str) -> str:
    """Phrase for an explanation."""
    if piece == SLIP:
        share = best.parameters["slipping_share"]
        return "its clamp slips" if share > NEARLY_ALL else "a part of it slips (hysteresis)"
    if piece == LAG:
        late = best.parameters["lag_coefficient"] < 0.0
        return (
            "its torque is read with a delay" if late else "it is stiffer the faster it is turned"
        )
    if piece == KNEE:
        onset = best.parameters["knee_onset_rad"]
        return f"its coils touch beyond {np.degrees(onset):.3g} degrees"
    if piece == ASYMMETRY and best.parameters["other_way"] < ONE_SIDED:
        return PHRASES["one side"]
    return PHRASES[piece]
