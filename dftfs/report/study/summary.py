"""The first screen: the verdict in a sentence and the four numbers that matter."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from dftfs.analysis.strength.checks import Check
from dftfs.analysis.study.result import StudyResult
from dftfs.analysis.torsion.result import SIGN
from dftfs.report.numbers import NOTHING, plain, signed, with_uncertainty

MET, NOT_MET, OPEN = "met", "not met", "open"
_CONTACT = "contact-free torque, "
_SIGN = re.compile(r"(?<![\w.])-(?=\d)")
_TEXTS = {True: "passed", False: "failed", None: "open"}


@dataclass(frozen=True, kw_only=True)
class BigNumber:
    """One number of the first screen: what it is, the number, its unit, a line of explanation."""

    label: str
    value: str
    unit: str
    note: str


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """``status`` is "met", "not met" or "open"."""

    status: str
    sentence: str


def verdict(checks: Sequence[Check]) -> Verdict:
    """The requirements' outcome as one plain sentence."""
    failed = [check for check in checks if check.passed is False]
    open_ones = [check for check in checks if check.passed is None]
    count = len(checks)
    if not checks:
        return Verdict(status=OPEN, sentence="No requirements were stated, so none were judged.")
    unjudged = (
        f" Not judged: {'; '.join(f'{c.name} ({c.note or c.limit})' for c in open_ones)}."
        if open_ones
        else ""
    )
    if failed:
        faults = "; ".join(_fault(check) for check in failed)
        return Verdict(
            status=NOT_MET, sentence=f"Does not meet its requirements: {faults}.{unjudged}"
        )
    if open_ones:
        return Verdict(
            status=OPEN,
            sentence=f"Meets {count - len(open_ones)} of {count} requirements; the rest is"
            f" open.{unjudged}",
        )
    every = f"all {count} requirements" if count > 1 else "its one requirement"
    return Verdict(status=MET, sentence=f"Meets {every}.")


def _fault(check: Check) -> str:
    asked = f"{readable(check.limit)} required"
    value = f"{plain(check.value, 3)} {check.unit}".rstrip()
    if check.name.startswith(_CONTACT):
        return f"coils touch at {value} {check.name.removeprefix(_CONTACT)}, {asked}"
    return f"{check.name} is {value}, {asked}"


def check_text(check: Check) -> str:
    """``passed``, ``failed`` or ``open``."""
    return _TEXTS[check.passed]


def readable(text: str) -> str:
    """A line written for a terminal with the signs of print."""
    return _SIGN.sub("−", text.replace("+-", "±"))


def big_numbers(study: StudyResult) -> tuple[BigNumber, ...]:
    """Stiffness, first contact, safety to yield, mass."""
    return (
        BigNumber(
            label="Torsional stiffness K_s at rest",
            value=with_uncertainty(
                study.solid.stiffness_Nm_per_rad, study.stiffness_uncertainty_Nm_per_rad
            ),
            unit="Nm/rad",
            note=f"{study.solid.model}; ± mesh error only, not material or manufacture",
        ),
        _first_contact(study),
        _safety(study),
        BigNumber(
            label="Mass",
            value=plain(1e3 * study.design.mass_kg, 3),
            unit="g",
            note=f"{study.design.material.name}, {plain(1e6 * study.export.volume_m3, 3)} cm³",
        ),
    )


def _first_contact(study: StudyResult) -> BigNumber:
    values, notes = [], []
    for direction, sign in SIGN.items():
        onset = study.solid.contact_onset.get(direction)
        if onset is None:
            reached = study.solid.torque_Nm[-1 if sign > 0 else 0]
            values.append(NOTHING)
            notes.append(f"{direction}: none up to {signed(float(reached), 3)} Nm")
        else:
            values.append(signed(onset.torque_Nm, 3))
            notes.append(f"{direction}: {signed(onset.deflection_rad, 3)} rad")
    return BigNumber(
        label="First contact, winding / unwinding",
        value=" / ".join(values),
        unit="Nm",
        note="; ".join(notes),
    )


def _safety(study: StudyResult) -> BigNumber:
    asked = study.design.requirements
    strength = study.design.material.yield_strength_Pa
    check = next((c for c in study.checks if c.name == "safety factor to yield"), None)
    if check is not None and check.value is not None:
        stated = "extrapolated" in check.note
        beyond = "" if stated else _beyond_contact(study, asked.operating_torque_Nm)
        return BigNumber(
            label=f"Safety factor to yield at ±{asked.operating_torque_Nm:g} Nm",
            value=plain(check.value, 3),
            unit="",
            note=readable(check.note) + beyond,
        )
    if strength is None:
        reason = study.design.material.no_strengths or "the material has no yield strength"
        return BigNumber(label="Safety factor to yield", value="open", unit="", note=reason)
    worst = int(study.solid.peak_von_mises_Pa.argmax())
    peak, torque = study.solid.peak_von_mises_Pa[worst], study.solid.torque_Nm[worst]
    return BigNumber(
        label="Safety factor to yield at the curve's end",
        value=plain(strength / peak, 3),
        unit="",
        note=f"no operating torque stated; peak {plain(1e-6 * float(peak), 3)} MPa at"
        f" {signed(float(torque), 3)} Nm",
    )


def _beyond_contact(study: StudyResult, torque_Nm: float) -> str:
    """A remark where a direction's contact-free curve ends below a torque."""
    reached = {
        direction: abs(float(study.solid.torque_Nm[-1 if sign > 0 else 0]))
        for direction, sign in SIGN.items()
    }
    short = [direction for direction, most in reached.items() if most < torque_Nm * (1 - 1e-9)]
    return f"; {' and '.join(short)} extrapolated from first contact" if short else ""
