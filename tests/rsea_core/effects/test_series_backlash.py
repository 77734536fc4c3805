"""Play in series with a spring is a dead zone of its law, whatever that law is."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rsea_core import ActuatorModel, Load, Rig
from rsea_core.effects import SpringContact, SpringHardening
from rsea_core.effects.series_backlash import SeriesBacklash
from rsea_core.machine.spring_table import linear_table, spring_torque_Nm, table_deflection

RIG = Rig(name="r", gear_ratio=1.0, motor_inertia_kgm2=1e-3, motor_viscous_Nms_per_rad=1e-3,
          spring_stiffness_Nm_per_rad=5.0, load_inertia_kgm2=1e-3,
          load_viscous_Nms_per_rad=1e-3)  # fmt: skip


@given(width=st.floats(1e-4, 0.5), deflection=st.floats(-2.0, 2.0))
def test_of_a_linear_spring_it_is_the_dead_zone_of_nordin_and_gutman(width, deflection):
    found = spring_torque_Nm(
        SeriesBacklash(width_rad=width).on_spring(linear_table(5.0)), deflection
    )
    expected = 5.0 * np.sign(deflection) * max(abs(deflection) - 0.5 * width, 0.0)
    assert found == pytest.approx(expected, abs=1e-13)


def test_it_shifts_every_other_change_of_the_law_whatever_their_order():
    others = (SpringHardening(stiffness_ratio_at_0p15rad=1.5),
              SpringContact(onset_rad=0.2, stiffness_ratio=3.0))  # fmt: skip
    backlash, at = SeriesBacklash(width_rad=0.06), np.linspace(-0.5, 0.5, 41)
    whole = spring_torque_Nm(ActuatorModel(RIG, others).spring_table(Load()), at)
    for terms in ((backlash, *others), (*others, backlash)):
        table = ActuatorModel(RIG, terms).spring_table(Load())
        shifted = spring_torque_Nm(table, at + 0.03 * np.sign(at))
        np.testing.assert_allclose(shifted, whole, atol=1e-12)


def test_deflection_is_the_inverse_of_torque_outside_of_the_gap():
    regions = SeriesBacklash(width_rad=0.1).on_spring(linear_table(5.0)).regions
    for torque in (-2.0, -1e-9, 1e-9, 2.0):
        assert table_deflection(regions, torque) == pytest.approx(
            torque / 5.0 + 0.05 * np.sign(torque), abs=1e-12
        )
