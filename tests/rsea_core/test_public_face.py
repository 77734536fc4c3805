"""Results show themselves in a few lines, and every public name is where it says."""

import subprocess
import sys

import numpy as np
import pytest

import rsea_core
from rsea_core import ActuatorModel, Inputs, Load, Rig, linearise, simulate


def test_results_have_a_representation_of_a_few_lines():
    time = 1e-3 * np.arange(200)
    inputs = Inputs(time_s=time, duty=0.1 * np.sin(9.0 * time), load=Load(kind="pendulum"))
    model = ActuatorModel(Rig.preset("rsea-bench"))
    run, linear = simulate(model, inputs), linearise(model, load=Load(kind="free"))
    for result in (run, run.energy, inputs, linear):
        lines = repr(result).splitlines()
        assert lines[0] == type(result).__name__
        assert 2 <= len(lines) <= 14
        assert max(map(len, lines)) <= 160
    assert "(200) array, 0 to 0.199" in repr(run)


@pytest.mark.parametrize("name", rsea_core.__all__)
def test_every_public_name_can_be_had(name):
    assert getattr(rsea_core, name).__name__ == name


def test_the_import_alone_loads_no_library_and_no_search():
    heavy = ("numpy", "scipy", "numba", "rsea_core.identify", "rsea_core.engines")
    code = f"import sys, rsea_core; print([m for m in {heavy} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "[]", done.stderr


def test_a_name_that_is_not_there_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'Simulate'"):
        _ = rsea_core.Simulate


def test_a_name_of_before_still_works_and_says_where_it_is_now():
    with pytest.warns(DeprecationWarning, match=r"rsea_core\.effects\.GearFriction now"):
        assert rsea_core.GearFriction is rsea_core.effects.GearFriction
