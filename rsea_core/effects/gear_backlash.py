"""Backlash between the gear's flanks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from rsea_core.effects.base import Gear, Port, Term, parameter
from rsea_core.effects.curve import EffectCurve
from rsea_core.effects.figure_text import FigureText
from rsea_core.effects.relevant_size import RelevantSize
from rsea_core.effects.slots import slots
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import PLANT, Law, RunConditions, TrialMachine, Unknown, Values
from rsea_core.errors import TermError
from rsea_core.machine.rig import Rig
from rsea_core.machine.tolerances import TOLERANCES

(
    BACKLASH,
    BACKLASH_INERTIA,
    BACKLASH_DAMPING,
    BACKLASH_RESTITUTION,
) = slots("backlash_width", "backlash_wheel_inertia", "backlash_wheel_damping", "backlash_rebound")


WHEEL_kgm2, LEAST_DRAG = 2e-3, 1e-4  # of a wheel of which the rig's file says nothing [Nms/rad]
RESTITUTION = 0.3  # of flanks of steel and bronze in grease, before a fit says more
# widths over the deflection, a tenth apart: beyond that free runs meet the flanks out of step
WIDTHS, LARGE_WIDTHS = (0.01, 0.04, 0.15), (0.6, 2.5)  # of the deflection: starts
WIDTH_GRID, RESTITUTIONS = np.geomspace(0.01, 1.5, 54), (0.1, 0.4, 0.7)


def _write(v: Values, d: TrialMachine, w: RunConditions) -> None:
    """Lost motion between motor and wheel; part of inertia and damping sits behind it.

    Where in its play the wheel rests when a recording begins, the first torque reading tells.
    """
    if v["width_rad"] <= 0.0:
        return
    wheel, damping = v.get("wheel_inertia_kgm2", 2e-3), v.get("wheel_damping_Nms_per_rad", 0.0)
    d.put(BACKLASH, v["width_rad"])
    d.put(BACKLASH_RESTITUTION, v.get("rebound", 0.0))
    d.put(BACKLASH_INERTIA, min(wheel, 0.5 * d.plant[PLANT["inertia"]]))
    d.put(BACKLASH_DAMPING, min(damping, 0.5 * d.plant[PLANT["damping"]]))
    if w.start_torque_Nm is not None and d.stiffness > 0.0:
        d.start_deflection_rad = w.start_torque_Nm / d.stiffness


def _parameters(v: Values, rig: Rig) -> Values:
    """The wheel behind the backlash is the one that the fit took."""
    ratio = rig.gear_ratio or 1.0
    whole = ratio**2 * (rig.motor_inertia_kgm2 or 0.0) + (rig.output_inertia_kgm2 or 0.0)
    drag = ratio**2 * (rig.motor_viscous_Nms_per_rad or 0.0)
    drag += rig.output_viscous_Nms_per_rad or 0.0
    return {
        "width_rad": v["width_rad"],
        "wheel_inertia_kgm2": min(v.get("wheel_inertia_kgm2", WHEEL_kgm2), 0.5 * whole),
        "wheel_damping_Nms_per_rad": min(v.get("wheel_damping_Nms_per_rad", 0.0), 0.5 * drag),
        "rebound": v.get("rebound", 0.0),
    }


@dataclass(frozen=True, kw_only=True)
class GearBacklash(Term):
    """Play between worm and wheel: motor side and wheel are two bodies.

    The wheel with the spring's hub (J_o, B_o of the rig) is in mesh with one flank or free in
    the gap. A flank only pushes; where it would have to pull, it lets go. Closing the gap is
    an impact: both keep their momentum, less what a worm's friction takes of it, and part with the
    share `rebound` of the speed at which they met. The motor's friction stays on the motor side.

    Source
    ------
    Nordin & Gutman, Controlling mechanical systems with backlash: a survey, Automatica 38
    (2002) 1633; rigid contact: Pfeiffer & Glocker, Multibody Dynamics with Unilateral Contacts.
    """

    effect: ClassVar[str] = "gear-backlash"
    law: ClassVar[str] = "rigid-flanks"
    port: ClassVar[Port] = Port.GEAR
    headline: ClassVar[str] = "The gear has backlash: lost motion where the torque changes sign."
    figure_units: ClassVar[Mapping[str, str]] = {"width_rad": "rad"}
    curve: ClassVar = EffectCurve(
        title="Lost motion of the gear", x_label="torque carried (Nm)", y_label="angle (rad)",
        over="torque", evaluate=lambda d, v, x: 0.5 * d.fx[BACKLASH] * np.sign(x),
    )  # fmt: skip
    relevant: ClassVar = RelevantSize(
        variant="play", part="gear", size=lambda m: ((3e-3,), "3 mrad of backlash")
    )

    width_rad: float = parameter(
        unit="rad (at the wheel)",
        bounds=(0.0, 0.2),
        source="0.1-0.5 mm over the wheel's radius; a fit",
        meaning="How far the wheel can be turned while the motor is held.",
    )
    wheel_inertia_kgm2: float = parameter(
        0.0,
        unit="kgm2",
        bounds=(0.0, 1e9),
        source="0: J_o of the rig, with B_o; a diagnosis: what its fit took",
        free=False,
        meaning="Share of the machine's inertia that moves with the wheel, behind the backlash.",
    )
    wheel_damping_Nms_per_rad: float = parameter(
        0.0,
        unit="Nms/rad",
        bounds=(0.0, 1e9),
        source="with wheel_inertia_kgm2 only: a diagnosis, what its fit took",
        free=False,
        meaning="Share of the viscous friction that acts on the wheel behind the backlash.",
    )
    rebound: float = parameter(
        0.0,
        unit="-",
        bounds=(0.0, 0.95),
        source="0: none; some 0.3 of steel and bronze in grease; a fit",
        meaning="Speed at which the flanks part after an impact over that at which they met.",
    )

    def numbers(self, gear: Gear) -> Mapping[str, float]:
        """The whole gap and the impact."""
        if self.width_rad == 0.0:
            return {}
        found = {"backlash_width": self.width_rad, "internal_states": 1.0}
        return found | ({"backlash_rebound": self.rebound} if self.rebound > 0.0 else {})

    def rig_numbers(self, rig, gravity: float) -> Mapping[str, float]:
        """What is behind the backlash."""
        if self.width_rad == 0.0:
            return {}
        if self.wheel_inertia_kgm2 > 0.0:
            return self._given_wheel(rig)
        rig.need("the wheel behind the backlash", "motor_inertia_kgm2", "output_inertia_kgm2")
        for key in ("motor_inertia_kgm2", "output_inertia_kgm2"):
            if not getattr(rig, key) > 0.0:
                raise TermError(
                    f"{self.effect} on rig {rig.name!r}: {key} = {getattr(rig, key):g} must be"
                    " above 0, backlash lies between two bodies"
                )
        return {
            "backlash_wheel_inertia": rig.output_inertia_kgm2,
            "backlash_wheel_damping": rig.output_viscous_Nms_per_rad or 0.0,
        }

    def _given_wheel(self, rig) -> Mapping[str, float]:
        motor = (rig.gear_ratio or 1.0) ** 2 * (rig.motor_inertia_kgm2 or 0.0)
        whole = motor + (rig.output_inertia_kgm2 or 0.0)
        if not self.wheel_inertia_kgm2 < whole:
            raise TermError(
                f"{self.effect} on rig {rig.name!r}: wheel_inertia_kgm2 ="
                f" {self.wheel_inertia_kgm2:g} must be below the {whole:g} of motor and wheel"
            )
        return {
            "backlash_wheel_inertia": self.wheel_inertia_kgm2,
            "backlash_wheel_damping": self.wheel_damping_Nms_per_rad,
        }

    def needs(self, command_name: str | None, rigid: bool, dry: int) -> str | None:
        """The wheel behind the backlash sits with the spring."""
        return "needs a spring, with which the wheel behind the backlash moves" if rigid else None

    def equation(self) -> str:
        return (
            f"|theta_m/N - theta_w| <= {0.5 * self.width_rad:g}: J_o w_w' = c - B_o w_w - tau_s,"
            " flank torque c on the motor side too, c pushes only, impact"
            + (f" with rebound {self.rebound:g}" if self.rebound > 0.0 else " without rebound")
        )

    @classmethod
    def candidates(cls, typical: TypicalMagnitudes) -> Sequence[Law]:
        """A width, the wheel behind it as the rig has it, or free: it swings and bounces."""
        rig, deflection = typical.rig, typical.deflection_rad
        width = Unknown(name="width_rad", unit="rad", low=0.0, scale=0.02 * deflection,
                        high=deflection * 4 + 0.02 * (not typical.relative))  # fmt: skip
        inertia = rig.output_inertia_kgm2 if rig is not None else None
        inertia = inertia or typical.like_inertia(WHEEL_kgm2)
        drag = rig.output_viscous_Nms_per_rad if rig is not None else None
        least = inertia / typical.time_s if typical.relative else LEAST_DRAG
        damping = max(drag or 0.0, least)
        wheel = (
            Unknown(name="wheel_inertia_kgm2", unit="kgm2", low=0.2 * inertia, high=5.0 * inertia,
                    scale=0.1, log=True, prior=TOLERANCES["output_inertia_kgm2"]),
            Unknown(name="wheel_damping_Nms_per_rad", unit="Nms/rad", low=0.02 * damping,
                    high=50.0 * damping, scale=0.2, log=True,
                    prior=TOLERANCES["output_viscous_Nms_per_rad"]),
            Unknown(name="rebound", unit="-", low=0.0, high=0.95, scale=0.1),
        )  # fmt: skip
        held = tuple(replace(unknown, scale=0.0) for unknown in wheel)
        widths = WIDTHS + (LARGE_WIDTHS if typical.relative else ())
        starts = tuple((v * deflection, inertia, damping, RESTITUTION) for v in widths)
        grid = tuple(
            (float(v) * deflection, inertia, damping, rebound)
            for rebound in RESTITUTIONS for v in WIDTH_GRID
        )  # fmt: skip
        common = {"effect": cls.effect, "subsystem": "gear", "write": _write, "kind": cls,
                  "parameters": _parameters}  # fmt: skip
        return (
            Law(
                law="play",
                unknowns=(width, *held),
                starts=starts,
                richer=("play, wheel",),
                **common,
            ),
            Law(law="play, wheel", unknowns=(width, *wheel), starts=starts, grid=grid, **common),
        )

    @classmethod
    def sentence(cls, f: FigureText) -> str:
        """The width."""
        return f"backlash in the gear, {f('width_rad', 'rad')} at its output"
