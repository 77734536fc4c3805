"""Columns of several streams on one clock, angles that wrap, ends of a joint, counters of rows."""

from pathlib import Path

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.importing.log_columns import columns_on_one_clock
from rsea_core.importing.proposal import propose, why_no_time
from rsea_core.importing.streams.wraps import without_wraps, wraps_of
from rsea_core.recordings.column_map import column_map
from rsea_core.recordings.log_clock import unwrapped
from rsea_core.recordings.readers.log import Log, Stream
from rsea_core.recordings.recording import COLUMNS

TIME = 1e-3 * np.arange(2000)
ANGLE = 20.0 * np.sin(3.0 * TIME)


def on_one_clock(*streams: Stream, joint: str | None = None):
    log = Log(path=Path("log.mcap"), format="MCAP", streams=streams)
    return columns_on_one_clock([log], joint)


def stream(name: str, rows: int = 2000, **columns) -> Stream:
    own = {"pos": ANGLE[:rows], "time": TIME[:rows]} | columns
    return Stream(name=name, columns=own)


@pytest.mark.parametrize(
    ("label", "scale", "turn", "zero"),
    [("pos [deg]", 180.0 / np.pi, 360.0, 0.0), ("motor_pos", 1.0, 2.0 * np.pi, np.pi),
     ("theta", 4096.0 / (2.0 * np.pi), 4096.0, 0.0), ("enc", 1e4, 65536.0, 32768.0)],
)  # fmt: skip
def test_an_angle_that_starts_again_after_a_turn_is_found_and_its_turns_counted(
    label, scale, turn, zero
):
    raw = {label: (scale * ANGLE + zero) % turn - zero}
    assert wraps_of(raw, {}, None) == {label: turn}
    counted = without_wraps(raw, {label: turn})[label]
    assert np.allclose(counted - counted[0], scale * (ANGLE - ANGLE[0]), atol=1e-6)


def test_an_angle_that_jumps_or_stays_inside_a_turn_does_not_wrap():
    spike = np.where(np.arange(2000) == 700, 300.0, ANGLE)
    raw = {"pos": 10.0 * ANGLE, "theta [deg]": spike, "pos_goal [deg]": ANGLE % 360.0, "iq": ANGLE}
    assert wraps_of(raw, {}, None) == {}


def test_turns_that_cannot_be_counted_are_refused_with_their_row():
    with pytest.raises(RecordingError, match="between data rows 2 and 3"):
        unwrapped(np.array([0.0, 10.0, 185.0, 190.0]), 360.0)


def test_a_map_states_where_an_angle_wraps():
    table = {"motor_angle_rad": {"name": "pos", "unit": "deg", "wrap": 360.0}}
    assert column_map(table, COLUMNS, "rig.toml").sources[0].wrap == 360.0
    table["motor_angle_rad"]["wrap"] = 0.0
    with pytest.raises(RecordingError, match=r"wrap = 0\.0 must be above 0"):
        column_map(table, COLUMNS, "rig.toml")


@pytest.mark.parametrize(
    ("other", "says"),
    [
        (stream("/load", time=TIME + 1.7e9), "two clocks that disagree: 'time' of /motor 0 to"),
        (stream("/load", time=1e3 * TIME), "two clocks that disagree"),
        (Stream(name="/load", columns={"t_ms": TIME, "pos": ANGLE}), "no column 'time'"),
    ],
)
def test_streams_without_a_common_clock_are_refused(other, says):
    with pytest.raises(RecordingError, match=says):
        on_one_clock(stream("/motor", iq=ANGLE), other)


def test_a_topic_without_a_stamp_makes_the_time_of_writing_the_clock_of_all():
    states = stream("/states", **{"header.stamp": TIME, "log_time": TIME})
    duty = Stream(name="/motor/duty", columns={"log_time": TIME, "data": ANGLE})
    columns, labels = on_one_clock(
        Stream(name="/states", columns={n: v for n, v in states.columns.items() if n != "time"}),
        duty,
    )
    assert "header.stamp" not in columns
    assert labels["data"] == "motor duty"


def test_motor_and_link_of_a_joint_state_are_the_ends_of_one_joint():
    own = {"position[motor]": ANGLE, "position[link]": ANGLE, "velocity[motor]": ANGLE}
    _, labels = on_one_clock(Stream(columns={"time": TIME, **own, "velocity[link]": ANGLE}))
    assert [labels[n] for n in own] == ["motor position", "link position", "motor velocity"]
    units = {"iq [mA]": ANGLE, "cell [mNm]": ANGLE, "time": TIME}
    assert list(on_one_clock(Stream(columns=units))[1].values()) == list(units)


def test_a_vector_of_no_known_quantity_is_not_taken_for_joints():
    columns, _ = on_one_clock(stream("", **{"xyz[0]": ANGLE, "xyz[1]": ANGLE}))
    assert "xyz[1]" in columns


def test_a_counter_of_rows_is_neither_a_clock_nor_a_question():
    rows = np.arange(2000.0)
    assert propose({"n": rows, "pos": ANGLE}, {}).rate_needed
    found = propose({"n": rows, "time": TIME, "load_pos": ANGLE}, {})
    assert found.ignored == ("n",)
    assert not any("'n'" in q for q in found.questions)


@pytest.mark.parametrize(
    ("time", "says"),
    [
        (np.where(np.arange(2000) == 9, 0.0, TIME), "goes back in row 10"),
        (np.where(np.arange(2000) == 9, np.nan, TIME), "has no time in row 10"),
        (0.0 * TIME, "stands still"),
    ],
)
def test_a_clock_that_is_none_is_named_with_its_row(time, says):
    assert says in why_no_time({"time": time, "pos": ANGLE}, {})
