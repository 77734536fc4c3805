"""ROS bags: `.bag` of ROS 1, folders with `metadata.yaml` and `.db3` files of ROS 2."""

from pathlib import Path

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, damaged, library
from rsea_core.recordings.readers.messages import MessageStream

SIGNATURE = b"#ROSBAG V2.0"


def is_ros2_folder(path: Path) -> bool:
    """Whether a folder is a bag of ROS 2."""
    return path.is_dir() and (path / "metadata.yaml").is_file()


def read_ros_bag(path: Path) -> Log:
    """The topics of a bag whose messages hold numbers.

    Raises
    ------
    RecordingError
        If the bag is damaged, or no topic has numbers of a known type.
    """
    highlevel, typesys = library("rosbags.highlevel", path), library("rosbags.typesys", path)
    topics: dict[str, MessageStream] = {}
    foreign, first = set(), None
    store = typesys.get_typestore(typesys.Stores.LATEST)
    try:
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            for connection, time_ns, data in reader.messages():
                first = time_ns if first is None else first
                try:
                    message = reader.deserialize(data, connection.msgtype)
                except KeyError:
                    foreign.add(f"{connection.topic} ({connection.msgtype})")
                    continue
                own = topics.setdefault(
                    connection.topic, MessageStream(connection.topic, connection.msgtype)
                )
                own.add(time_ns, message)
    except Exception as problem:  # untrusted bytes: the decoders raise anything
        raise damaged(path, "ROS bag", problem) from problem
    streams = tuple(s for s in (t.stream(first) for t in topics.values()) if s is not None)
    if not streams:
        why = f"; unknown types: {', '.join(sorted(foreign)[:5])}" if foreign else ""
        raise RecordingError(f"{path}: no topic holds numbers{why}")
    return Log(path=path, format="ROS bag", streams=streams)
