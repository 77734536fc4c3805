"""`[columns]` of a rig file: which column of a log is which reading, in which unit and sign.

A reading in SI is sign * scale * unit(logged - zero), where `zero` is in the log's unit, and so is
`wrap`, at which an angle starts again (its turns are counted). A `motor_angle_rad` measured
behind the gear (`side = "load"`) is multiplied by the gear ratio, one of the load side that was
measured at the motor divided.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from rsea_core.errors import RecordingError
from rsea_core.files.toml_tables import nearest, number, require_known
from rsea_core.machine.inputs import POSITION_COMMAND
from rsea_core.machine.rig import Rig, is_linear

SOURCE_KEYS = (
    "name", "formula", "unit", "sign", "scale", "zero", "side", "counts_per_rev", "topic", "wrap",
)  # fmt: skip
PROPOSED = "proposed"  # true: by a first import, which knew no values of the machine
MAP_KEYS = ("rate_Hz", "joint", "channels", "reference", "ignore", PROPOSED)
CHANNEL_KEYS = ("channel", "value", "time")
SIDES = ("motor", "load")


@dataclass(frozen=True, kw_only=True)
class ColumnSource:
    """Where a column of the contract comes from.

    Attributes
    ----------
    target : str
        The contract's column.
    name : str
        The log's column; `{joint}` in it stands for the joint.
    formula : str or None
        Sum, difference, product or quotient of quoted columns, instead of one column.
    unit : str or None
        Of the log; None: that of the target.
    sign : 1 or -1
    scale, zero : float
    side : "motor", "load" or None
        Side of the gear at which it was measured; None: that of the target.
    counts_per_rev : float or None
        Of an encoder whose unit is "count".
    wrap : float or None
        One turn of an angle that starts again there, in the log's unit.
    topic : str or None
        Stream of the log, where several have such a column.
    """

    target: str
    name: str = ""
    formula: str | None = None
    unit: str | None = None
    sign: int = 1
    scale: float = 1.0
    zero: float = 0.0
    side: str | None = None
    counts_per_rev: float | None = None
    topic: str | None = None
    wrap: float | None = None


@dataclass(frozen=True, kw_only=True)
class ColumnMap:
    """The columns of a log.

    Attributes
    ----------
    sources : tuple of ColumnSource
    rate_Hz : float or None
        Rows a second of a log without times.
    joint : str or None
        What `{joint}` in names stands for.
    channels : mapping or None
        Columns `channel`, `value`, `time` of a log with one reading a row.
    references : tuple of str
        Kept as logged, shown in reports, never fitted.
    ignored : tuple of str
        Not read; "*" is all that is not named.
    linear : bool
        Whether the axis is linear: lengths and forces are then units of its columns.
    """

    sources: tuple[ColumnSource, ...] = ()
    rate_Hz: float | None = None
    joint: str | None = None
    channels: tuple[tuple[str, str], ...] | None = None
    references: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    linear: bool = False

    def source(self, target: str) -> ColumnSource | None:
        """The source of a column of the contract."""
        return next((s for s in self.sources if s.target == target), None)


def column_map(table: Mapping, targets: tuple[str, ...], where: str) -> ColumnMap:
    """The map that a table `[columns]` states.

    Parameters
    ----------
    targets : tuple of str
        The columns of the contract.

    Raises
    ------
    RecordingError
        For an unknown key, a wrong value, or a time stated twice.
    """
    if not isinstance(table, Mapping):
        raise RecordingError(f"{where}: columns must be a table, written [columns]")
    require_known(table, (*targets, *MAP_KEYS), where, RecordingError)
    sources = tuple(_source(key, table[key], where) for key in table if key in targets)
    rate = table.get("rate_Hz")
    if rate is not None:
        rate = number(rate, f"{where}: rate_Hz", RecordingError)
        if rate <= 0.0:
            raise RecordingError(f"{where}: rate_Hz = {rate} must be above 0")
        if "time_s" in table:
            raise RecordingError(f"{where}: has rate_Hz and time_s; a log has one clock")
    if not isinstance(table.get(PROPOSED, True), bool):
        raise RecordingError(f"{where}: {PROPOSED} = {table[PROPOSED]!r} must be true or false")
    joint = table.get("joint")
    if joint is not None and not isinstance(joint, str | int):
        raise RecordingError(f"{where}: joint = {joint!r} must be a name or a number")
    return ColumnMap(
        sources=sources,
        rate_Hz=rate,
        joint=None if joint is None else str(joint),
        channels=_channels(table.get("channels"), where),
        references=_names(table, "reference", where),
        ignored=_names(table, "ignore", where),
    )


def for_rig(columns: ColumnMap, rig: Rig) -> ColumnMap:
    """The map with what a rig file knows: the counts of its encoders, and a linear axis."""
    sources = tuple(
        replace(s, counts_per_rev=counts_of(rig, s.target, s.side))
        if s.counts_per_rev is None else s
        for s in columns.sources
    )  # fmt: skip
    return replace(columns, sources=sources, linear=is_linear(rig))


def counts_of(rig: Rig, target: str, side: str | None) -> float | None:
    """Counts of the encoder that a column is read from; None where the rig file has none."""
    own = "load" if target == POSITION_COMMAND else side or target.split("_")[0]
    return getattr(rig, f"{own}_encoder_counts_per_rev", None)


def merged(case_table: Mapping | None, own_table: Mapping | None) -> Mapping | None:
    """The case's `[columns]` with a recording's own entries in place of the case's."""
    if own_table is None or case_table is None:
        return case_table if own_table is None else own_table
    if not isinstance(own_table, Mapping) or not isinstance(case_table, Mapping):
        return own_table
    base = dict(case_table)
    if "rate_Hz" in own_table:
        base.pop("time_s", None)
    if "time_s" in own_table:
        base.pop("rate_Hz", None)
    return {**base, **own_table}


def _source(target: str, value: object, where: str) -> ColumnSource:
    if isinstance(value, str):
        return ColumnSource(target=target, name=value)
    place = f"{where}: {target}"
    if not isinstance(value, Mapping):
        raise RecordingError(f'{place} = {value!r} must be a name or {{ name = "..." }}')
    require_known(value, SOURCE_KEYS, place, RecordingError)
    for key in ("name", "formula", "unit", "side", "topic"):
        if key in value and not isinstance(value[key], str):
            raise RecordingError(f"{place}: {key} = {value[key]!r} must be text")
    if ("name" in value) == ("formula" in value):
        raise RecordingError(f"{place}: needs a name or a formula, one of the two")
    sign = value.get("sign", 1)
    if sign not in (1, -1) or isinstance(sign, bool):
        raise RecordingError(f"{place}: sign = {sign!r} must be 1 or -1")
    side = value.get("side")
    if side is not None and side not in SIDES:
        raise RecordingError(f"{place}: side {side!r} is unknown; {nearest(side, SIDES)}")
    numbers = {
        key: number(value[key], f"{place}: {key}", RecordingError)
        for key in ("scale", "zero", "counts_per_rev", "wrap")
        if key in value
    }
    if numbers.get("wrap", 1.0) <= 0.0:
        raise RecordingError(f"{place}: wrap = {numbers['wrap']} must be above 0")
    if numbers.get("scale", 1.0) == 0.0 or numbers.get("counts_per_rev", 1.0) <= 0.0:
        raise RecordingError(f"{place}: scale must not be 0 and counts_per_rev above 0")
    texts = {key: value.get(key) for key in ("formula", "unit", "topic")}
    name = value.get("name", "")
    return ColumnSource(target=target, name=name, sign=sign, side=side, **texts, **numbers)


def _channels(value: object, where: str) -> tuple[tuple[str, str], ...] | None:
    if value is None:
        return None
    ok = isinstance(value, Mapping) and set(value) == set(CHANNEL_KEYS)
    if not ok or not all(isinstance(v, str) for v in value.values()):
        raise RecordingError(
            f'{where}: channels must be {{ channel = "...", value = "...", time = "..." }}'
        )
    return tuple((key, value[key]) for key in CHANNEL_KEYS)


def _names(table: Mapping, key: str, where: str) -> tuple[str, ...]:
    value = table.get(key, [])
    if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
        raise RecordingError(f"{where}: {key} = {value!r} must be a list of names of columns")
    return tuple(value)
