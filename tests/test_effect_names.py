"""An effect's contract name is a string in the effect's own file only."""

from tests.cases.effect_names import names, strings
from tests.cases.sources import exceptions


def test_there_are_names_to_look_for():
    assert {"gear-backlash", "drive-thermal", "sensor-offset"} <= names()


def test_no_file_names_effects_of_others_more_than_its_exception():
    found, listed = strings(), exceptions()["effect_names"]
    more = {place: n for place, n in found.items() if n > listed.get(place, 0)}
    assert not more, f"write `GearBacklash.effect`, or ask the registry: {more}"
    fewer = {place: n for place, n in listed.items() if found.get(place, 0) < n}
    assert not fewer, f"the list may only shrink: lower these, or take them out: {fewer}"
