"""A table [columns] of the rig file that an import is given is the map, as if it were answered."""

import numpy as np
import pytest

from rsea_core.errors import RecordingError
from rsea_core.importing.answers import parse_answer
from rsea_core.importing.log_columns import Column
from rsea_core.importing.stated_map import is_proposed, stated_answers, with_overrides

COLUMNS = {
    n: Column(name=f"{n}[hip]" if n == "enc" else n, topic=None, values=np.arange(9.0), unit=None)
    for n in ("t", "enc", "iq", "goal", "spare")
}
MAP = {
    "time_s": {"name": "t", "unit": "ms"}, "motor_angle_rad": {"name": "enc[{joint}]"},
    "current_A": {"name": "iq", "sign": -1}, "reference": ["goal", "of another log"],
    "ignore": ["spare", "*"], "joint": "hip",
}  # fmt: skip


def test_a_map_states_columns_references_and_what_is_left_out():
    found = stated_answers(MAP, COLUMNS, None, None)
    own = {a.name: a.source and (a.source.target, a.source.sign) for a in found}
    assert own == {
        "t": ("time_s", 1), "enc": ("motor_angle_rad", 1), "iq": ("current_A", -1),
        "goal": None, "spare": None,
    }  # fmt: skip
    assert [a.name for a in found if a.is_left_out] == ["spare"]


def test_the_command_line_is_preferred_to_the_map():
    given = [parse_answer("current_A=goal:A", COLUMNS), parse_answer("ignore=enc", COLUMNS)]
    found = with_overrides(stated_answers(MAP, COLUMNS, None, None), given)
    own = {a.name: a.source and a.source.target for a in found}
    assert own == {"t": "time_s", "goal": "current_A", "enc": None, "spare": None}


def test_a_column_that_the_log_lacks_is_named_and_a_proposal_is_no_statement():
    with pytest.raises(RecordingError, match="current_A: no column 'iqq'"):
        stated_answers({"current_A": "iqq"}, COLUMNS, None, None)
    assert is_proposed({"proposed": True})
    assert not is_proposed(MAP)


def test_percent_of_a_range_is_refused_with_the_form_that_works():
    with pytest.raises(RecordingError, match=r'name = "iq", unit = "A", scale = 0\.08 }'):
        parse_answer("current_A=iq:percent", COLUMNS)
