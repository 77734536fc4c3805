"""One recording of a bench written as the loggers of other laboratories write it.

Each dialect takes a folder and the columns of a recording in SI and returns the files, the options
of `dftfs import` that a user has to give, and what has to come back. The bench drives a motor by
its duty; dialects of servos take the load's angle as the goal and a later one as the position.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

DEG = 180.0 / np.pi
Columns = Mapping[str, NDArray]
SERVO_RIG = """[rig]
name = "servo"
parts = ["drive", "load"]
servo = "angle"
servo_proportional_Nm_per_rad = 20.0
load_inertia_kgm2 = 0.03
load_encoder_counts_per_rev = 4096
"""
BENCH = {
    "pwm": ("duty", 1.0), "theta_m": ("motor_angle_rad", 1.0), "theta_l": ("load_angle_rad", 1.0),
    "iq": ("current_A", 1.0), "loadcell": ("torque_Nm", 1.0),
}  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class ForeignLog:
    """A log as written.

    Attributes
    ----------
    paths : tuple of Path
    options : tuple of str
        Of `dftfs import`, besides the rig.
    truth : mapping of column of the contract to (n,) array
        In SI, of the first recording.
    recordings : int
    is_servo : bool
        The rig is `SERVO_RIG`.
    """

    paths: tuple[Path, ...]
    options: tuple[str, ...] = ()
    truth: Columns = field(default_factory=dict)
    recordings: int = 1
    is_servo: bool = False


def table(c: Columns) -> dict[str, NDArray]:
    """The bench's columns by a logger's names, time first."""
    named = {name: c[own] / factor for name, (own, factor) in BENCH.items() if own in c}
    return {"time": c["time_s"], **named}


def truth_of(c: Columns, rows: slice = slice(None)) -> dict[str, NDArray]:
    return {own: c[own][rows] for own, _ in BENCH.values() if own in c}


def write_csv(path: Path, columns: Mapping[str, NDArray | list], *, head: str = "") -> Path:
    """Rows of text; NaN is an empty cell."""
    cells = [
        ["" if isinstance(v, float) and np.isnan(v) else f"{v:.17g}" if isinstance(v, float) else
         str(v) for v in (a.tolist() if isinstance(a, np.ndarray) else a)]
        for a in columns.values()
    ]  # fmt: skip
    lines = [",".join(columns), *([head] if head else []), *map(",".join, zip(*cells, strict=True))]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def odrive(folder: Path, c: Columns) -> ForeignLog:
    """Turns, turns/s, amperes, seconds of the day's epoch."""
    turns = c["motor_angle_rad"] / (2.0 * np.pi)
    speed = np.convolve(np.gradient(turns, c["time_s"]), np.ones(9) / 9, mode="same")
    columns = {
        "timestamp": 1.7e9 + c["time_s"], "motor pos_estimate": turns,
        "motor vel_estimate": speed, "Iq_measured": c["current_A"],
        "duty": c["duty"], "vbus_voltage": np.full(turns.size, 48.0),
    }  # fmt: skip
    truth = {n: c[n] for n in ("motor_angle_rad", "current_A", "duty")}
    return ForeignLog(paths=(write_csv(folder / "odrive.csv", columns),), truth=truth)


def moteus(folder: Path, c: Columns) -> ForeignLog:
    """Revolutions, and a torque that the drive computes from its current."""
    turns = c["motor_angle_rad"] / (2.0 * np.pi)
    columns = {
        "time": c["time_s"], "motor_position": turns,
        "motor_velocity": np.gradient(turns, c["time_s"]), "q_current": c["current_A"],
        "torque": 0.3 * c["current_A"], "link_position": c["load_angle_rad"] / (2.0 * np.pi),
        "voltage_command": 48.0 * c["duty"],
    }  # fmt: skip
    truth = {n: c[n] for n in ("motor_angle_rad", "current_A", "load_angle_rad")}
    return ForeignLog(paths=(write_csv(folder / "moteus.csv", columns),), truth=truth)


def _servo(c: Columns) -> tuple[NDArray, NDArray, NDArray]:
    time, goal = c["time_s"], c["load_angle_rad"]
    return time, goal, np.interp(time - 0.02, time, 0.95 * goal)


def dynamixel(folder: Path, c: Columns) -> ForeignLog:
    """Ticks, a velocity in its own unit of 0.229 rpm, milliseconds."""
    time, goal, angle = _servo(c)
    ticks = [np.round(v * 4096 / (2 * np.pi)) for v in (goal, angle)]
    speed = np.round(np.gradient(angle, time) * 30.0 / np.pi / 0.229)
    columns = {
        "Time(ms)": 1e3 * time, "Goal Position": ticks[0], "Present Position": ticks[1],
        "Present Velocity": speed, "Present PWM": np.round(300.0 * np.sin(time)),
    }  # fmt: skip
    truth = {"position_command_rad": goal, "load_angle_rad": angle}
    return ForeignLog(paths=(write_csv(folder / "dxl.csv", columns),), truth=truth, is_servo=True)


def lerobot(folder: Path, c: Columns) -> ForeignLog:
    """A data set: list cells, joints by the names of its description, degrees."""
    import pyarrow as arrow
    from pyarrow import parquet

    time, goal, angle = _servo(c)
    root = folder / "lerobot"
    (root / "meta").mkdir(parents=True)
    (root / "data" / "chunk-000").mkdir(parents=True)
    names = {"names": ["shoulder.pos", "elbow.pos"]}
    features = {"action": names, "observation.state": names, "timestamp": {"names": None}}
    (root / "meta" / "info.json").write_text(json.dumps({"features": features}))
    cells = {
        "action": np.stack([np.sin(time), DEG * goal], axis=1).tolist(),
        "observation.state": np.stack([np.cos(time), DEG * angle], axis=1).tolist(),
        "timestamp": time, "frame_index": np.arange(time.size),
    }  # fmt: skip
    parquet.write_table(arrow.table(cells), root / "data" / "chunk-000" / "episode_000000.parquet")
    truth = {"position_command_rad": goal, "load_angle_rad": angle}
    return ForeignLog(paths=(root,), options=("--joint", "elbow"), truth=truth, is_servo=True)


def joint_states(folder: Path, c: Columns) -> ForeignLog:
    """A ROS 2 bag: JointState of two joints, goals on a topic of half the rate."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    time, goal, angle = _servo(c)
    time = np.round(time, 6)
    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = ("sensor_msgs/msg/JointState", "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
    state, header, stamp = (store.types[k] for k in kinds)
    path = folder / "bag"
    with Writer(path, version=9) as writer:
        topics = {t: writer.add_connection(t, state.__msgtype__, typestore=store)
                  for t in ("/joint_states", "/joint_commands")}  # fmt: skip
        for k, t in enumerate(time):
            at = round(1e9 * (t + 100.0))
            for topic, own in (("/joint_states", angle), ("/joint_commands", goal)):
                if topic == "/joint_commands" and k % 2:
                    continue
                own_stamp = stamp(sec=at // 10**9, nanosec=at % 10**9)
                message = state(
                    header=header(stamp=own_stamp, frame_id=""), name=["wrist", "elbow"],
                    position=np.array([0.1, own[k]]), velocity=np.zeros(2), effort=np.zeros(2),
                )  # fmt: skip
                writer.write(topics[topic], at, store.serialize_cdr(message, state.__msgtype__))
    both = 2 * ((time.size - 1) // 2) + 1  # rows up to the last goal
    truth = {"load_angle_rad": angle[:both]}
    return ForeignLog(paths=(path,), options=("--joint", "elbow"), truth=truth, is_servo=True)


def dates(folder: Path, c: Columns) -> ForeignLog:
    """Times of day as text."""
    start = np.datetime64("2024-05-01T12:00:00", "ns")
    stamps = [str(start + np.timedelta64(round(1e9 * t), "ns")).replace("T", " ")
              for t in c["time_s"]]  # fmt: skip
    columns = {**table(c), "time": stamps}
    return ForeignLog(paths=(write_csv(folder / "dates.csv", columns),), truth=truth_of(c))


def simulink(folder: Path, c: Columns) -> ForeignLog:
    """`To Workspace` blocks as structures with time, and a scope with labelled signals."""
    from scipy.io import savemat

    own = table(c)
    time = own.pop("time")
    blocks = {n: {"time": time, "signals": {"values": v, "dimensions": 1.0, "label": n}}
              for n, v in own.items()}  # fmt: skip
    path = folder / "simulink.mat"
    savemat(path, {"log": blocks})
    return ForeignLog(paths=(path,), truth=truth_of(c))


def dspace(folder: Path, c: Columns) -> ForeignLog:
    """ControlDesk: `X.Data` is the time, `Y(k).Name` and `Y(k).Data` the signals, in degrees."""
    from scipy.io import savemat

    own = table(c)
    time = own.pop("time")
    kind = [("Name", object), ("Data", object)]
    signals = np.zeros(len(own), dtype=kind)
    for k, (name, values) in enumerate(own.items()):
        signals[k] = (name, DEG * values if name.startswith("theta") else values)
    path = folder / "dspace.mat"
    savemat(path, {"rec1": {"X": {"Name": "time", "Data": time}, "Y": signals}})
    return ForeignLog(paths=(path,), truth=truth_of(c))


def tdms_groups(folder: Path, c: Columns) -> ForeignLog:
    """Two groups of different rates, with increments and units in properties."""
    from nptdms import ChannelObject, TdmsWriter

    own = table(c)
    step = float(c["time_s"][1] - c["time_s"][0])
    path = folder / "log.tdms"
    with TdmsWriter(path) as writer:
        units = {"pwm": "", "theta_m": "rad", "iq": "A", "theta_l": "rad"}
        fast = [ChannelObject("Drive", n, own[n], {"wf_increment": step, "unit_string": unit})
                for n, unit in units.items()]  # fmt: skip
        slow = [ChannelObject("Cell", "loadcell", own["loadcell"][::4],
                              {"wf_increment": 4 * step, "unit_string": "Nm"})]  # fmt: skip
        writer.write_segment(fast + slow)
    rows = (c["time_s"].size - 1) // 4 * 4 + 1
    truth = {n: c[n][:rows] for n in ("duty", "motor_angle_rad", "load_angle_rad", "current_A")}
    return ForeignLog(paths=(path,), truth=truth)


def written_twice(folder: Path, c: Columns) -> ForeignLog:
    """Every tenth row twice, time stamp and all."""
    rows = np.sort(np.concatenate((np.arange(c["time_s"].size), np.arange(5, 995, 10))))
    columns = {n: v[rows] for n, v in table(c).items()}
    return ForeignLog(paths=(write_csv(folder / "twice.csv", columns),), truth=truth_of(c))


def wrapping(folder: Path, c: Columns) -> ForeignLog:
    """Microseconds in 32 bits that wrap in the middle."""
    micros = np.round(1e6 * c["time_s"]) + 2.0**32 - 1e6
    columns = {**table(c), "time": micros % 2.0**32}
    return ForeignLog(paths=(write_csv(folder / "wrap.csv", columns),), truth=truth_of(c))


def waiting(folder: Path, c: Columns) -> ForeignLog:
    """The load cell's column is empty while it has nothing new."""
    own = table(c)
    empty = np.arange(own["time"].size) % 4 != 0
    own["loadcell"] = np.where(empty, np.nan, own["loadcell"])
    truth = {n: v for n, v in truth_of(c).items() if n != "torque_Nm"}
    rows = (c["time_s"].size - 1) // 4 * 4 + 1
    truth = {n: v[:rows] for n, v in truth.items()}
    return ForeignLog(paths=(write_csv(folder / "waiting.csv", own),), truth=truth)


def units_below(folder: Path, c: Columns) -> ForeignLog:
    """A second header line with units."""
    own = {"time": 1e3, "pwm": 100.0, "theta_m": DEG, "theta_l": DEG, "iq": 1e3, "loadcell": 1e3}
    columns = {n: own[n] * v for n, v in table(c).items()}
    units = {"time": "ms", "pwm": "%", "theta_m": "deg", "theta_l": "deg", "iq": "mA",
             "loadcell": "mNm"}  # fmt: skip
    head = ",".join(units[n] for n in columns)
    path = write_csv(folder / "units.csv", columns, head=head)
    return ForeignLog(paths=(path,), truth=truth_of(c))


def gaps(folder: Path, c: Columns) -> ForeignLog:
    """Two runs in one file with a pause between."""
    own = table(c)
    both = {n: np.concatenate((v, v)) for n, v in own.items()}
    both["time"] = np.concatenate((own["time"], own["time"] + own["time"][-1] + 30.0))
    path = write_csv(folder / "gaps.csv", both)
    return ForeignLog(paths=(path,), options=("--split",), truth=truth_of(c), recordings=2)


def restarting(folder: Path, c: Columns) -> ForeignLog:
    """Two runs in one file, each from time zero."""
    both = {n: np.concatenate((v, v)) for n, v in table(c).items()}
    path = write_csv(folder / "restart.csv", both)
    return ForeignLog(paths=(path,), options=("--split",), truth=truth_of(c), recordings=2)


def flagged(folder: Path, c: Columns) -> ForeignLog:
    """A flag is true while a run is on."""
    own = table(c)
    rows = own["time"].size
    running = np.ones(rows, dtype=int)
    running[rows // 2 : rows // 2 + 20] = 0
    own["running"] = running
    path = write_csv(folder / "flag.csv", own)
    truth = truth_of(c, slice(0, rows // 2))
    return ForeignLog(paths=(path,), options=("--split", "running"), truth=truth, recordings=2)


def several_joints(folder: Path, c: Columns) -> ForeignLog:
    """Two joints side by side."""
    own = table(c)
    time = own.pop("time")
    both = {f"elbow_{n}": v for n, v in own.items()}
    both |= {f"wrist_{n}": np.sin(time + k) for k, n in enumerate(own)}
    path = write_csv(folder / "joints.csv", {"time": time, **both})
    return ForeignLog(paths=(path,), options=("--joint", "elbow"), truth=truth_of(c))


DIALECTS: tuple[Callable[[Path, Columns], ForeignLog], ...] = (
    odrive, moteus, dynamixel, lerobot, joint_states, dates, simulink, dspace, tdms_groups,
    written_twice, wrapping, waiting, units_below, gaps, restarting, flagged, several_joints,
)  # fmt: skip
