"""What a drive can give at most: its current limit and supply sag."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from rsea_core.effects.base import NO_CONTEXT, Context, Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize, sized
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine, Unknown, Values

SOURCE_RESISTANCE, SOURCE_ONE_DIRECTION, SOURCE_RIPPLES = slots(
    "source_resistance", "source_one_way", "source_ripples"
)


@njit(error_model="numpy", inline="always")
def source_ohm(fx, command, current):
    """What supply sag adds to the winding's resistance [ohm].

    Only the sign of the current counts: `SOURCE_ONE_DIRECTION` takes its share away where the
    bridge returns current. With a capacitor the bridge draws duty times the current, evenly;
    without one it draws all of it for a share |duty| of the time (`SOURCE_RIPPLES`: share without
    one).
    """
    size = abs(command)
    share = size * (size + fx[SOURCE_RIPPLES] * (1.0 - size))
    if command * current < 0.0:
        share *= 1.0 - fx[SOURCE_ONE_DIRECTION]
    return share * fx[SOURCE_RESISTANCE]


NO_LIMIT_A = 1e3


def _supply_sag(flag: int | None):
    """What writes a supply with a resistance of its own into a machine.

    Parameters
    ----------
    flag : index or None
        `SOURCE_ONE_DIRECTION`: the supply takes nothing back; `SOURCE_RIPPLES`: without a
        capacitor the supply carries all current while the bridge is on.
    """

    def write(v: Values, d: TrialMachine, w: RunConditions) -> None:
        d.put(SOURCE_RESISTANCE, v["source_resistance_ohm"])
        if flag is not None:
            d.put(flag, 1.0)

    return write


def _write_limit(v: Values, d: TrialMachine, w: RunConditions) -> None:
    at = PLANT["current_limit"]
    d.plant[at] = min(d.plant[at], v["current_limit_A"])


def _given_volts(d: TrialMachine, v: Values, x: NDArray) -> NDArray:
    """Volts left of a full supply at a current; none beyond the limit."""
    plant = d.machine_numbers
    volts = plant.volts_per_command - d.fx[SOURCE_RESISTANCE] * np.abs(x)
    return np.where(np.abs(x) <= plant.current_limit, volts, np.nan)


@dataclass(frozen=True, kw_only=True)
class DriveSaturation(Term):
    """Supply sag under its current, and a current limit below the nominal one.

    A bridge draws duty times the winding's current from the supply, evenly where a capacitor
    carries the ripple, so that the winding gets duty (U - R_s duty i). Without one the supply
    carries all of i while the bridge is on: duty U - R_s |duty| i. While the motor brakes the
    same raises the bus, except where the supply takes nothing back.

    Source
    ------
    Averaged model of a full bridge: Mohan, Undeland & Robbins, Power Electronics, ch. 7.
    """

    effect: ClassVar[str] = "drive-saturation"
    law: ClassVar[str] = "source-and-limit"
    port: ClassVar[Port] = Port.DRIVE
    headline: ClassVar[str] = "The drive saturates: it gives less than commanded at large currents."
    figure_units: ClassVar[Mapping[str, str]] = {
        "source_resistance_ohm": "ohm",
        "current_limit_A": "A",
    }
    curve: ClassVar = EffectCurve(
        title="Volts left of a full supply", x_label="current (A)", y_label="voltage (V)",
        over="current", evaluate=_given_volts,
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="sag", part="drive", commands=frozenset({"duty"}),
        size=lambda m: sized(0.2 * (m.rig.terminal_resistance_ohm or 1.0),
                             "{:.3g} ohm in the supply"),
    )  # fmt: skip

    source_resistance_ohm: float = parameter(
        0.0,
        unit="ohm",
        bounds=(0.0, 1e9),
        source="0: a stiff supply",
        meaning="Resistance of supply and cable, over which the bridge voltage drops.",
    )
    returned_share: float = parameter(
        1.0,
        unit="-",
        bounds=(0.0, 1.0),
        source="1: a battery; 0: a rectifier, what comes back is burnt in a brake chopper",
        meaning="Share of the returned current that raises the bus voltage.",
    )
    ripple_share: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 1.0),
        source="0: a capacitor at the bridge; 1: none",
        meaning="Share of the bridge's ripple current that the supply carries.",
    )
    current_limit_A: float = parameter(
        NO_LIMIT_A,
        unit="A",
        bounds=(1e-3, NO_LIMIT_A),
        source="1000: the rig's limit alone",
        meaning="The largest winding current that the amplifier lets flow.",
    )

    def comparable(self, context: Context = NO_CONTEXT) -> Mapping[str, float | str]:
        """Source resistance of a supply sag, current limit where it limits."""
        found = {}
        if self.source_resistance_ohm > 0.0 or self.current_limit_A == NO_LIMIT_A:
            found["source_resistance_ohm"] = self.source_resistance_ohm
        if self.current_limit_A < NO_LIMIT_A:
            found["current_limit_A"] = self.current_limit_A
        return found

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The source's resistance, and how currents pass it."""
        return {
            "source_resistance": self.source_resistance_ohm,
            "source_one_way": 1.0 - self.returned_share,
            "source_ripples": self.ripple_share,
        }

    def on_plant(self, plant):
        """The machine with the lower limit of both."""
        return plant._replace(current_limit=min(plant.current_limit, self.current_limit_A))

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """Supply sag is that of a bridge."""
        has_source = self.source_resistance_ohm > 0.0
        return "needs a drive by duty" if has_source and command_name != "duty" else None

    def equation(self) -> str:
        ripple = self.ripple_share
        drawn = f"duty^2 + {ripple:g} (|duty| - duty^2)" if ripple > 0.0 else "duty^2"
        back = self.returned_share
        braking = f" [{back:g} of it where duty i < 0]" if back < 1.0 else ""
        return (
            f"winding voltage = duty supply_voltage - {self.source_resistance_ohm:g} ({drawn}) i"
            f"{braking},  |i| <= {self.current_limit_A:g} A"
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """Supply sag, with and without regeneration and a DC-link capacitor; a current limit."""
        found = []
        rig, common = typical.rig, {"effect": cls.effect, "subsystem": "drive", "kind": cls}
        if "duty" in typical.commands:
            R = 1.0 if rig is None else rig.terminal_resistance_ohm or 1.0
            ohm = Unknown(name="source_resistance_ohm", unit="ohm", low=0.0, high=10 * R,
                          scale=0.05 * R)  # fmt: skip
            supply = {"unknowns": (ohm,), "starts": ((0.1 * R,), (0.5 * R,)), **common}
            found += [
                Law(law="sag", write=_supply_sag(None), richer=("sag, no capacitor",),
                    always=("sag, one way",), **supply),
                Law(law="sag, one way", write=_supply_sag(SOURCE_ONE_DIRECTION), follows=True,
                    parameters=lambda v, rig: {**v, "returned_share": 0.0}, **supply),
                Law(law="sag, no capacitor", write=_supply_sag(SOURCE_RIPPLES), follows=True,
                    parameters=lambda v, rig: {**v, "ripple_share": 1.0}, **supply),
            ]  # fmt: skip
        if typical.commands & {"duty", "voltage_V", "current_command_A"}:
            top = 10 * typical.current_A
            if rig is not None:
                top = rig.current_limit_A or top
            seen = typical.peak_current_A
            peak = min(top if seen is None else seen, top)
            # a lower limit is implausible, and dry friction would be taken for it
            low = 0.1 * peak if typical.relative else 0.02 * top
            if typical.often_read_A is not None:  # no winding carries more than its limit
                low = min(max(low, 0.9 * typical.often_read_A), 0.99 * top)
            # the least is just above the bound
            shares = (0.97, 1.0, 0.8, 0.6, *((0.4, 0.25, 0.15, 0.11) if typical.relative else ()))
            found.append(
                Law(law="limit", write=_write_limit,
                    unknowns=(Unknown(name="current_limit_A", unit="A", low=low, high=top,
                                      scale=0.03 * top),),
                    starts=tuple((share * peak,) for share in shares), **common)
            )  # fmt: skip
        return found

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The limit, or the supply's resistance."""
        if "current_limit_A" in f.figures:
            return f"a current limit of {f('current_limit_A', 'A')}"
        return f"supply sag behind a source resistance of {f('source_resistance_ohm', 'ohm')}"
