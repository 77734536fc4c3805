"""Recordings of machines without a spring: an axis and a pendulum, in any unit."""

from dataclasses import dataclass

import numpy as np

from rsea_core.effects.registry import DriveDelay, DriveOffset
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.machine.command_motion import between_rows
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

COUNTS = 4096
ROW_s = 0.01


@dataclass(frozen=True, kw_only=True)
class Units:
    """By what torques and times of a machine are multiplied."""

    torque: float = 1.0
    time: float = 1.0

    @property
    def inertia(self) -> float:
        """Torque times time squared."""
        return self.torque * self.time**2

    @property
    def damping(self) -> float:
        """Torque times time."""
        return self.torque * self.time


def axis_rig(units: Units = Units(), *, off: float = 1.0, counts: int = COUNTS) -> Rig:
    """A direct drive with a regulated current that turns a wheel.

    Parameters
    ----------
    off : float
        Factor of the load's inertia, for a rig file that is wrong by it.
    counts : int
        Of the encoder, in a turn.
    """
    return Rig(
        name="axis",
        parts=("drive", "gear", "load"),
        torque_constant_Nm_per_A=0.5 * units.torque,
        current_limit_A=8.0,
        motor_inertia_kgm2=0.002 * units.inertia,
        gear_ratio=1.0,
        load_inertia_kgm2=0.02 * units.inertia * off,
        load_viscous_Nms_per_rad=0.02 * units.damping,
        motor_encoder_counts_per_rev=counts,
    )


def axis_recording(
    *terms, seed: int, units: Units = Units(), offset_A: float = 0.0, delay_rows: float = 0.0,
    linear: bool = False, role: str = "identification", uneven: float = 0.0,
    rig: Rig | None = None, two_levels: bool = False, drift_A_per_s: float = 0.0,
) -> Recording:  # fmt: skip
    """Twelve seconds of an axis (in the unit of time) that is driven to and fro, read by counts.

    Parameters
    ----------
    uneven : float
        Standard deviation, in rows, of the times of readings about those of the commands.
    rig : Rig or None
        Of the machine; None: `axis_rig`.
    two_levels : bool
        One size of the command, of both signs, after a second of zero.
    drift_A_per_s : float
        Drift of the amplifier's offset per second of bench units; the log does not show it.
    """
    rng = np.random.default_rng(seed)
    n = 1200
    time = ROW_s * units.time * np.arange(n)
    tau = ROW_s * np.arange(n)
    current = sum(
        1.2 * np.sin(2.0 * np.pi * f * tau + rng.uniform(0.0, 6.0)) for f in (0.31, 0.83, 1.9)
    )
    if two_levels:
        current = np.where(tau < 1.0, 0.0, 1.5 * np.sign(current))
    own = [*terms]
    if offset_A:
        own.append(DriveOffset(offset=offset_A))
    if delay_rows:
        own.append(DriveDelay(delay_s=delay_rows * ROW_s * units.time))
    acting = current + drift_A_per_s * tau
    inputs = Inputs(time_s=time, current_command_A=acting, load=Load(kind="free"))
    finer = 1
    if linear:
        finer = 3
        inputs, _ = between_rows(inputs, {}, finer)
    if uneven:
        finer = 20
        fine = ROW_s * units.time * np.arange((n - 1) * finer + 1) / finer
        held = np.append(np.repeat(current[:-1], finer), current[-1])
        inputs = Inputs(time_s=fine, current_command_A=held, load=Load(kind="free"))
    model = ActuatorModel(rig or axis_rig(units), tuple(own))
    angle = Replay.of(inputs, step_s=2e-3 * units.time).run(model)[:, 0]
    if uneven:
        late = np.clip(uneven * rng.standard_normal(n), -0.4, 0.4)
        late[0] = 0.0
        time = time + late * ROW_s * units.time
        angle = np.interp(time, inputs.time_s, angle)
    else:
        angle = angle[::finer]
    count = 2.0 * np.pi / COUNTS
    read = count * np.floor(angle / count + rng.uniform())
    columns = {"time_s": time, "current_command_A": current, "motor_angle_rad": read}
    return Recording(
        file=f"axis{seed}.csv", role=role, load=Load(kind="free"), columns=columns,
        sample_time_s=ROW_s * units.time,
    )  # fmt: skip


def axis_case(folder, *recordings: Recording, rig: Rig) -> Case:
    """A case of an axis."""
    return Case(name="axis", folder=folder, rig=rig, recordings=recordings)


def pendulum_case(
    folder, *terms, seed: int, start_rad: float = 2.0, row_s: float = ROW_s, counts: int = COUNTS
) -> Case:
    """A bare pendulum let go once: one recording of twenty seconds."""
    rig = Rig(
        name="pendulum",
        parts=("load",),
        load_inertia_kgm2=0.01,
        load_mass_kg=0.2,
        load_distance_m=0.15,
        gravity_angle_offset_rad=0.0,
        load_encoder_counts_per_rev=counts,
    )
    time = row_s * np.arange(round(20.0 / row_s))
    inputs = Inputs(time_s=time, load=Load(kind="pendulum"), initial_load_angle_rad=start_rad,
                    initial_motor_angle_rad=start_rad)  # fmt: skip
    angle = Replay.of(inputs, step_s=1e-3).run(ActuatorModel(rig, terms))[:, 1]
    count = 2.0 * np.pi / counts
    read = count * np.round(angle / count)
    r = Recording(
        file="release.csv", load=Load(kind="pendulum"), sample_time_s=row_s,
        columns={"time_s": time, "load_angle_rad": read},
    )  # fmt: skip
    return Case(name="pendulum", folder=folder, rig=rig, recordings=(r,))
