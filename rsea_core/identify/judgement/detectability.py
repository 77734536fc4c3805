"""What recordings would show: the smallest amount of each effect that they could not hide.

A diagnosis that finds nothing says little where nothing could have been found. Each effect is
replayed once at a size that would matter in practice, its change of the innovations freed of what
the parameters can mimic; the score that the search would have gained by it is then known without
a fit, and so is the size at which that gain would be enough, for a small change of the
innovations is linear in a law's amount (minimum detectable amount: Basseville and Nikiforov,
Detection of Abrupt Changes (1993) ch. 7; docs/diagnosis.md 7.4).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rsea_core.effects.base import Port
from rsea_core.effects.known_variants import laws_by_key
from rsea_core.effects.registry import LAWS
from rsea_core.effects.relevant_size import MachineSize
from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.least_squares import STEP, Fit
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.judgement.criteria import DETECTED_GAIN
from rsea_core.identify.selection.criteria import PRICE, Search
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import GRAVITY_m_per_s2
from rsea_core.recordings.recording import Recording

_PORTS = (Port.DRIVE, Port.GEAR, Port.SPRING, Port.LOAD, Port.ENVIRONMENT, Port.SENSOR)
DEFLECTION_rad = 0.15  # at which the file contract compares springs
FAINT, STRONG = 1e-3, 1e3  # sizes between which the smallest one that is seen is looked for


@dataclass(frozen=True, kw_only=True)
class DetectableSize:
    """An effect at the size that matters, as these recordings would show it.

    Attributes
    ----------
    law : Law
        Its first start is the size that matters.
    words : str
        That size.
    gain : float
        Log-likelihood units that the effect would bring at that size over parameters alone.
    least : float
        The smallest amount that would be seen, over the size that matters; inf for none.
    """

    law: Law
    description: str
    gain: float
    least: float

    @property
    def seen(self) -> bool:
        """Whether an effect of that size would be found."""
        return self.gain >= DETECTED_GAIN


def sizes_that_matter(rig: Rig, recordings: Sequence[Recording]) -> list[tuple[Law, str]]:
    """Laws whose first start is a size that would matter on this machine, and it as text.

    Each effect has its own (`effects.relevant_size`); they are in the order of the ports, then of
    the registry.

    Parameters
    ----------
    recordings : sequence of Recording
        A contact is a part of the machine only where one of them has it, and what can go wrong
        with a drive depends on what commands it.
    """
    known = laws_by_key()
    machine = _size_of(rig, recordings)
    kinds = [kind for laws in LAWS.values() for kind in laws.values()]
    found = []
    for kind in sorted(kinds, key=lambda kind: _PORTS.index(kind.port)):
        own = vars(kind).get("relevant")
        if own is not None and own.acts_on(machine):
            size, description = own.size(machine)
            found.append((_of_size(known[f"{kind.effect}/{own.variant}"], size), description))
    return found


def _size_of(rig: Rig, recordings: Sequence[Recording]) -> MachineSize:
    rated = (rig.current_limit_A or 1.0) * (rig.torque_constant_Nm_per_A or 1.0)
    rated *= rig.gear_ratio or 1.0
    K = rig.spring_stiffness_Nm_per_rad
    torque = K * DEFLECTION_rad if K else rated
    weight = (rig.load_mass_kg or 0.0) * GRAVITY_m_per_s2 * (rig.load_distance_m or 0.0)
    return MachineSize(
        rig=rig, torque_Nm=torque, load_torque_Nm=weight or 0.1 * torque,
        commands=frozenset(r.command_name for r in recordings),
        loads=frozenset(r.load.kind for r in recordings),
    )  # fmt: skip


def _of_size(law: Law, size: tuple[float, ...]) -> Law:
    """The law begun at a size; values after those given are its own."""
    return replace(law, starts=((*size, *law.starts[0][len(size) :]),))


def minimum_detectable_sizes(
    search: Search, sizes: Sequence[tuple[Law, str]] | None = None
) -> list[DetectableSize]:
    """Every effect of the machine's parts at the size that matters, by linear algebra.

    Parameters
    ----------
    sizes : sequence of (Law, str) or None
        Other sizes than those of `sizes_that_matter`.
    """
    problem, base = search.problem, search.parameters
    recordings = [b.recording for b in problem.fitted]
    chosen = sizes_that_matter(problem.case.rig, recordings) if sizes is None else sizes
    J, columns = _columns(problem, base, [law for law, _ in chosen])
    _, weight = problem.prior(base.hypothesis)
    A = J @ J.T + np.diag(weight**2 + 1e-9)
    edges = np.cumsum([b.whitener.size for b in problem.fitted])[:-1]
    found = []
    blocks = search.independent_blocks()
    for (law, description), column in zip(chosen, columns, strict=True):
        left = column - np.linalg.solve(A, J @ column) @ J
        share = [float(np.mean(part**2)) for part in np.split(left, edges)]
        traces = np.array(share) / np.maximum(base.msni, 1.0)
        price = PRICE * sum(parameter.scale > 0.0 for parameter in law.unknowns)
        found.append(
            DetectableSize(
                law=law, description=description, gain=_gain(traces, blocks, price),
                least=_least(traces, blocks, price),
            )
        )  # fmt: skip
    return found


def _columns(problem: Problem, base: Fit, laws: Sequence[Law]) -> tuple[NDArray, NDArray]:
    """Changes of all innovations by a tolerance of each parameter and by each law as it starts."""
    n = base.x.size
    trials = [(base.hypothesis, x) for x in np.vstack([base.x, base.x + STEP * np.eye(n)])]
    for law in laws:
        own = problem.start(Hypothesis(laws=(law,)))[len(problem.nominals) :]
        trials.append((Hypothesis(laws=(law,)), np.concatenate([base.x[:n], own])))
    parts = problem.innovations_of(trials)
    flat = np.concatenate([e.reshape(len(trials), -1) for e in parts], axis=1)
    change = flat[1:] - flat[0]
    # a machine so far off that its replay fails would be noticed
    J = np.where(np.all(np.isfinite(change[:n]), axis=1)[:, None], change[:n], 0.0) / STEP
    return J, np.nan_to_num(change[n:], nan=STRONG)


def _gain(traces: NDArray, blocks: NDArray, price: float) -> float:
    """Log-likelihood of `Search.score` that explaining traces (recordings,), over the noise, would
    bring."""
    return 0.5 * float(np.sum(blocks * np.log1p(traces))) - price


def _least(traces: NDArray, blocks: NDArray, price: float) -> float:
    """The factor of the amount at which it would just be seen."""
    low, high = np.log(FAINT), np.log(STRONG)
    if _gain(traces * STRONG**2, blocks, price) < DETECTED_GAIN:
        return np.inf
    for _ in range(40):
        middle = 0.5 * (low + high)
        enough = _gain(traces * np.exp(2.0 * middle), blocks, price) >= DETECTED_GAIN
        low, high = (low, middle) if enough else (middle, high)
    return float(np.exp(high))
