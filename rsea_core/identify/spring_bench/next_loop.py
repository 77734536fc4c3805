"""What to record next where no recording of a spring's bench turns back.

A path in one direction only cannot tell friction from elasticity. One that turns back twice
can, as far as the two nearest explanations predict torques apart by more than the sensor's noise.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.identify.spring_bench.diagnose import SpringConclusion
from rsea_core.identify.spring_bench.effects import effects_of
from rsea_core.identify.spring_bench.loops import BenchRows

FILE = "next.csv"
TURNS = (0.0, 1.0, -1.0, 0.6)  # of the largest deflection that was reached
ROWS = 400
TYPICAL_RATE = 0.5  # of the fastest that was recorded


@dataclass(frozen=True, kw_only=True)
class NextLoop:
    """A path of deflection that settles what the recordings leave open.

    Attributes
    ----------
    columns : dict of (n,) arrays
        `time_s` and `spring_deflection_rad`, ready to run.
    rivals : (str, str)
    separation : float
        Root mean square of the difference of their torques over the sensor's noise.
    """

    columns: dict[str, NDArray]
    rivals: tuple[str, str]
    separation: float

    @property
    def sentence(self) -> str:
        """What to do, in one line."""
        largest = float(np.abs(self.columns["spring_deflection_rad"]).max())
        return (
            f"turn the spring to {largest:.3g} rad, then to the same angle in the other"
            f" direction and back: {self.rivals[0]} and {self.rivals[1]} then differ by"
            f" {self.separation:.3g} times the torque sensor's noise"
        )

    @property
    def entry(self) -> dict:
        """As `diagnosis.json` has it."""
        return {
            "sentence": self.sentence, "load": "imposed", "extra_mass_kg": 0.0,
            "sensors": ["torque_Nm", "spring_deflection_rad"], "file": FILE,
            "rivals": list(self.rivals), "predicted_separation": self.separation,
        }  # fmt: skip

    @property
    def recording_toml(self) -> str:
        """The [[recording]] table of the file contract."""
        text = 'description = "deflection to both sides and back"'
        lines = ["[[recording]]", f'file = "{FILE}"', 'role = "identification"']
        return "\n".join([*lines, 'load = "imposed"', text]) + "\n"


def next_loop(conclusion: SpringConclusion) -> NextLoop | None:
    """The path, where the verdict is that data are insufficient; None else."""
    if conclusion.verdict != "insufficient-data":
        return None
    bench, best = conclusion.found.bench, conclusion.found.best
    own = effects_of(best).keys()
    others = [  # that do without something of what was chosen
        c for c in conclusion.found.candidates if c.fit is not None and own - effects_of(c).keys()
    ]
    if not others:
        return None
    deflections = np.concatenate([r.deflection_rad for r in bench.rows])
    largest = float(np.abs(deflections).max())
    fastest = max(float(np.abs(np.gradient(r.deflection_rad, r.time_s)).max()) for r in bench.rows)
    corners = largest * np.array(TURNS)
    lengths = np.abs(np.diff(corners)) / (TYPICAL_RATE * max(fastest, 1e-9))
    at = np.concatenate(([0.0], np.cumsum(lengths)))
    time = np.linspace(0.0, at[-1], ROWS)
    deflection = np.interp(time, at, corners)
    path = BenchRows(
        file=FILE, role="identification", time_s=time, deflection_rad=deflection,
        torque_Nm=np.zeros(ROWS),
    )  # fmt: skip
    rival = others[0]
    apart = bench.predicted(path, best.fit) - bench.predicted(path, rival.fit)
    floor = max(bench.floor(r) for r in bench.rows)
    separation = float(np.sqrt(np.mean((apart - apart[0]) ** 2)) / max(floor, 1e-300))
    return NextLoop(
        columns={"time_s": time, "spring_deflection_rad": deflection},
        rivals=(best.name, rival.name),
        separation=separation,
    )
