"""An inertia that varies with the angle, as of a crank or of a cam: no named law.

A body of inertia J(theta) needs the torque J alpha + J' omega^2 / 2 (Lagrange's equation of a
kinetic energy J omega^2 / 2; Norton, Design of Machinery (2012), section 11.4). Waves of the angle
times alpha and omega^2 in that proportion are regressed on innovations as the terms of a formula
(`sparse_regression`). The inertia of the load is then fitted (`LoadInertiaVariation`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.machine.plant as mp
from rsea_core.identify.formula.sparse_regression import STATES, blocks_of_changes
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.law_search.shape_search import responses
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.multistep.tracks import Track

CYCLES = (1, 2)  # in a turn


@dataclass(frozen=True, kw_only=True)
class VaryingInertia:
    """J(theta) - J_0 as a wave of the angle.

    Attributes
    ----------
    cycles : int
        In a turn.
    cosine_kgm2, sine_kgm2 : float
    share : float
        Amplitude over the inertia that moves with the port.
    held_out, deviation : float
        Gain on blocks left out, and its standard deviation, as of a `Candidate`.
    side : str
        Part of the machine.
    estimator, fit
        With the law of the load's inertia; parameters alone where it is another body's.
    """

    cycles: int
    cosine_kgm2: float
    sine_kgm2: float
    share: float
    held_out: float
    deviation: float
    side: str
    estimator: Estimator
    fit: Estimate

    @property
    def amplitude_kgm2(self) -> float:
        """Of the wave."""
        return float(np.hypot(self.cosine_kgm2, self.sine_kgm2))

    def sentence(self) -> str:
        """What it is, with its size."""
        return f"an inertia that varies with the angle theta: {self.text()}"

    def text(self) -> str:
        """The inertia as a formula."""
        wave = "theta" if self.cycles == 1 else f"{self.cycles} theta"
        sign = "-" if self.sine_kgm2 < 0.0 else "+"
        return (
            f"J = J0 + ({self.cosine_kgm2:.3g} cos({wave}) {sign} {abs(self.sine_kgm2):.3g}"
            f" sin({wave})) kgm2, an amplitude of {100.0 * self.share:.0f} % of J0; it needs the"
            " torque J alpha + J' omega^2 / 2"
        )

    def report(self) -> dict:
        """The formula as data."""
        return {
            "words": self.text(),
            "terms": [
                {"function": f"cos({self.cycles} theta)", "coefficient_kgm2": self.cosine_kgm2},
                {"function": f"sin({self.cycles} theta)", "coefficient_kgm2": self.sine_kgm2},
            ],
        }


def varying_inertia(projection: Projection, base: Estimate, port: str) -> VaryingInertia | None:
    """The wave of the inertia at a port that explains most; None where nothing is seen.

    Parameters
    ----------
    base : Estimate
        Parameters alone, about which the projection is made.
    port : str
        "G": the body of the gear's output, or the whole rigid train; "L": the load.
    """
    tracks = projection.estimator.tracks
    plant = tracks[0].plant
    rigid = plant.structure == mp.RIGID_FREE
    moved = plant.load_inertia if port == "L" else plant.inertia + rigid * plant.load_inertia
    changes = []
    for t in tracks:
        torques = [torque for cycles in CYCLES for torque in _torques(t, port, cycles)]
        changes.append(responses(t, port, np.array(torques)))
    blocks, seen = blocks_of_changes(projection, changes)
    found = []
    for place, cycles in enumerate(CYCLES):
        pair = [2 * place, 2 * place + 1]
        if set(pair) <= set(seen):
            a, b = blocks.solved(pair, np.arange(len(blocks.xy)))
            held_out, deviation = blocks.held_out(pair)
            found.append(
                VaryingInertia(
                    cycles=cycles, cosine_kgm2=float(a), sine_kgm2=float(b), held_out=held_out,
                    deviation=deviation, share=float(np.hypot(a, b)) / moved,
                    side="load" if rigid or port == "L" else "gear",
                    estimator=projection.estimator, fit=base,
                )
            )  # fmt: skip
    return max(found, key=lambda f: f.held_out, default=None)


def _torques(t: Track, port: str, cycles: int) -> tuple[NDArray, NDArray]:
    """What a unit wave of the inertia, as cosine and as sine, takes from the body (n,) [Nm]."""
    angle, speed = (t.motion[:, at] for at in STATES[port])
    row_s = t.experiment.recording.sample_time_s
    acceleration = np.gradient(speed, row_s)
    turned = cycles * angle
    half = 0.5 * cycles * speed**2
    return (
        -(np.cos(turned) * acceleration - half * np.sin(turned)),
        -(np.sin(turned) * acceleration + half * np.cos(turned)),
    )
