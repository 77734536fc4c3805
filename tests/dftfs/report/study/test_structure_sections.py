"""The report shows friction and structure where they were computed, and only there."""

from dataclasses import replace

import numpy as np
import pytest

from dftfs.analysis.strength.friction_loop import FrictionLoop, loop_checks
from dftfs.analysis.structure.buckling import Stability, StabilityState
from dftfs.analysis.structure.lateral import LateralState
from dftfs.analysis.structure.modes import Mode, ModeSet
from dftfs.analysis.structure.result import StructureResult, structure_checks, structure_lines
from dftfs.analysis.structure.rim_stiffness import RimStiffness
from dftfs.analysis.torsion.result import ContactOnset
from dftfs.files import as_plain
from dftfs.report.study.render import render_report, report_figures
from tests.cases.report_study import small_study

pytestmark = pytest.mark.needs_cad  # a study holds what its exported files measured


def made_loop() -> FrictionLoop:
    """Torque 1 % wider out than back beyond the touch at -0.2 rad."""
    out = np.linspace(0, -0.28, 15)
    path = np.concatenate([out, out[-2::-1]])
    beyond = np.maximum(-path - 0.2, 0)
    side = np.concatenate([np.full(15, 1.0), np.full(14, -1.0)])
    side[14] = 0.0
    smooth = 66.0 * path - 30 * beyond
    torque = smooth - side * 0.7 * beyond
    work = float(np.sum(np.diff(path) * (torque[1:] + torque[:-1]) / 2))
    return FrictionLoop(
        coefficient=0.2,
        deflection_rad=path,
        torque_Nm=torque,
        frictionless_Nm=smooth,
        dissipated_J=np.linspace(0, work, len(path)),
        stored_J=np.zeros(len(path)),
        strain_energy_J=2.7,
        onset=ContactOnset(deflection_rad=-0.2, torque_Nm=-13.2, at_m=(0.05, -0.04)),
        penetration_m=4e-6,
    )


def made_structure(unstable: int = 0) -> StructureResult:
    """Figures of the size that al1 has."""
    states = tuple(
        StabilityState(
            deflection_rad=-0.1 * k,
            torque_Nm=-6.6 * k,
            lowest_per_s2=5e5 if k < 2 or not unstable else -1e5,
            unstable=unstable if k == 2 else 0,
        )
        for k in range(3)
    )
    return StructureResult(
        rim=RimStiffness(matrix=np.diag([34e3, 43e3, 11.7e3, 45.0, 47.0, 66.0])),
        lateral=(
            LateralState(
                deflection_rad=0.0, softest_N_per_m=34e3, stiffest_N_per_m=43e3, force_N=0.0
            ),
        ),
        modes=(
            ModeSet(
                boundary="rim and hub locked",
                modes=(Mode(frequency_Hz=112.0, parity="out of the plane", turning=0.0),),
            ),
        ),
        stability={
            "unwinding": Stability(
                states=states, critical_rad=-0.18 if unstable else None, extrapolated=False
            )
        },
        mass_kg=0.286,
        inertia_kg_m2=1.2e-3,
        energy_J={"unwinding": 1.35},
    )


def test_page_shows_loop_and_structure_only_where_they_were_computed(tmp_path):
    plain = small_study(tmp_path)
    study = replace(plain, friction_loop=made_loop(), structure=made_structure())
    figures = report_figures(study)
    assert "friction-loop" in figures
    with_both = render_report(study, tmp_path, figures)
    without = render_report(plain, tmp_path, figures)
    for section in ('id="friction"', 'id="structure"'):
        assert section in with_both
        assert section not in without
    assert "Stiffness of the rim against the hub" in with_both
    assert "112" in with_both
    assert "loss factor" in with_both


def test_loop_of_made_up_torques_has_its_area_as_work_and_its_widest_place():
    loop = made_loop()
    # a triangle to the widest place, and back to nothing at the turning point
    assert loop.external_work_J == pytest.approx(0.7 * 0.06**2 + 0.084 * 0.02 / 2, rel=1e-9)
    width, at = loop.widest
    assert at == pytest.approx(-0.26)
    assert width == pytest.approx(2 * 0.7 * 0.06)
    assert loop_checks(loop)[1].passed
    wrong = replace(loop, dissipated_J=1.1 * loop.dissipated_J)
    assert loop_checks(wrong)[1].passed is False


def test_a_spring_that_tips_over_fails_its_check_and_says_where():
    assert structure_checks(made_structure())[0].passed
    check = structure_checks(made_structure(unstable=1))[0]
    assert check.passed is False
    assert "-0.180 rad" in check.note
    assert any(
        "tips" in line or "stays in its plane" in line for line in structure_lines(made_structure())
    )


def test_a_study_fails_where_its_spring_tips_below_the_operating_torque(tmp_path):
    plain = small_study(tmp_path)
    design, names = plain.design, ("stays in its plane, unwinding",)
    for torque, passed in ((5.0, True), (12.5, False)):  # stability is lost at 0.18 rad, 11.9 Nm
        needs = replace(design.requirements, operating_torque_Nm=torque)
        study = replace(
            plain,
            design=replace(design, requirements=needs),
            structure=made_structure(unstable=1),
        )
        found = {c.name: c.passed for c in study.judged if c not in plain.checks}
        assert found == dict.fromkeys(names, passed)
    assert plain.judged == plain.checks


def test_records_are_plain_data():
    record = as_plain(made_structure().record)
    assert record["rim_stiffness"]["order"] == ["x", "y", "z", "rx", "ry", "rz"]
    assert record["energy_per_mass_J_per_kg"]["unwinding"] == pytest.approx(1.35 / 0.286)
    assert as_plain(made_loop().record)["dissipated_per_cycle_J"] > 0
