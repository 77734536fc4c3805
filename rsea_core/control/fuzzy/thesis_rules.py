"""The thesis' fuzzy torque controller: Tables 4.2 and 4.3 as printed, and repaired.

What is wrong in the printed tables is found by `rule_base_checks`; the repair, in this order:

1. the columns ZE and PS of Table 4.2 are exchanged back, so that every row is monotone;
2. the table is made odd: rule (i, j) and its mirror image get the mean of their levels; a mean
   between two levels goes to the one farther from ZE, as a controller that leans on friction
   needs it;
3. input sets: the outermost of each input are shoulders ([-9 -9 -5] for the error, [-6 -6 -3.5]
   for its rate), PS of the error has its sign put right, so that every input fires a rule;
4. output sets: each pair of mirror images gets the mean of its numbers, ZE becomes [45 50 55].

The error goes in as actual less desired torque: with 4.16's sign the table's (NL, NL) -> PVH is
positive feedback.

Source: the thesis' Tables 4.2 and 4.3; specification, actuator.md section 2.1; errata C5-C10.
"""

import numpy as np

from rsea_core.control.fuzzy.inference import FuzzySystem
from rsea_core.errors import ControllerError

INPUT_NAMES = ("NL", "NM", "NS", "ZE", "PS", "PM", "PL")
OUTPUT_NAMES = ("NVH", "NH", "NL", "ZE", "PL", "PH", "PVH")
PRINTED_RULES = """
PVH PVH PH PL PL PL PL
PVH PH PH PL PL ZE ZE
PH PH PL ZE PL NL NL
PH PL ZE ZE ZE NL NH
PL ZE ZE NL ZE NH NH
ZE NL NL NH NL NH NVH
NL NH NH NVH NH NVH NVH
"""
PRINTED_ERROR = (
    (-5.0, -4.0, -3.0), (-9.0, -6.0, -2.0), (-3.0, -1.5, 0.0), (-0.75, 0.0, 0.75),
    (0.0, -1.5, 3.0), (2.0, 6.0, 9.0), (2.0, 3.0, 5.0),
)  # fmt: skip
PRINTED_RATE = (
    (-6.0, -5.0, -3.5), (-4.0, -3.0, -1.5), (-2.0, -1.0, 0.0), (-0.5, 0.0, 0.5),
    (0.0, 1.0, 2.0), (1.5, 3.0, 4.0), (3.5, 5.0, 6.0),
)  # fmt: skip
# printed [0 20] and [80 100] are half triangles at the ends of the PWM's range
PRINTED_OUTPUT = (
    (0.0, 0.0, 20.0), (0.0, 20.0, 40.0), (25.0, 40.0, 55.0), (48.0, 52.0, 58.0),
    (50.0, 63.0, 75.0), (58.0, 78.0, 93.0), (80.0, 100.0, 100.0),
)  # fmt: skip
NEUTRAL_PERCENT = 50.0  # a PWM of 0 % is full reverse on this bench
TABLES = ("printed", "corrected")


def printed_rules() -> np.ndarray:
    """Table 4.2 as levels 0 (NVH) to 6 (PVH), (7, 7) array: rows error, columns its rate."""
    printed = [line.split() for line in PRINTED_RULES.strip().splitlines()]
    return np.array([[OUTPUT_NAMES.index(word) for word in line] for line in printed])


def corrected_rules() -> np.ndarray:
    """Table 4.2 with its columns put right and made odd, (7, 7) array."""
    levels = printed_rules()[:, [0, 1, 2, 4, 3, 5, 6]] - 3
    odd = levels - levels[::-1, ::-1]
    return np.sign(odd) * ((np.abs(odd) + 1) // 2) + 3


def corrected_output() -> np.ndarray:
    """Output sets of Table 4.3 made mirror images of each other about 50 %, (7, 3) array."""
    sets = np.array(PRINTED_OUTPUT)
    mirrored = 100.0 - sets[::-1, ::-1]
    found = 0.5 * (sets + mirrored)
    found[3] = 45.0, 50.0, 55.0
    return found


def torque_table(name: str, aggregation: str = "sum") -> FuzzySystem:
    """The fuzzy torque controller of the thesis, in Nm, Nm/s and per cent of PWM.

    Parameters
    ----------
    name : "corrected" or "printed"
        "printed" has the one set that is out of order (PS of the error, [0 -1.5 3]) read as
        [0 1.5 3], because no membership can be made of it; everything else is as printed.

    Raises
    ------
    ControllerError
        If the name is neither.
    """
    if name not in TABLES:
        raise ControllerError(f"fuzzy table {name!r} must be one of {', '.join(TABLES)}")
    error, rate = np.array(PRINTED_ERROR), np.array(PRINTED_RATE)
    error[4] = 0.0, 1.5, 3.0
    rules, output = printed_rules(), np.array(PRINTED_OUTPUT)
    if name == "corrected":
        error[0], error[6] = (-9.0, -9.0, -5.0), (5.0, 9.0, 9.0)
        rate[0], rate[6] = (-6.0, -6.0, -3.5), (3.5, 6.0, 6.0)
        rules, output = corrected_rules(), corrected_output()
    return FuzzySystem(
        first=error,
        second=rate,
        output=output,
        rules=rules,
        names=(INPUT_NAMES, INPUT_NAMES, OUTPUT_NAMES),
        neutral=NEUTRAL_PERCENT,
        aggregation=aggregation,
    )
