"""A mount that hardly gives is the rigid one; a soft one is below spring and seat in row."""

import numpy as np
import pytest

from dftfs.analysis.structure.mounting import Bolts, Seat, mounted_stiffness
from dftfs.cli.main import main
from dftfs.design import load_design
from dftfs.errors import DesignError


def test_a_stiff_seat_is_rigid_and_a_soft_one_gives_at_least_as_much_as_its_own_torsion():
    design = load_design("al1")
    stiff = mounted_stiffness(design, Seat(stiffness_N_per_m3=1e18), Seat(stiffness_N_per_m3=1e18))
    assert abs(stiff.change) < 1e-4
    k, bore = 1e11, design.spiral.bore_radius_m
    soft = mounted_stiffness(design, Seat(stiffness_N_per_m3=k), None)
    seat = k * 2 * np.pi * bore**3 * design.width_m  # a rigid hub on it
    in_row = 1 / (1 / soft.rigid_Nm_per_rad + 1 / seat)
    assert 0.97 * in_row < soft.mounted_Nm_per_rad < in_row


def test_bolts_slip_at_preload_times_friction_times_radius_and_need_material():
    bolts = Bolts(count=8, hole_m=3.2e-3, circle_m=165.5e-3)
    assert bolts.slip_Nm(3000, 0.12) == pytest.approx(8 * 3000 * 0.12 * 0.08275)
    with pytest.raises(DesignError, match=r"e\.g\. 6 4\.2 165"):
        Bolts(count=0, hole_m=3.2e-3, circle_m=0.1655)
    with pytest.raises(DesignError, match=r"e\.g\. 1000 N/mm3"):
        Seat(stiffness_N_per_m3=0.0)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ((), "nothing is mounted; for example --rim-bolts 8 3.2 165.5"),
        (("--rim-bolts", "8.5", "3.2", "165.5"), "COUNT = 8.5 must be a whole number, e.g. 8"),
        (("--hub-bolts", "4", "3", "30", "--hub-seat", "9"), "exclude each other"),
        (("--rim-seat", "9", "--friction", "0"), "--friction above 0, e.g. 3000 and 0.12"),
    ],
)
def test_a_mount_that_is_none_is_refused_in_one_line(options, expected, capsys):
    assert main(["mount", "al1", *options]) == 2
    err = capsys.readouterr().err
    assert expected in err
    assert err.count("\n") == 1
