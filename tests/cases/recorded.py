"""Cases on disk from the fixed-step engine, for tests of a diagnosis: a carriage, a speed map."""

from pathlib import Path

import numpy as np

import rsea_core.effects.layout as e
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case, read_case

CARRIAGE = {
    "name": "carriage", "torque_constant_Nm_per_A": 30.0, "current_limit_A": 10.0,
    "gear_ratio": 1.0, "motor_inertia_kgm2": 0.0, "output_inertia_kgm2": 0.0,
    "load_inertia_kgm2": 80.0, "load_viscous_Nms_per_rad": 150.0,
}  # fmt: skip


def write_rig(folder: Path, values: dict, parts: list[str], tables: list[dict]) -> None:
    """A rig.toml."""
    lines = ["[rig]", f"parts = {parts}", 'axis = "rotary"']
    lines += [f"{k} = {v!r}".replace("'", '"') for k, v in values.items()]
    for table in tables:
        lines += ["", "[[recording]]"]
        lines += [f"{k} = {str(v).lower() if isinstance(v, bool) else repr(v)}".replace("'", '"')
                  for k, v in table.items()]  # fmt: skip
    (folder / "rig.toml").write_text("\n".join(lines) + "\n")


def carriage_case(
    folder: Path,
    *,
    seconds: float = 12.0,
    row_s: float = 4e-3,
    offset: float = 0.0,
    noise: float = 2e-6,
    fx: dict[int, float] | None = None,
) -> Case:
    """A free mass under a force, back and forth; `offset` is a force that no rig file knows."""
    rng = np.random.default_rng(3)
    t = np.arange(0.0, seconds, row_s)
    force = np.where(np.sin(2 * np.pi * 0.4 * t) > 0.0, 1.0, -1.0) * (2.0 + 0.6 * np.sin(1.7 * t))
    parts = ("drive", "gear", "load")
    rig = Rig(parts=parts, **CARRIAGE)
    true = force + offset / CARRIAGE["torque_constant_Nm_per_A"]
    replay = Replay(
        time_s=t, command_name="current_command_A", command=true, load=Load(kind="free"),
        step_s=1e-3,
    )  # fmt: skip
    numbers = replay.numbers(ActuatorModel(rig))
    written = numbers.fx.copy()
    for index, value in (fx or {}).items():
        written[[e.ANY, index]] = 1.0, value
    angle = replay.run(numbers._replace(fx=written))[:, CHANNELS.index("load_angle_rad")]
    angle = angle + noise * rng.standard_normal(t.size)
    rows = np.stack([t, force, angle], axis=1)
    header = "time_s,current_command_A,load_angle_rad"
    np.savetxt(folder / "run.csv", rows, delimiter=",", header=header, comments="", fmt="%.9f")
    write_rig(
        folder, CARRIAGE, list(parts),
        [{"file": "run.csv", "role": "identification", "load": "free", "description": "run"}],
    )  # fmt: skip
    return read_case(folder)


WORM = {"name": "worm", "torque_constant_Nm_per_A": 0.02, "gear_ratio": 50.0}


def map_case(
    folder: Path,
    friction,
    *,
    loads: tuple[float, ...] = (0.05,),
    speeds: np.ndarray | None = None,
    noise: float = 1e-5,
) -> Case:
    """Steady speeds, each a recording; `friction(speed, load)` on the motor's side.

    load is the torque through the gear, positive against positive motion.
    """
    rng = np.random.default_rng(5)
    one_direction = np.geomspace(0.5, 40.0, 12)
    speeds = np.concatenate([-one_direction[::-1], one_direction]) if speeds is None else speeds
    tables = []
    for weight in loads:
        for j, w in enumerate(speeds):
            load = -weight / WORM["gear_ratio"]
            torque = load + friction(w, load) + noise * rng.standard_normal(80)
            name = f"w{weight:g}_{j:02d}.csv"
            rows = np.stack([0.01 * np.arange(80.0), np.full(80, w), torque], axis=1)
            np.savetxt(
                folder / name, rows, delimiter=",", comments="", fmt="%.10g",
                header="time_s,motor_velocity_rad_per_s,motor_torque_Nm",
            )  # fmt: skip
            role = "validation" if j % 4 == 1 else "identification"
            tables.append({"file": name, "role": role, "load": "constant-torque",
                           "load_torque_Nm": weight, "quasi_static": True,
                           "description": "steady"})  # fmt: skip
    write_rig(folder, WORM, ["drive", "gear", "load"], tables)
    return read_case(folder)
