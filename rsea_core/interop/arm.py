"""Arms: joints of this package on a chain of MuJoCo (MJCF or URDF), each at its own step.

    arm = Arm(mujoco.MjModel.from_xml_path("arm.xml"), {"shoulder": model, "elbow": model})
    ran = arm.run(lambda t, y: 0.02 * (wanted(t) - y.load_angle_rad), duration_s=2.0)
    ran.precise("elbow")   # the joint again, alone, by the engine that locates every event

MuJoCo moves the bodies; what lies between command and link (drive, gear with its friction, spring)
is the fixed-step engine with every effect that a model has. In a step of MuJoCo the load's angle
is predicted by its speed and last acceleration; the joint runs along it in shorter steps, and the
mean of its spring's torque (Simpson's rule) acts on the hinge. The chain has the links' inertia,
gravity, damping and contact; the rig's own load is not used.

`Arm.control` is the same as a callback for users of MuJoCo: `mujoco.set_mjcb_control(arm.control)`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rsea_core.engines.fixed_step.layout import (
    CURRENT,
    GEAR,
    GEAR_SPEED,
    LINK,
    LOAD,
    LOAD_SPEED,
    OUTPUT,
)
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.errors import InputError, SimulationError
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.simulation.simulate import simulate
from rsea_core.simulation.trajectory import Trajectory

try:
    import mujoco
except ModuleNotFoundError as problem:
    raise ModuleNotFoundError(
        'mujoco is not installed: pip install "dftfs[interop]"', name=problem.name
    ) from problem

TORQUE = CHANNELS.index("torque_Nm")
IMPOSED = Load(kind="imposed")
SHARES = np.array([0.0, 0.5, 1.0])  # of a step, where the spring's torque is taken
SIMPSON = np.array([1.0, 4.0, 1.0]) / 6.0
MOST_STEPS = 10_000_000


@dataclass(frozen=True, kw_only=True)
class JointReadings:
    """What the joints show, (joints,) arrays in the order of the arm's names; exact values."""

    motor_angle_rad: NDArray
    motor_velocity_rad_per_s: NDArray
    load_angle_rad: NDArray
    load_velocity_rad_per_s: NDArray
    current_A: NDArray
    torque_Nm: NDArray


Command = Callable[[float, JointReadings], Any]
"""Time [s] and readings to a command for each joint."""


@dataclass(frozen=True, kw_only=True, repr=False)
class ArmRun(BriefRepr):
    """A run of an arm; arrays are read-only.

    Attributes
    ----------
    names : tuple of str
    models : tuple of ActuatorModel
    command_name : str
    time_s : (n,) array
    motor_angle_rad, load_angle_rad, load_velocity_rad_per_s, current_A, torque_Nm, command
        (n, joints) arrays; torque of the spring at the row, command held from it to the next.
    work_J : (n, joints) array
        What each spring has given to the chain since the start.
    chain_J : (n,) array
        Kinetic and potential energy of the chain by MuJoCo.
    """

    names: tuple[str, ...]
    models: tuple[ActuatorModel, ...]
    command_name: str
    time_s: NDArray
    motor_angle_rad: NDArray
    load_angle_rad: NDArray
    load_velocity_rad_per_s: NDArray
    current_A: NDArray
    torque_Nm: NDArray
    command: NDArray
    work_J: NDArray
    chain_J: NDArray

    def precise(self, name: str) -> Trajectory:
        """A joint alone, by the event-driven engine, along the load's motion of this run.

        Its `torque_Nm` shows what the exchange with MuJoCo costs, its `energy` where the joint's
        energy went: `load_work_J` is what the chain has given to the joint.

        Raises
        ------
        InputError
            If there is no such joint.
        """
        if name not in self.names:
            raise InputError(f"no joint {name!r}; the arm has {', '.join(self.names)}")
        j = self.names.index(name)
        inputs = Inputs(
            time_s=self.time_s, load=IMPOSED, load_angle_rad=self.load_angle_rad[:, j],
            initial_motor_angle_rad=float(self.motor_angle_rad[0, j]),
            **{self.command_name: self.command[:, j]},
        )  # fmt: skip
        return simulate(self.models[j], inputs, engine="event-driven")

    def lost_in_chain_J(self) -> NDArray:
        """(n,) array: what damping, friction and contact of the chain have taken.

        Given by the springs less growth of the chain's own energy. Without such losses it is the
        error of MuJoCo's integrator and zero as its step vanishes.
        """
        return self.work_J.sum(axis=1) - (self.chain_J - self.chain_J[0])


class Arm:
    """Joints of this package on a model of MuJoCo.

    Parameters
    ----------
    chain : mujoco.MjModel
        Of an MJCF or URDF file; joints that are named move as hinges, without an actuator.
    joints : mapping of str to ActuatorModel
        Names of hinges to what drives them, all by the same kind of command.
    command : callable or None
        For `control`; `run` takes its own.
    command_name : str
        "duty", "voltage_V", "current_command_A" or "motor_torque_Nm".
    step_s : float or None
        Longest step of the joints; None: what the engine takes.

    Raises
    ------
    InputError
        If a name is no hinge of the chain, or the joints cannot be run.
    """

    def __init__(
        self,
        chain: "mujoco.MjModel",
        joints: Mapping[str, ActuatorModel],
        command: Command | None = None,
        *,
        command_name: str = "duty",
        step_s: float | None = None,
    ):
        if not joints:
            raise InputError("an arm needs a joint")
        self.names, self.models = tuple(joints), tuple(joints.values())
        self.chain, self.command_name, self._command = chain, command_name, command
        if command is not None and chain.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4:
            raise InputError("a callback needs an integrator with one stage, not RK4: use run")
        self._q, self._v = _places(chain, self.names)
        self._step_s = chain.opt.timestep
        self._times = SHARES * self._step_s
        self._replay = Replay(
            time_s=self._times, command_name=command_name, command=np.zeros(SHARES.size),
            load=IMPOSED, load_angle_rad=np.zeros(SHARES.size), step_s=step_s,
        )  # fmt: skip
        self._columns = self._replay.columns
        self._numbers = [self._replay.numbers(model) for model in self.models]
        self._gear = np.array([model.rig.gear_ratio for model in self.models])
        self._next_s = -np.inf

    def start(self, data: "mujoco.MjData") -> None:
        """Put the joints at rest at the chain's angles, without torque in linear springs."""
        self._state = self._replay.start_states(self._numbers)
        self._state[:, LOAD] = self._state[:, GEAR] = data.qpos[self._q]
        self._state[:, OUTPUT] = self._state[:, LINK] = data.qpos[self._q]
        self._state[:, LOAD_SPEED] = data.qvel[self._v]
        self._torque = np.zeros(len(self.names))
        self._is_first = True  # the chain's accelerations are not known yet

    def read(self, data: "mujoco.MjData") -> JointReadings:
        """What the joints show now."""
        return JointReadings(
            motor_angle_rad=self._gear * self._state[:, GEAR],
            motor_velocity_rad_per_s=self._gear * self._state[:, GEAR_SPEED],
            load_angle_rad=data.qpos[self._q].copy(),
            load_velocity_rad_per_s=data.qvel[self._v].copy(),
            current_A=self._state[:, CURRENT].copy(),
            torque_Nm=self._torque.copy(),
        )

    def advance(self, data: "mujoco.MjData", command: NDArray) -> NDArray:
        """Move the joints by a step; their mean torques act on the hinges and are returned.

        Raises
        ------
        SimulationError
            If a joint leaves the range of numbers.
        """
        s, mean = self._times, np.empty(len(self.names))
        angles, speeds = data.qpos[self._q], data.qvel[self._v]
        rates = np.zeros_like(speeds) if self._is_first else data.qacc[self._v]
        self._is_first = False
        for j, numbers in enumerate(self._numbers):
            self._replay.columns = self._columns._replace(
                command=np.full(SHARES.size, command[j]),
                load_angle=angles[j] + s * (speeds[j] + 0.5 * s * rates[j]),
                load_speed=speeds[j] + s * rates[j],
            )
            rows, states = self._replay.run(numbers, start=self._state[j], with_states=True)
            self._state[j], self._torque[j] = states[-1], rows[-1, TORQUE]
            mean[j] = SIMPSON @ rows[:, TORQUE]
        data.qfrc_applied[self._v] = mean
        return mean

    def control(self, chain: "mujoco.MjModel", data: "mujoco.MjData") -> None:
        """For `mujoco.set_mjcb_control`; starts anew where the time goes back."""
        if self._command is None:
            raise InputError("Arm(..., command=...) is needed for the callback")
        if data.time < self._next_s - 1.5 * self._step_s or not np.isfinite(self._next_s):
            self.start(data)
            self._next_s = data.time
        if data.time > self._next_s - 0.5 * self._step_s:
            self.advance(data, self._asked(data.time, data, self._command))
            self._next_s = data.time + self._step_s

    def run(
        self, command: Command, *, duration_s: float, data: "mujoco.MjData | None" = None
    ) -> ArmRun:
        """Run arm and chain together, from the chain's state.

        Parameters
        ----------
        data : mujoco.MjData or None
            Where the chain starts; None: as its file says.

        Raises
        ------
        InputError
            If the duration is no whole step, or a command is not finite.
        SimulationError
            If chain or joints leave the range of numbers.
        """
        steps = duration_s / self._step_s
        if not 1.0 <= steps <= MOST_STEPS:
            raise InputError(f"duration_s = {duration_s:g} must be 1 to {MOST_STEPS:g} steps")
        rows, count = round(steps) + 1, len(self.names)
        data = data or mujoco.MjData(self.chain)
        self.start(data)
        kept = {f: np.empty((rows, count)) for f in (*READ, "command", "work_J")}
        chain_J, work = np.empty(rows), np.zeros(count)
        for row in range(rows):
            now = self.read(data)
            asked = self._asked(row * self._step_s, data, command)
            for f in READ:
                kept[f][row] = getattr(now, f)
            kept["command"][row], kept["work_J"][row] = asked, work
            chain_J[row] = self._energy(data)
            if row + 1 == rows:
                break
            mean, before = self.advance(data, asked), data.qpos[self._q].copy()
            mujoco.mj_step(self.chain, data)
            work = work + mean * (data.qpos[self._q] - before)
            if not np.isfinite(work).all() or data.time == 0.0:  # MuJoCo resets what diverges
                raise SimulationError(f"the chain left the range of numbers in step {row}")
        arrays = {name: read_only(values) for name, values in kept.items()}
        return ArmRun(
            names=self.names, models=self.models, command_name=self.command_name,
            time_s=read_only(np.arange(rows) * self._step_s), chain_J=read_only(chain_J), **arrays,
        )  # fmt: skip

    def _energy(self, data: "mujoco.MjData") -> float:
        """Of the chain now; stages of an integrator leave that of another state."""
        mujoco.mj_fwdPosition(self.chain, data)
        mujoco.mj_energyPos(self.chain, data)
        mujoco.mj_energyVel(self.chain, data)
        return float(data.energy.sum())

    def _asked(self, time_s: float, data: "mujoco.MjData", command: Command) -> NDArray:
        asked = np.broadcast_to(np.asarray(command(time_s, self.read(data)), float), self._q.shape)
        if not np.isfinite(asked).all():
            raise InputError(f"the command at {time_s:.6g} s is not finite: {asked.tolist()}")
        return asked


READ = ("motor_angle_rad", "load_angle_rad", "load_velocity_rad_per_s", "current_A", "torque_Nm")


def _places(chain: "mujoco.MjModel", names: tuple[str, ...]) -> tuple[NDArray, NDArray]:
    """Where the hinges' angles and speeds stand in MuJoCo's arrays."""
    q, v = [], []
    for name in names:
        number = mujoco.mj_name2id(chain, mujoco.mjtObj.mjOBJ_JOINT, name)
        if number < 0 or chain.jnt_type[number] != mujoco.mjtJoint.mjJNT_HINGE:
            hinges = (chain.joint(i) for i in range(chain.njnt))
            known = ", ".join(j.name for j in hinges if j.type[0] == mujoco.mjtJoint.mjJNT_HINGE)
            raise InputError(f"no hinge {name!r} in the chain; it has {known or 'none'}")
        q.append(chain.jnt_qposadr[number])
        v.append(chain.jnt_dofadr[number])
    return np.array(q), np.array(v)
