"""Messages of robot logs as columns: numbers by their path, arrays by joint where names are given.

`sensor_msgs/JointState` names its joints in every message: `position[elbow]`. Any other message is
walked the same way; a stamp in its header is a column of its own, since the log's clock is when the
message was written, not when it was read.
"""

from collections.abc import Iterator, Mapping

import numpy as np

from rsea_core.recordings.readers.log import LOG_TIME, WIDEST, Stream

DEEPEST = 8
JOINT_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "N*m"}
"""Of `sensor_msgs/JointState`, as its definition states for joints that turn."""
STAMP = "header.stamp"


class MessageStream:
    """Collects the messages of one topic."""

    def __init__(self, name: str, kind: str = ""):
        self.name = name
        self.kind = kind
        self._times: list[int] = []
        self._rows: list[dict[str, float]] = []

    def add(self, time_ns: int, message: object) -> None:
        """Add a message: its numbers by their path."""
        self._times.append(time_ns)
        self._rows.append(dict(numbers_of(message)))

    def stream(self, first_ns: int) -> Stream | None:
        """The columns, NaN where a message has no such number; None without numbers."""
        names: dict[str, None] = {}
        for row in self._rows:
            names.update(dict.fromkeys(row))
        if not names or len(self._rows) < 3:
            return None
        columns = {LOG_TIME: (np.array(self._times, dtype=np.int64) - first_ns) * 1e-9}
        for name in names:
            columns[name] = np.array([row.get(name, np.nan) for row in self._rows])
        is_joint = self.kind.endswith("JointState")
        own = {n: JOINT_UNITS.get(n.partition("[")[0]) for n in names} if is_joint else {}
        units = {n: unit for n, unit in own.items() if unit is not None}
        return Stream(name=self.name, columns=columns, units=units)


def _fields(message: object) -> list[tuple[str, object]]:
    if isinstance(message, Mapping):
        return list(message.items())
    slots = getattr(message, "__slots__", None) or getattr(message, "__dict__", {})
    own = [s for s in slots if not s.startswith("_") and not callable(getattr(message, s, None))]
    return [(name, getattr(message, name)) for name in own]


def numbers_of(message: object, path: str = "", depth: int = 0) -> Iterator[tuple[str, float]]:
    """The numbers of a message, each with its path: `state.position[elbow]`."""
    if depth > DEEPEST:
        return
    fields = _fields(message)
    joints = _joint_names(dict(fields).get("name", dict(fields).get("joint_names")))
    for name, value in fields:
        own = f"{path}.{name}" if path else name
        seconds = _stamp(value)
        if seconds is not None:
            yield own, seconds
        elif isinstance(value, bool | int | float | np.number):
            yield own, float(value)
        elif isinstance(value, list | tuple | np.ndarray) and not isinstance(value, bytes):
            if len(value) > WIDEST:
                continue
            labels = joints if len(joints) == len(value) else range(len(value))
            for label, item in zip(labels, value, strict=True):
                if isinstance(item, bool | int | float | np.number):
                    yield f"{own}[{label}]", float(item)
                elif not isinstance(item, str | bytes):
                    yield from numbers_of(item, f"{own}[{label}]", depth + 1)
        elif value is not None and not isinstance(value, str | bytes):
            yield from numbers_of(value, own, depth + 1)


def _joint_names(value: object) -> list[str]:
    given = list(value) if isinstance(value, list | tuple | np.ndarray) else []
    return given if all(isinstance(n, str) for n in given) else []


def _stamp(value: object) -> float | None:
    """Seconds of a ROS time: `sec` and `nanosec` (2) or `secs` and `nsecs` (1)."""
    own = dict(_fields(value)) if not isinstance(value, list | tuple | np.ndarray | str) else {}
    for whole, part in (("sec", "nanosec"), ("secs", "nsecs")):
        if whole in own and part in own and len(own) == 2:
            return float(own[whole]) + 1e-9 * float(own[part])
    return None
