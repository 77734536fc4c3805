"""An external torque on the load during part of a recording."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.load_base import HELD
from rsea_core.effects.slots import slots
from rsea_core.effects.variant import Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError
from rsea_core.machine.rig import Rig

(
    PULSE,
    PULSE_START,
    PULSE_END,
    PULSE_RISE,
    PULSE_TAPER,
) = slots("pulse_torque", "pulse_start", "pulse_end", "pulse_rise", "pulse_taper")


LONGEST = 0.5  # of a recording that a pulse may last: longer is not a pulse but a machine


def disturbance(
    file: str, index: int, start: tuple[float, float, float], torque: float, last_s: float,
    *, step_s: float = 0.01,
) -> Law:  # fmt: skip
    """An external torque on the load in one recording: (start, width, peak).

    Parameters
    ----------
    step_s : float
        Scale of a fit's onset; half of it is the shortest width.
    """

    def write(v: Values, d: TrialMachine, w: RunConditions) -> None:
        if w.index != index or v.get("recording", w.index) != w.index or w.kind in HELD:
            return
        d.put(PULSE, v["peak_Nm"])
        d.put(PULSE_START, v["start_s"])
        d.put(PULSE_END, v["start_s"] + v["width_s"])
        d.put(PULSE_TAPER, v.get("taper", 0.0))

    return Law(
        effect="load-disturbance", law=f"pulse near {start[0]:.2f} s" if file else "pulse",
        subsystem="load", only=file or None, kind=LoadDisturbance, parameters=_parameters,
        write=write,
        unknowns=(Unknown(name="start_s", unit="s", low=0.0, high=last_s, scale=step_s),
                  Unknown(name="width_s", unit="s", low=0.5 * step_s,
                          high=LONGEST * last_s, scale=0.03, log=True),
                  Unknown(name="peak_Nm", unit="Nm", low=-50 * torque, high=50 * torque,
                          scale=0.05 * torque),
                  Unknown(name="taper", unit="-", low=0.0, high=1.0, scale=0.1, closed=True)),
        starts=((*start, 0.3),),
    )  # fmt: skip


def _parameters(v: Values, rig: Rig) -> Values:
    """A scenario's, without the flanks of a pulse."""
    end = v["start_s"] + v["width_s"]
    return {"start_s": v["start_s"], "end_s": end, "peak_Nm": v["peak_Nm"]}


@dataclass(frozen=True, kw_only=True)
class LoadDisturbance(Term):
    """An external torque on the load between two times of the recording.

    Raises
    ------
    TermError
        If a parameter is outside its bounds or the end is not after the start.
    """

    effect: ClassVar[str] = "load-disturbance"
    law: ClassVar[str] = "pulse"
    port: ClassVar[Port] = Port.LOAD
    headline: ClassVar[str] = "An external torque acted on the load during part of a recording."
    figure_units: ClassVar[Mapping[str, str]] = {
        "recording": "",
        "start_s": "s",
        "end_s": "s",
        "peak_Nm": "Nm",
    }

    start_s: float = parameter(
        unit="s",
        bounds=(-1e6, 1e6),
        source="a fit",
        meaning="Time at which the external torque begins.",
    )
    end_s: float = parameter(
        unit="s",
        bounds=(-1e6, 1e6),
        source="a fit",
        meaning="Time at which the external torque ends.",
    )
    peak_Nm: float = parameter(
        unit="Nm",
        bounds=(-1e9, 1e9),
        source="a fit",
        meaning="The external torque, positive where it helps positive motion.",
    )
    rise_s: float = parameter(
        0.0,
        unit="s",
        bounds=(0.0, 1e6),
        source="0: a pulse",
        free=False,
        meaning="Time within which it rises in proportion to time.",
    )

    def __post_init__(self):
        super().__post_init__()
        if not self.end_s > self.start_s:
            raise TermError(
                f"{self.effect}: end_s = {self.end_s} must come after start_s = {self.start_s}"
            )
        if self.rise_s > self.end_s - self.start_s:
            raise TermError(
                f"{self.effect}: rise_s = {self.rise_s} is longer than it lasts,"
                f" {self.end_s - self.start_s:g} s"
            )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Where in which recording, and how much."""
        return {
            "recording": context.need(self.effect, "recording"),
            "start_s": self.start_s,
            "end_s": self.end_s,
            "peak_Nm": self.peak_Nm,
        }

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """Torque and times."""
        found = {
            "pulse_torque": self.peak_Nm,
            "pulse_start": self.start_s,
            "pulse_end": self.end_s,
        }
        if self.rise_s > 0.0:
            found |= {"pulse_rise": self.rise_s, "internal_states": 1.0}
        return found

    def equation(self) -> str:
        text = f"{self.peak_Nm:g} Nm on the load where {self.start_s:g} s <= t < {self.end_s:g} s"
        return text + (f", rising for {self.rise_s:g} s" if self.rise_s > 0.0 else "")

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """Peak and times."""
        start, end = (f"{f.figures[name]:.4g}" for name in ("start_s", "end_s"))
        return (
            f"an external torque of {f('peak_Nm', 'Nm')} at its peak on the load,"
            f" {start} to {end} s in {f.figures['recording']}"
        )
