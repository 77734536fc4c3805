"""A rig file states known physics as [[term]]: what it says is free within its tolerance."""

import tomllib

import numpy as np
import pytest

from rsea_core.effects.registry import LAWS, DriveDelay, GearFriction, LoadFriction, MotorCogging
from rsea_core.errors import TermError
from rsea_core.identify.candidates.typical_magnitudes import typical_magnitudes_of
from rsea_core.machine.rig import Rig
from rsea_core.terms.known import USUAL_TOLERANCE, KnownTerm, is_stateable, known_terms
from tests.cases.one_axis import axis_case, axis_recording, axis_rig

BENCH = Rig.preset("rsea-bench")
FRICTION = 'effect = "load-friction"\ncoulomb_Nm = 0.2\n'


def read(text: str, rig: Rig = BENCH) -> tuple[KnownTerm, ...]:
    return known_terms(tomllib.loads(text), rig, "rig.toml")


def one(text: str, rig: Rig = BENCH) -> KnownTerm:
    (known,) = read("[[term]]\n" + text, rig)
    return known


def law_of(known: KnownTerm, folder):
    """The law on an axis of which one recording was made."""
    case = axis_case(folder, axis_recording(seed=1), rig=axis_rig())
    return known.law(typical_magnitudes_of(case))


def free(law) -> dict:
    return {u.name: u for u in law.unknowns if u.scale > 0.0}


def test_a_term_is_what_the_table_says_with_a_tolerance():
    known = one(FRICTION)
    assert known.term == LoadFriction(coulomb_Nm=0.2)
    assert known.stated == ("coulomb_Nm",)
    assert known.tolerance == USUAL_TOLERANCE == 0.5
    assert one(FRICTION + "tolerance = 0.1").tolerance == 0.1
    assert read("") == ()
    assert [k.term.effect for k in read(
        "[[term]]\n" + FRICTION + '[[term]]\neffect = "gear-friction"\ncoulomb_Nm = 0.01\n'
    )] == ["load-friction", "gear-friction"]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('effect = "gear-fricton"', "unknown effect 'gear-fricton'; the nearest known one is 'gea"),
        ("coulomb_Nm = 0.1", "needs effect, the name of one of"),
        ('effect = "gear-friction"', r"term 1 \(gear-friction\): lacks coulomb_Nm"),
        ('effect = "gear-friction"\ncoulomb = 1', r"\(gear-friction\): unknown key 'coulomb'; the"
         " nearest known one is 'coulomb_Nm'"),
        (FRICTION + 'law = "coulomb"', r"\(load-friction\): unknown law 'coulomb'; the nearest"),
        ('effect = "gear-friction"\ncoulomb_Nm = -1', r"coulomb_Nm = -1\.0 is outside"),
        (FRICTION + "tolerance = 0", r"\(load-friction\): tolerance = 0 must be above 0"),
        (FRICTION + "tolerance = -0.1", r"\(load-friction\): tolerance = -0\.1 must be above 0"),
        (FRICTION + 'tolerance = "half"', r"\(load-friction\): tolerance = 'half' must be a num"),
        ('effect = "sensor-offset"\ncolumn = "torque_Nm"\noffset = 0.1', r"\(sensor-offset\): a "
         "rig file can state drive-dead-zone, .*gear-friction, .*load-friction"),
        ('effect = "spring-curve"\ndeflection_rad = [-0.1, 0, 0.1]\ntorque_Nm = [-1, 0, 1]',
         r"\(spring-curve\): a rig file can state"),
        ('effect = "gear-backlash"\nwidth_rad = 0.01', r"\(gear-backlash\): a rig file can state"),
        ('effect = "drive-offset"\noffset = 0.01', r"\(drive-offset\): a rig file can state"),
        ('effect = "load-disturbance"\nstart_s = 0\nend_s = 1\npeak_Nm = 1', "a rig file can st"),
        (FRICTION + "normal_lever_m = 0.01", r"\(load-friction\): normal_lever_m: a rig file"),
        (FRICTION + "[[term]]\n" + FRICTION, "term 2: load-friction is there twice: keep one"),
    ],
)  # fmt: skip
def test_what_cannot_be_used_is_one_line_with_file_term_and_key(text, message):
    with pytest.raises(TermError, match=rf"^rig\.toml: .*{message}") as caught:
        one(text)
    assert "\n" not in str(caught.value)


def test_a_table_of_its_own_is_no_list_of_terms():
    with pytest.raises(TermError, match=r"rig\.toml: term must be a list, each one written \[\[t"):
        read("[term]\n" + FRICTION)


def test_a_part_that_the_rig_lacks_has_no_term():
    bare = Rig(name="link", parts=("spring",))
    with pytest.raises(TermError, match=r'\(load-friction\): the rig has no "load"'):
        one(FRICTION, bare)
    with pytest.raises(TermError, match=r'\(gear-friction\): the rig has no "gear"'):
        one('effect = "gear-friction"\ncoulomb_Nm = 0.1', Rig(name="link", parts=("load",)))


def test_a_servos_delay_is_stated_once():
    servo = Rig(name="leg", parts=("drive", "load"), servo="angle", servo_delay_s=0.01)
    with pytest.raises(TermError, match=r"\(drive-delay\): servo_delay_s in \[rig\] states it"):
        one('effect = "drive-delay"\ndelay_s = 0.01', servo)


@pytest.mark.parametrize(
    "effect", ["drive-thermal", "spring-curve", "sensor-scale", "drive-offset"]
)
def test_what_a_diagnosis_estimates_anyway_or_the_past_decides_cannot_be_stated(effect):
    assert not any(map(is_stateable, LAWS[effect].values()))


def test_stated_values_are_free_within_the_tolerance_and_others_are_fixed(tmp_path):
    known = one(FRICTION + "stribeck_rise = 0.4\ntolerance = 0.2\npresliding_rad = 0.001")
    law = law_of(known, tmp_path)
    assert (law.known, law.nuisance, law.effect) == (True, True, "load-friction")
    assert free(law).keys() == {"coulomb_Nm", "stribeck_rise", "presliding_rad"}
    for unknown in free(law).values():
        assert (unknown.log, unknown.prior) == (True, 0.2)
    values = law.values(np.array(law.starts[0]))
    assert values == {name: p.value for name, p in known.term.parameters().items()}


def test_presliding_is_free_unless_it_or_another_form_is_stated(tmp_path):
    assert free(law_of(one(FRICTION), tmp_path)).keys() == {"coulomb_Nm", "presliding_rad"}
    rigid = law_of(one(FRICTION + "presliding_rad = 0"), tmp_path)
    assert free(rigid).keys() == {"coulomb_Nm"}
    bristles = law_of(one(FRICTION + "bristle_rad = 0.002"), tmp_path)
    assert free(bristles).keys() == {"coulomb_Nm", "bristle_rad"}
    assert bristles.values(np.array(bristles.starts[0]))["presliding_rad"] == 0.0


def test_counts_and_what_is_not_above_zero_stay(tmp_path):
    text = 'effect = "motor-cogging"\namplitude_Nm = 0.02\ncycles_per_rev = 84\nphase_rad = -1.0\n'
    known = one(text)
    assert isinstance(known.term, MotorCogging)
    law = law_of(known, tmp_path)
    assert free(law).keys() == {"amplitude_Nm"}
    assert law.values(np.array(law.starts[0]))["cycles_per_rev"] == 84.0


@pytest.mark.parametrize(
    "text",
    [
        FRICTION,
        FRICTION + "presliding_rad = 0.0\ntolerance = 0.25",
        'effect = "gear-friction"\ncoulomb_Nm = 0.01\nasymmetry = -0.125',
        'effect = "spring-hysteresis"\nlaw = "bouc-wen"\n' + "".join(
            f"{name} = {value}\n" for name, value in (
                ("stiffness_Nm_per_rad", 5.0), ("yield_rad", 0.01), ("exponent", 1.5))),
        'effect = "drive-delay"\ndelay_s = 0.002',
    ],
)  # fmt: skip
def test_its_table_reads_back_as_the_same_term(text):
    known = one(text)
    (back,) = read(known.to_toml())
    assert set(back.stated) == set(known.stated)
    assert (back.term, back.tolerance) == (known.term, known.tolerance)


def test_an_import_states_no_default():
    known = KnownTerm(term=GearFriction(coulomb_Nm=0.012), stated=("coulomb_Nm",))
    assert known.to_toml() == '[[term]]\neffect = "gear-friction"\ncoulomb_Nm = 0.012\n'
    assert "tolerance = 0.1" in KnownTerm(
        term=DriveDelay(delay_s=1e-3), stated=("delay_s",), tolerance=0.1
    ).to_toml()  # fmt: skip
