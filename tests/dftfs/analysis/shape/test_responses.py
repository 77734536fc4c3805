"""Claim: derivatives of stiffness, area, stress and first contact over the shape are exact.

They come from implicit differentiation of the twisted rod; the reference is central differences of
the whole computation, equilibrium and search for contact included.
"""

import numpy as np
import pytest

from dftfs.analysis.shape.responses import responses
from dftfs.analysis.shape.space import ShapeSpace
from dftfs.design import load_design
from dftfs.errors import DesignError
from dftfs.process import find_process

ANGLE_RAD, STEP = 0.23, 3e-4
PAIRS = (
    ("stiffness_Nm_per_rad", "stiffness_gradient"),
    ("area_m2", "area_gradient"),
    ("stress_per_torque", "stress_gradient"),
    ("contact_Nm", "contact_gradient"),
)


def test_derivatives_agree_with_central_differences():
    space = ShapeSpace(start=load_design("al1"), process=find_process("wire-edm"))
    chance = np.random.default_rng(0)
    shape = space.origin + 0.02 * chance.standard_normal(len(space.names))
    along = chance.standard_normal(len(space.names))
    along /= np.linalg.norm(along)
    here, above, below = (
        responses(space, shape + step * along, angle_rad=ANGLE_RAD) for step in (0, STEP, -STEP)
    )
    for value, gradient in PAIRS:
        high, low = np.array(getattr(above, value)), np.array(getattr(below, value))
        found, rate = along @ getattr(here, gradient), (high - low) / (2 * STEP)
        scale = np.max(np.abs(rate))
        np.testing.assert_allclose(found, rate, rtol=0, atol=1e-6 * scale, err_msg=value)


def test_a_design_with_a_profile_is_no_start():
    design = load_design("al1")
    shaped = ShapeSpace(start=design, process=find_process("wire-edm"))
    other = shaped.design(shaped.origin, design.width_m, "other")
    with pytest.raises(DesignError, match="remove both"):
        ShapeSpace(start=other, process=find_process("wire-edm"))
