"""Faults of a fuzzy controller, found before it drives anything.

Each finding is a sentence with the place and the number that matters. Checked are the order of
the sets, coverage (an input that fires no rule), the order of each row and column of the rules
(monotone towards one end), mirror symmetry of rules and sets, the answer at zero, the reachable
range, and how much of the decision surface runs the wrong way, which also happens with faultless
rules when the sets do not sum to one (Ruspini partition).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.control.fuzzy.inference import FuzzySystem

FAULT, NOTE = "fault", "note"
EXACT = 1e-9


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One thing found.

    Attributes
    ----------
    check : str
        "order", "coverage", "rules monotone", "rules symmetric", "sets symmetric", "bias",
        "range" or "surface monotone".
    severity : "fault" or "note"
    sentence : str
    value : float
        The number that matters, in the sentence's unit.
    """

    check: str
    severity: str
    sentence: str
    value: float


@dataclass(frozen=True, kw_only=True)
class Surface:
    """A decision surface on a grid: inputs (a,) and (b,), answers (a, b)."""

    first: NDArray
    second: NDArray
    answer: NDArray


def surface(system: FuzzySystem, points: int = 121) -> Surface:
    """The answers over the range that the input sets span."""
    first = np.linspace(system.first.min(), system.first.max(), points)
    second = np.linspace(system.second.min(), system.second.max(), points)
    answer = system.evaluate(first[:, None], second[None, :])
    return Surface(first=first, second=second, answer=answer)


def check_rule_base(system: FuzzySystem, *, points: int = 121) -> list[Finding]:
    """Everything that was found wrong or remarkable; an empty list means no finding."""
    grid = surface(system, points)
    found = [
        *_order(system.first, system.names[0], "first input"),
        *_order(system.second, system.names[1], "second input"),
        *_order(system.output, system.names[2], "output"),
        *_coverage(system, grid),
        *_rules_monotone(system),
        *_symmetry(system),
        *_bias(system),
    ]
    low, high = float(grid.answer.min()), float(grid.answer.max())
    found.append(
        Finding(
            check="range",
            severity=NOTE,
            sentence=f"answers reach from {low:.4g} to {high:.4g}",
            value=high - low,
        )
    )
    return [*found, *_surface_monotone(grid)]


def _order(sets: NDArray, names: tuple[str, ...], where: str) -> list[Finding]:
    """Neighbours must not overtake each other: peaks and feet ascend."""
    found = []
    for a in range(len(names) - 1):
        low, high = sets[a], sets[a + 1]
        behind = float(max(low[1] - high[1], low[0] - high[0], low[2] - high[2]))
        if behind > EXACT:
            found.append(
                Finding(
                    check="order",
                    severity=FAULT,
                    sentence=f"{where}: {names[a]} {_text(low)} does not lie below"
                    f" {names[a + 1]} {_text(high)}: it reaches {behind:.4g} beyond it",
                    value=behind,
                )
            )
    return found


def _text(triangle: NDArray) -> str:
    return "[" + " ".join(f"{x:g}" for x in triangle) + "]"


def _coverage(system: FuzzySystem, grid: Surface) -> list[Finding]:
    found = []
    reach = {"first": grid.first, "second": grid.second}
    for name, axis in reach.items():
        step = axis[1] - axis[0]
        beyond = (axis[0] - step, axis[-1] + step)
        inputs = [(x, 0.0) if name == "first" else (0.0, x) for x in beyond]
        silent = [
            x
            for x, (a, b) in zip(beyond, inputs, strict=True)
            if system.fires(a, b) < EXACT < system.fires(0.0, 0.0)
        ]
        if silent:
            found.append(
                Finding(
                    check="coverage",
                    severity=FAULT,
                    sentence=f"no rule fires for the {name} input beyond {axis[0]:g} or"
                    f" {axis[-1]:g}: the answer falls to the neutral {system.neutral:g}",
                    value=float(axis[-1]),
                )
            )
    silent = system.fires(grid.first[:, None], grid.second[None, :]) < EXACT
    if silent.any():
        a, b = np.argwhere(silent)[0]
        found.append(
            Finding(
                check="coverage",
                severity=FAULT,
                sentence=f"no rule is active in {silent.mean():.1%} of the range, for instance at"
                f" ({grid.first[a]:.3g}, {grid.second[b]:.3g})",
                value=float(silent.mean()),
            )
        )
    return found


def _rules_monotone(system: FuzzySystem) -> list[Finding]:
    """Rows and columns must go in one direction, that of most of them."""
    found = []
    for axis, names, what in ((1, system.names[0], "row"), (0, system.names[1], "column")):
        steps = np.diff(system.rules, axis=axis)
        direction = np.sign(steps.sum()) or 1.0
        wrong = direction * steps < 0
        lines = [names[i] for i in range(len(names)) if wrong.take(i, axis=1 - axis).any()]
        if lines:
            found.append(
                Finding(
                    check="rules monotone",
                    severity=FAULT,
                    sentence=f"the rules of {what} {', '.join(lines)} are not monotone: a larger"
                    " input gives a smaller output",
                    value=float(len(lines)),
                )
            )
    return found


def _symmetry(system: FuzzySystem) -> list[Finding]:
    found = []
    top = len(system.names[2]) - 1
    uneven = system.rules + system.rules[::-1, ::-1] != top
    pairs = int(uneven.sum() + uneven[tuple(np.array(uneven.shape) // 2)]) // 2
    if pairs:
        found.append(
            Finding(
                check="rules symmetric",
                severity=FAULT,
                sentence=f"{pairs} of {uneven.size // 2} pairs of mirrored rules disagree: the"
                " controller acts more strongly in one direction",
                value=float(pairs),
            )
        )
    centres = {"first": 0.0, "second": 0.0, "output": system.neutral}
    for name, centre in centres.items():
        sets = getattr(system, name)
        off = np.abs(sets + sets[::-1, ::-1] - 2.0 * centre)
        if off.max() > EXACT:
            label = system.names[list(centres).index(name)][int(off.max(axis=1).argmax())]
            found.append(
                Finding(
                    check="sets symmetric",
                    severity=FAULT,
                    sentence=f"the {name} sets are not symmetric about {centre:g}: {label} is"
                    f" {off.max():.4g} off",
                    value=float(off.max()),
                )
            )
    return found


def _bias(system: FuzzySystem) -> list[Finding]:
    bias = float(system.evaluate(0.0, 0.0)) - system.neutral
    if abs(bias) <= 1e-6:
        return []
    return [
        Finding(
            check="bias",
            severity=FAULT,
            sentence=f"with both inputs at zero the output is {system.neutral + bias:.4g}, not"
            f" {system.neutral:g}: a constant offset of {bias:+.4g}",
            value=bias,
        )
    ]


def _surface_monotone(grid: Surface) -> list[Finding]:
    found = []
    for axis, name in ((0, "first"), (1, "second")):
        steps = np.diff(grid.answer, axis=axis)
        direction = np.sign(steps.sum()) or 1.0
        share = float((direction * steps < -EXACT).mean())
        if share > 0.0:
            found.append(
                Finding(
                    check="surface monotone",
                    severity=NOTE,
                    sentence=f"along the {name} input {share:.1%} of the surface has the wrong"
                    f" sign, by up to {float((-direction * steps).max()):.3g} a grid step: the"
                    " sets do not sum to one",
                    value=share,
                )
            )
    return found
