"""Which machines the exact engine runs, and their numbers as its compiled code reads them.

A machine is linear between events where its spring is a chain of straight lines and friction is
Coulomb's, a worm's or a stop operator's; with backlash, Maxwell branches and slips, a spring's
damper, a flexible link, a nominal contact, the current limit, a dead zone, disturbances, delayed
commands, and any gravity of the load. What bends otherwise (Stribeck's fall, drag, heat, cogging,
a curved spring) is not: `obstacle` names it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.engines.event_driven.states as k
import rsea_core.engines.piecewise_linear.events as pe
import rsea_core.machine.plant as mp
from rsea_core.engines.piecewise_linear.modes import Machine
from rsea_core.errors import SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.machine.spring_table import ANCHOR, C0, C1, C2, UPPER
from rsea_core.model.actuator_model import ActuatorModel

LINEAR = frozenset(
    (
        "any", "internal_states",
        "wheel_dry", "gear_coulomb_forward", "gear_coulomb_backward", "gear_stribeck_velocity",
        "gear_stribeck_shape", "gear_drive_loss", "gear_backdrive_loss", "gear_presliding",
        "gear_viscous", "gear_offset",
        "load_dry", "load_coulomb", "load_stribeck_velocity", "load_presliding",
        "unbalance_torque", "unbalance_angle", "parallel_stiffness", "parallel_rest_angle",
        "pulse_torque", "pulse_start", "pulse_end", "pulse_rise",
        "dead_zone", "rounded_dead_zone", "command_delay",
        "backlash_width", "backlash_wheel_inertia", "backlash_wheel_damping", "backlash_rebound",
        "spring_damping", "link_stiffness", "link_inertia", "link_damping",
        *(f"slip_{what}_{i + 1}" for what in ("stiffness", "yield") for i in range(e.N_SLIPS)),
        *(f"branch_{what}_{i + 1}" for what in ("stiffness", "time") for i in range(e.N_BRANCHES)),
        *(f"knee_{i}" for i in range(1, 5)),
    )
)  # fmt: skip
"""The numbers of `layout.EFFECTS` that leave a machine linear between events."""


@dataclass(frozen=True, kw_only=True)
class LinearMachine:
    """A machine ready for the exact engine.

    Attributes
    ----------
    numbers : modes.Machine
    behind : (b,) int array
        Places in the state of what moves behind backlash or a link.
    timed : (4,) bool array
        Which times it can spend: current limit, contact, wheel and load held.
    """

    numbers: Machine
    behind: NDArray
    timed: NDArray

    @classmethod
    def of(cls, plant: mp.Plant, regions: NDArray, effects: NDArray) -> "LinearMachine":
        """The machine of a plant, a spring (r, 6) and its effects (N_EFFECTS,).

        Raises
        ------
        SimulationError
            If it is not linear between events; the message names what is not.
        """
        problem = obstacle_of(plant, regions, effects)
        if problem is not None:
            raise SimulationError(f"the exact engine cannot run this model: {problem}")
        plant, fx = _simplified(plant, effects)
        lines = _lines(regions)
        behind = [k.TB, k.WB] * bool(fx[e.BACKLASH]) + [k.TO, k.WO] * bool(fx[e.LINK_STIFFNESS])
        numbers = Machine(plant, lines, fx, _states(fx, behind), _events(plant, lines, fx))
        limited, touches = plant.current_limit < np.inf, plant.contact_angle < np.inf
        timed = [limited, touches, fx[e.WHEEL_DRY] != 0.0, fx[e.LOAD_DRY] != 0.0]
        return cls(numbers=numbers, behind=np.array(behind, np.int64), timed=np.array(timed))


def obstacle(model: ActuatorModel, load: Load, command_name: str | None = "duty") -> str | None:
    """What of a model the exact engine cannot run, None where it can.

    Raises
    ------
    RigError, TermError
        If the model cannot be simulated at all.
    """
    plant, effects = model.plant(command_name, load), model.effects(command_name, load)
    return obstacle_of(plant, model.spring_table(load).regions, effects)


def obstacle_of(plant: mp.Plant, regions: NDArray, effects: NDArray) -> str | None:
    """As `obstacle`, of a plant, its spring (r, 6) and its effects (N_EFFECTS,)."""
    if np.any(regions[:, C2:] != 0.0):
        return "its spring is no chain of straight lines"
    curved = [e.EFFECTS[i] for i in np.flatnonzero(effects) if e.EFFECTS[i] not in LINEAR]
    if curved:
        return f"it is not linear in {', '.join(curved)}"
    if plant.goal_dead_band != 0.0:
        return "its servo has a dead band"
    if plant.structure == mp.RIGID_HELD and plant.gravity != 0.0:
        return "wheel and load are one held body"
    worm = effects[[e.GEAR_DRIVE_LOSS, e.GEAR_BACKDRIVE_LOSS]]
    if plant.structure == mp.RIGID_FREE and np.any(worm):
        return "its worm carries a rigid load"
    return None


def require_done(status: int, time_s: float) -> None:
    """Raise what a run's status says, but for `run.NOT_HERE`.

    Raises
    ------
    SimulationError
        Unless the run is done.
    """
    if status == pe.TOO_MANY_EVENTS:
        raise SimulationError(
            f"more than {pe.MAX_EVENTS_PER_ROW} switches of current limit, contact, friction or"
            f" spring within the row at t = {time_s:.6g} s: shorten the rows or soften the contact"
        )
    if status != pe.DONE:
        raise SimulationError(
            f"the states left the range of numbers at t = {time_s:.6g} s: is the loop unstable,"
            " or a value out by orders of magnitude?"
        )


def _simplified(plant: mp.Plant, effects: NDArray) -> tuple[mp.Plant, NDArray]:
    """Plant and effects with one gravity, and without the knees, which are ends of regions."""
    fx = effects.copy()
    if fx[e.UNBALANCE] != 0.0:
        whole = plant.gravity * np.exp(1j * plant.gravity_offset)
        whole += fx[e.UNBALANCE] * np.exp(1j * fx[e.UNBALANCE_ANGLE])
        angle = float(np.angle(whole))
        plant = plant._replace(gravity=float(np.abs(whole)), gravity_offset=angle)
        fx[[e.UNBALANCE, e.UNBALANCE_ANGLE]] = 0.0
    fx[e.KNEE : e.KNEE + 4] = 0.0
    remember = [e.GEAR_PRESLIDING, e.LOAD_PRESLIDING, e.BACKLASH, e.SPRING_DAMPING]
    remember += [e.LINK_STIFFNESS, e.PULSE_RISE]
    remember += range(e.SLIP_YIELD, e.SLIP_YIELD + e.N_SLIPS)
    remember += range(e.BRANCH_STIFFNESS, e.BRANCH_STIFFNESS + e.N_BRANCHES)
    fx[e.INTERNAL_STATES] = float(np.any(fx[remember] != 0.0))
    return plant, fx


def _states(fx: NDArray, behind: list[int]) -> NDArray:
    """Places in y of what moves: the nominal five, what is behind, branches, a ramp, anchors.

    The anchor of a stop operator does not move between events, but torques are linear in it.
    """
    found = [k.IM, k.TW, k.WW, k.TL, k.WL, *behind]
    found += [k.BRANCH + i for i in range(e.N_BRANCHES) if fx[e.BRANCH_STIFFNESS + i] != 0.0]
    found += [k.RAMP] * bool(fx[e.PULSE_RISE])
    found += [k.ANCHOR + int(stop) for stop in np.flatnonzero(_yields(fx))]
    return np.array(found, np.int64)


def _yields(fx: NDArray) -> NDArray:
    """Yield deflections [rad] of the stop operators, as `internal_states.stop_yield`."""
    slips = fx[e.SLIP_YIELD : e.SLIP_YIELD + e.N_SLIPS]
    return np.append(slips, fx[[e.GEAR_PRESLIDING, e.LOAD_PRESLIDING]])


def _events(plant: mp.Plant, lines: NDArray, fx: NDArray) -> NDArray:
    """The switches that a machine has; a disturbance's edges are times at which rows are cut."""
    levels_differ = fx[e.GEAR_FORWARD] != fx[e.GEAR_BACKWARD]
    limited = plant.current_limit < np.inf and plant.drive in (mp.DUTY, mp.VOLTAGE, mp.POSITION)
    worm = fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0
    regions = len(lines) > 1 and plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
    has = {
        k.CURRENT_SWITCH: limited,
        k.CONTACT_SWITCH: plant.contact_angle < np.inf,
        k.WHEEL_SWITCH: fx[e.WHEEL_DRY] != 0.0,
        k.LOAD_SWITCH: fx[e.LOAD_DRY] != 0.0,
        k.TORQUE_SWITCH: worm,
        k.FLANK_SWITCH: fx[e.BACKLASH] != 0.0,
        **{k.STOP_SWITCH + i: limit > 0.0 for i, limit in enumerate(_yields(fx))},
        k.SIDE_SWITCH: fx[e.GEAR_PRESLIDING] > 0.0 and levels_differ,
        k.RISEN_SWITCH: fx[e.PULSE_RISE] > 0.0,
        pe.UPPER_SWITCH: regions,
        pe.LOWER_SWITCH: regions,
    }
    return np.array([switch for switch, there in has.items() if there], np.int64)


def _lines(regions: NDArray) -> NDArray:
    """The regions with neighbours of one line merged."""
    kept = [regions[0]]
    for region in regions[1:]:
        last = kept[-1]
        at_anchor = last[C0] + last[C1] * (region[ANCHOR] - last[ANCHOR])
        scale = abs(region[C0]) + abs(region[C1]) * 1e-3
        if region[C1] == last[C1] and abs(at_anchor - region[C0]) <= 1e-12 * scale:
            kept[-1] = np.concatenate(([region[UPPER]], last[ANCHOR:]))
        else:
            kept.append(region)
    return np.array(kept)  # not read-only: one type with `modes._read_system`'s, one compilation
