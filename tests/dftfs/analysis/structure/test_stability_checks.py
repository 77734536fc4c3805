"""A spring that leaves its plane below its operating torque fails, and only there.

al1 of 7075, 1.5 mm wide: four unstable modes when it winds, the first at +0.209 rad, below 4 Nm.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from dftfs.analysis.structure.buckling import Stability, StabilityState
from dftfs.analysis.structure.stability_checks import (
    ends_at_torque_rad,
    stability_at,
    stability_checks,
)
from dftfs.design import load_design


def lost_at(torque_Nm: float | None, last_Nm: float = 4.0) -> Stability:
    """A straight curve of 20 Nm/rad, stability lost at a torque or nowhere."""
    states = tuple(
        StabilityState(
            deflection_rad=torque / 20,
            torque_Nm=torque,
            lowest_per_s2=1.0 if torque_Nm is None else 1 - torque / torque_Nm,
            unstable=0 if torque_Nm is None else int(torque > torque_Nm),
        )
        for torque in (0.0, last_Nm / 2, last_Nm)
    )
    critical = None if torque_Nm is None else torque_Nm / 20
    return Stability(states=states, critical_rad=critical, extrapolated=False)


@pytest.mark.parametrize(
    ("lost", "asked", "passed"),
    [
        (3.0, 3.5, False),
        (3.0, 2.5, True),
        (3.0, None, False),
        (None, 3.5, True),
        (None, None, True),
    ],
)
def test_what_counts_is_the_operating_torque(lost, asked, passed):
    (check,) = stability_checks({"winding": lost_at(lost)}, asked)
    assert check.passed is passed
    assert check.value == (0 if passed else 1)
    if lost is not None:
        assert "lost at +0.150 rad, 3 Nm" in check.note


def test_a_path_that_ends_at_the_contact_says_how_far_it_goes():
    (check,) = stability_checks({"winding": lost_at(None)}, 10.0)
    assert check.passed
    assert "judged up to 4 Nm" in check.note


def test_the_end_is_the_torques_angle_and_before_the_first_contact():
    angle = np.linspace(-0.2, 0.4, 13)
    touch = SimpleNamespace(deflection_rad=-0.1)
    curve = SimpleNamespace(
        torque_Nm=20 * angle,
        deflection_rad=angle,
        contact_onset={"winding": None, "unwinding": touch},
    )
    ends = ends_at_torque_rad(curve, 3.0)
    assert ends["winding"] == pytest.approx(0.15)
    assert ends["unwinding"] == pytest.approx(-0.098)


def test_a_thin_strip_tips_below_its_torque_and_a_wide_one_is_not_asked():
    changes = {"width_mm": "1.5", "material": "al-7075-t6"}
    (check,) = stability_checks(
        stability_at(load_design("al1", changes), {"winding": 4 / 14.2}), 4.0
    )
    assert check.passed is False
    assert check.value >= 1
    assert "frequency squared -" in check.note
    assert "stability lost at +0." in check.note
    assert stability_at(load_design("al1", {"width_mm": "8"}), {"winding": 0.1}) == {}
