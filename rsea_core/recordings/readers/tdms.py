"""LabVIEW's TDMS: one stream for each group, units and increments from the channels' properties."""

import logging
from pathlib import Path

import numpy as np

from rsea_core.errors import RecordingError
from rsea_core.recordings.readers.log import LOG_TIME, Log, Stream, damaged, flat_columns, library


def read_tdms(path: Path) -> Log:
    """The numeric channels of a TDMS file; `log_time` from the waveform's increment.

    Raises
    ------
    RecordingError
        If the file is damaged or has no channel of three rows.
    """
    nptdms = library("nptdms", path)
    library("nptdms.log", path).log_manager.set_level(logging.ERROR)  # warnings are errors below
    streams = []
    try:
        file = nptdms.TdmsFile.read(path)
        if file.file_status.incomplete_final_segment:
            raise ValueError("its last segment is cut off")
        for group in file.groups():
            found, units, step = {}, {}, None
            for channel in group.channels():
                values = np.asarray(channel[:])
                if values.dtype.kind == "M":
                    values = (values - values[0]).astype("timedelta64[ns]").astype(np.int64) * 1e-9
                found[channel.name] = values
                unit = channel.properties.get("unit_string")
                if unit:
                    units[channel.name] = str(unit)
                step = channel.properties.get("wf_increment", step)
            columns = flat_columns(found)
            rows = max((v.size for v in columns.values()), default=0)
            columns = {n: v for n, v in columns.items() if v.size == rows}
            if step and rows:
                columns = {LOG_TIME: float(step) * np.arange(rows), **columns}
            if rows >= 3:
                streams.append(Stream(name=group.name, columns=columns, units=units))
    except Exception as problem:  # the library raises bare exceptions of any kind
        raise damaged(path, "TDMS", problem) from problem
    if not streams:
        raise RecordingError(f"{path}: has no channel of three rows or more")
    return Log(path=path, format="TDMS", streams=tuple(streams))
