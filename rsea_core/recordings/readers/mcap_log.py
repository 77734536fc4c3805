"""MCAP: messages of ROS 2 and JSON, topic by topic."""

import json
from pathlib import Path

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import Log, damaged, library
from rsea_core.recordings.readers.messages import MessageStream

SIGNATURE = b"\x89MCAP0\r\n"


def read_mcap(path: Path) -> Log:
    """The topics of an MCAP file whose messages hold numbers.

    Raises
    ------
    RecordingError
        If the file is damaged or cut off, or no topic has numbers in a known encoding.
    """
    reader_module = library("mcap.reader", path)
    topics: dict[str, MessageStream] = {}
    foreign, first, factories = set(), None, []
    try:
        with open(path, "rb") as stream:
            reader = reader_module.make_reader(stream)
            decoders: dict[int, object] = {}
            for schema, channel, message in reader.iter_messages():
                first = message.log_time if first is None else first
                if channel.id not in decoders:
                    if channel.message_encoding == "cdr" and not factories:
                        factories.append(library("mcap_ros2.decoder", path).DecoderFactory())
                    decoders[channel.id] = _decoder(factories, channel, schema)
                decode = decoders[channel.id]
                if decode is None:
                    foreign.add(f"{channel.topic} ({channel.message_encoding})")
                    continue
                own = topics.setdefault(
                    channel.topic, MessageStream(channel.topic, schema.name if schema else "")
                )
                own.add(message.log_time, decode(message.data))
    except RecordingError:
        raise
    except Exception as problem:  # untrusted bytes: the decoders raise anything
        raise damaged(path, "MCAP", problem) from problem
    streams = tuple(s for s in (t.stream(first) for t in topics.values()) if s is not None)
    if not streams:
        why = f"; not decoded: {', '.join(sorted(foreign)[:5])}" if foreign else ""
        raise RecordingError(f"{path}: no topic holds numbers{why}")
    return Log(path=path, format="MCAP", streams=streams)


def _decoder(factories: list, channel, schema):
    """A function of the bytes of a message; None for an encoding that is not read."""
    if channel.message_encoding == "json":
        return lambda data: json.loads(data)
    return factories[0].decoder_for(channel.message_encoding, schema) if factories else None
