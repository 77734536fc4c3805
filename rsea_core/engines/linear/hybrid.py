"""A machine that is linear between events, as matrices: what moves in a mode, and what ends it.

    z' = M z,   z = (current, wheel angle, wheel speed, load angle, load speed, 1, command)

A mode ends where one of its guards, linear in z, falls below zero. Both are plain matrices, so that
their derivatives by a parameter are differences of two of them: what exact sensitivities need.
Carried are winding and current limit, Coulomb friction of gear and load, a spring of straight
lines, a contact, a free or a held load without gravity.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k
import rsea_core.machine.plant as mp
from rsea_core.engines.linear.linearise import linear_plant
from rsea_core.errors import SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import ANCHOR, C0, C1, C2, UPPER
from rsea_core.model.actuator_model import ActuatorModel

ONE, COMMAND, SIZE = k.N_STATES, k.N_STATES + 1, k.N_STATES + 2
CARRIED = frozenset(
    ("any", "wheel_dry", "gear_coulomb_forward", "gear_coulomb_backward", "gear_stribeck_velocity",
     "gear_stribeck_shape", "load_dry", "load_coulomb", "load_stribeck_velocity")
)  # fmt: skip


class Mode(NamedTuple):
    """Direction of sliding of wheel and load (0 sticks or has no dry friction), and the rest."""

    wheel: int
    load: int
    limited: int  # side of the current limit, 0 off it
    contact: bool
    region: int  # of the spring


class HybridMachine:
    """The matrices of a model for one command and load.

    Raises
    ------
    SimulationError
        If the model has what these matrices cannot carry; the message names it.
    RigError, TermError
        If the model cannot be simulated.
    """

    def __init__(self, model: ActuatorModel, command_name: str, load: Load):
        self.plant = model.plant(command_name, load)
        self.fx = model.effects(command_name, load)
        self.regions = model.spring_table(load).regions
        if not np.any(self.regions[:, C2:]) and np.ptp(self.regions[:, C1]) == 0.0:
            self.regions = self.regions[-1:]  # one line, continuous
        problem = self._obstacle()
        if problem is not None:
            raise SimulationError(f"no exact sensitivities: {problem}")

    def _obstacle(self) -> str | None:
        plant, fx = self.plant, self.fx
        others = [e.EFFECTS[i] for i in np.flatnonzero(fx) if e.EFFECTS[i] not in CARRIED]
        if others:
            return f"the machine has {', '.join(others)}"
        if plant.structure not in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
            return "wheel and load are one body"
        if plant.gravity != 0.0:
            return "gravity is not linear in the load's angle"
        if plant.drive not in (mp.DUTY, mp.VOLTAGE, mp.MOTOR_TORQUE):
            return "the command must be a duty, a voltage or a motor torque"
        if np.any(self.regions[:, C2:] != 0.0):
            return "the spring is no chain of straight lines"
        limited = np.isfinite(plant.current_limit) and plant.drive != mp.MOTOR_TORQUE
        if limited and plant.inductance == 0.0:
            return "a current limit needs terminal_inductance_H above 0"
        return None

    def torque_row(self, region: int) -> NDArray:
        """tau_s = row z."""
        row, line = np.zeros(SIZE), self.regions[region]
        row[k.TW], row[k.TL] = line[C1], -line[C1]
        row[ONE] = line[C0] - line[C1] * line[ANCHOR]
        return row

    def forces(self, mode: Mode) -> tuple[NDArray, NDArray, NDArray]:
        """Rows of the current's rate and, without dry friction, of the torques on wheel, load."""
        plant, line = self.plant, self.regions[mode.region]
        linear = linear_plant(
            plant, tangent=float(line[C1]), gravity_stiffness=0.0, in_contact=mode.contact
        )
        whole = np.zeros((k.N_STATES, SIZE))
        whole[:, : k.N_STATES], whole[:, COMMAND] = linear.A, linear.b
        offset = line[C0] - line[C1] * line[ANCHOR]
        wheel = whole[k.WW] * plant.inertia
        wheel[ONE] -= offset
        load = whole[k.WL] * (plant.load_inertia if self.is_free else 0.0)
        load[ONE] += offset + plant.load_torque
        if mode.contact:
            load[ONE] += plant.contact_stiffness * plant.contact_angle
        return whole[k.IM], wheel, load

    def matrix(self, mode: Mode) -> NDArray:
        """M (SIZE, SIZE) of a mode."""
        current, wheel, load = self.forces(mode)
        M = np.zeros((SIZE, SIZE))
        M[k.IM] = 0.0 if mode.limited else current
        if not (self.wheel_dry and mode.wheel == 0):
            M[k.TW, k.WW] = 1.0
            M[k.WW] = wheel / self.plant.inertia
            M[k.WW, ONE] -= mode.wheel * self.level(mode.wheel) / self.plant.inertia
        if self.is_free and not (self.load_dry and mode.load == 0):
            M[k.TL, k.WL] = 1.0
            M[k.WL] = load / self.plant.load_inertia
            M[k.WL, ONE] -= mode.load * self.fx[e.LOAD_COULOMB] / self.plant.load_inertia
        return M

    def guards(self, mode: Mode) -> dict[str, NDArray]:
        """Rows g by name: the mode ends where g z falls below zero."""
        current, wheel, load = self.forces(mode)
        found = {}

        def row(*entries: tuple[int, float]) -> NDArray:
            made = np.zeros(SIZE)
            for place, value in entries:
                made[place] = value
            return made

        if self.wheel_dry and mode.wheel:
            found["wheel stops"] = row((k.WW, mode.wheel))
        elif self.wheel_dry:
            found["wheel forward"] = row((ONE, self.level(1))) - wheel
            found["wheel backward"] = row((ONE, self.level(-1))) + wheel
        if self.load_dry and mode.load:
            found["load stops"] = row((k.WL, mode.load))
        elif self.load_dry:
            level = self.fx[e.LOAD_COULOMB]
            found["load forward"] = row((ONE, level)) - load
            found["load backward"] = row((ONE, level)) + load
        limit = self.plant.current_limit
        if np.isfinite(limit) and self.plant.drive != mp.MOTOR_TORQUE:
            if mode.limited:
                found["current falls"] = mode.limited * current
            else:
                found["current limit"] = row((ONE, limit), (k.IM, -1.0))
                found["current limit, negative"] = row((ONE, limit), (k.IM, 1.0))
        if np.isfinite(self.plant.contact_angle) and self.is_free:
            side = 1.0 if mode.contact else -1.0
            found["contact"] = row((k.TL, side), (ONE, -side * self.plant.contact_angle))
        if mode.region < len(self.regions) - 1:
            upper = float(self.regions[mode.region, UPPER])
            found["spring upper"] = row((ONE, upper), (k.TW, -1.0), (k.TL, 1.0))
        if mode.region > 0:
            lower = float(self.regions[mode.region - 1, UPPER])
            found["spring lower"] = row((ONE, -lower), (k.TW, 1.0), (k.TL, -1.0))
        return found

    def after(self, mode: Mode, event: str, z: NDArray) -> Mode:
        """The mode that follows an event at z."""
        if event.startswith("wheel"):
            return mode._replace(wheel=self._sliding(self.forces(mode)[1] @ z, self.level))
        if event.startswith("load"):
            torque = self.forces(mode)[2] @ z
            return mode._replace(load=self._sliding(torque, lambda _: self.fx[e.LOAD_COULOMB]))
        if event == "current falls":
            return mode._replace(limited=0)
        if event.startswith("current limit"):
            return mode._replace(limited=1 if z[k.IM] > 0.0 else -1)
        if event == "contact":
            return mode._replace(contact=not mode.contact)
        return mode._replace(region=mode.region + (1 if event == "spring upper" else -1))

    @staticmethod
    def _sliding(torque: float, level) -> int:
        side = 1 if torque > 0.0 else -1
        return side if abs(torque) >= level(side) * (1.0 - 1e-12) else 0

    def level(self, side: int) -> float:
        """Coulomb level of the gear [Nm] against motion to a side."""
        return float(self.fx[e.GEAR_FORWARD if side > 0 else e.GEAR_BACKWARD])

    @property
    def wheel_dry(self) -> bool:
        """Whether the wheel can stick."""
        return bool(self.fx[e.WHEEL_DRY] != 0.0)

    @property
    def load_dry(self) -> bool:
        """Whether the load can stick."""
        return bool(self.fx[e.LOAD_DRY] != 0.0) and self.is_free

    @property
    def is_free(self) -> bool:
        """Whether the load moves."""
        return self.plant.structure == mp.ELASTIC_FREE

    def start(self, z: NDArray) -> Mode:
        """The mode at rest, before its guards are looked at."""
        deflection = z[k.TW] - z[k.TL]
        region = int(np.searchsorted(self.regions[:-1, UPPER], deflection, side="right"))
        contact = bool(z[k.TL] > self.plant.contact_angle) and self.is_free
        return Mode(0, 0, 0, contact, region)
