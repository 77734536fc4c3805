"""Ports are told apart as the table of the diagnosis specification says, row by row."""

import pytest

from rsea_core.errors import InputError
from rsea_core.identify.smoothing.separability import separability

ENCODERS = ("motor_angle_rad", "load_angle_rad")
TABLE = [
    # load, sensors besides the encoders, equations, classes, isolated in any combination
    ("pendulum", (), 2, ["VG", "S", "L"], ""),
    ("pendulum", ("current_A",), 3, ["V", "G", "S", "L"], "V"),
    ("pendulum", ("torque_Nm",), 3, ["VG", "S", "L"], "VGSL"),
    ("pendulum", ("current_A", "torque_Nm"), 4, ["V", "G", "S", "L"], "VGSL"),
    ("locked", (), 1, ["VGS"], "VGS"),
    ("locked", ("current_A",), 2, ["V", "GS"], "VGS"),
    ("locked", ("torque_Nm",), 2, ["VG", "S"], "VGS"),
    ("locked", ("current_A", "torque_Nm"), 3, ["V", "G", "S"], "VGS"),
    ("contact", (), 2, ["VG", "S", "LE"], ""),
    ("contact", ("current_A",), 3, ["V", "G", "S", "LE"], "V"),
    ("contact", ("torque_Nm",), 3, ["VG", "S", "LE"], "VGSLE"),
    ("contact", ("current_A", "torque_Nm"), 4, ["V", "G", "S", "LE"], "VGSLE"),
]


@pytest.mark.parametrize(("load", "more", "equations", "classes", "isolated"), TABLE)
def test_table_of_what_the_sensors_separate(load, more, equations, classes, isolated):
    found = separability(load=load, command="duty", sensors=(*ENCODERS, *more))
    machine = ["".join(p for p in c if not p.startswith("Y:")) for c in found.classes]
    assert found.equations == equations
    assert [c for c in machine if c] == classes
    assert "".join(found.isolated) == isolated


def test_a_smoother_carries_one_torque_per_direction_and_none_that_others_imitate():
    pendulum = separability(load="pendulum", command="duty", sensors=ENCODERS)
    assert pendulum.latents == ("G", "L")  # S pulls on both: it is G and L together
    assert dict(pendulum.merged) == {"G": ("V",), "L": ()}
    both = separability(
        load="pendulum", command="duty", sensors=(*ENCODERS, "current_A", "torque_Nm")
    )
    assert both.latents == ("V", "G", "S", "L")


@pytest.mark.parametrize("sensor", ["current_A", "torque_Nm"])
def test_a_sensor_error_has_a_direction_of_its_own_but_no_isolation(sensor):
    sensors = (*ENCODERS, "current_A", "torque_Nm")
    found = separability(load="pendulum", command="duty", sensors=sensors)
    assert (f"Y:{sensor}",) in found.classes  # differs from every single port
    assert found.equations == 4  # and four ports fill the space: together they imitate it


def test_partial_machines_merge_what_they_lack():
    rigid = separability(
        parts=("drive", "gear", "load"),
        load="free",
        command="current_command_A",
        sensors=("load_angle_rad",),
    )
    assert rigid.latents == ("G",)
    assert set(dict(rigid.merged)["G"]) == {"V", "L"}
    link = separability(parts=("load",), load="pendulum", command=None, sensors=("load_angle_rad",))
    assert link.latents == ("L",)
    bench = separability(
        parts=("spring",),
        load="imposed",
        command=None,
        sensors=("spring_deflection_rad", "torque_Nm"),
    )
    assert bench.latents == ("S",)
    assert bench.equations == 1


def test_sentence_names_what_stays_together():
    found = separability(load="locked", command="duty", sensors=(*ENCODERS, "current_A"))
    assert "drive | gear or spring" in found.sentence()
    alone = separability(load="locked", command="duty", sensors=ENCODERS)
    assert "only by the shape" in alone.sentence()


def test_nothing_read_is_refused():
    with pytest.raises(InputError, match="no response is read"):
        separability(load="locked", command="duty", sensors=("load_angle_rad",))
    with pytest.raises(InputError, match="unknown"):
        separability(load="swing", command="duty", sensors=ENCODERS)
