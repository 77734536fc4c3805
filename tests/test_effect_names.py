"""An effect's contract name is a string in the effect's own file only."""

from tests.cases.effect_names import names, strings


def test_there_are_names_to_look_for():
    assert {"gear-backlash", "drive-thermal", "sensor-offset"} <= names()


def test_no_file_names_effects_of_others():
    assert not strings(), "write `GearBacklash.effect`, or ask the registry"
