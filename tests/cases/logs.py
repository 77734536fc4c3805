"""One small log, written in every format that the readers know."""

import json
from pathlib import Path

import numpy as np

ROWS = 400
TIME = 0.005 * np.arange(ROWS)
COLUMNS = {
    "t": 1e3 * TIME,
    "cmd": 20.0 * np.sin(3.0 * TIME),
    "pos": np.degrees(np.cos(3.0 * TIME)),
}


def write_csv(path: Path, *, delimiter=",", decimal=".", encoding="utf-8", units=False) -> Path:
    lines = [delimiter.join(COLUMNS)]
    if units:
        lines.append(delimiter.join(("ms", "%", "deg")))
    for row in zip(*COLUMNS.values()):
        lines.append(delimiter.join(f"{v:.17g}".replace(".", decimal) for v in row))
    path.write_text("\n".join(lines) + "\n", encoding=encoding)
    return path


def write_format(folder: Path, kind: str) -> Path:
    """The log in a format, by the library that owns it."""
    path = folder / f"log.{kind}"
    if kind == "mat":
        from scipy.io import savemat

        savemat(path, COLUMNS)
    elif kind in ("h5", "mat73"):
        import h5py

        path = folder / ("log.h5" if kind == "h5" else "log73.mat")
        with h5py.File(path, "w", userblock_size=512 if kind == "mat73" else 0) as file:
            for name, values in COLUMNS.items():
                file[name] = values
    elif kind == "parquet":
        import pyarrow as arrow
        from pyarrow import parquet

        parquet.write_table(arrow.table(COLUMNS), path)
    elif kind == "npz":
        np.savez(path, **COLUMNS)
    elif kind == "mcap":
        _write_mcap(path)
    elif kind == "tdms":
        from nptdms import ChannelObject, TdmsWriter

        with TdmsWriter(path) as writer:
            writer.write_segment([ChannelObject("g", n, v) for n, v in COLUMNS.items()])
    elif kind in ("bag", "rosbag2"):
        path = folder / ("log.bag" if kind == "bag" else "log_bag2")
        _write_ros(path, ros2=kind == "rosbag2")
    return path


def _write_mcap(path: Path) -> None:
    from mcap.writer import Writer

    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start()
        schema = writer.register_schema("log", "jsonschema", b"{}")
        channel = writer.register_channel("/joint", "json", schema)
        for row in zip(*COLUMNS.values()):
            data = json.dumps(dict(zip(COLUMNS, row))).encode()
            at = round(row[0] * 1e6)
            writer.add_message(channel, log_time=at, data=data, publish_time=at)
        writer.finish()


def _write_ros(path: Path, *, ros2: bool) -> None:
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE if ros2 else Stores.ROS1_NOETIC)
    joint_state = store.types["sensor_msgs/msg/JointState"]
    header, stamp = store.types["std_msgs/msg/Header"], store.types["builtin_interfaces/msg/Time"]
    if ros2:
        from rosbags.rosbag2 import Writer

        writer = Writer(path, version=9)
    else:
        from rosbags.rosbag1 import Writer

        writer = Writer(path)
    with writer:
        link = writer.add_connection("/joint_states", joint_state.__msgtype__, typestore=store)
        for t, cmd, pos in zip(*COLUMNS.values()):
            at = stamp(sec=0, nanosec=round(t * 1e6) % 10**9)
            at = stamp(sec=int(t // 1000), nanosec=at.nanosec)
            own = {"seq": 0} if not ros2 else {}
            message = joint_state(
                header=header(stamp=at, frame_id="", **own), name=["elbow", "wrist"],
                position=np.array([pos, 0.0]), velocity=np.zeros(2), effort=np.array([cmd, 0.0]),
            )  # fmt: skip
            pack = store.serialize_cdr if ros2 else store.serialize_ros1
            writer.write(link, round(t * 1e6), pack(message, joint_state.__msgtype__))
