"""Tables of the thesis that arithmetic alone judges: against its own other numbers, or a law.

Nothing is simulated here. A row says what the printed number is held against; "measured" is a
number that no other one of the thesis reaches.
"""

import math

import numpy as np
from numpy.typing import NDArray

from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.performance.table_2_1 import performance_table
from rsea_core.performance.thesis_row import (
    IMPOSSIBLE,
    INCONSISTENT,
    MEASURED,
    MISPRINT,
    NOT_REPRODUCIBLE,
    REPRODUCED,
    ThesisRow,
    row,
)

MODES = ("soft", "medium", "hard")
TUNED_GAINS = {  # Table 4.5: K_v, K_p
    "soft": (1.8403, 10.6224),
    "medium": (2.4681, 11.1753),
    "hard": (3.1305, 13.0491),
}
GAINS_5_12 = (0.251, 2.175)  # K_v, K_p of its cases 2 to 10, "optimised parameters" of chapter 5
TABLE_4_6 = {  # overshoot, settling [s], steady error, RMSE: of position, of force
    "soft": ((0.247, 0.965, 0.0647, 0.202753), (1.247, 1.440, 0.0853, 0.33931)),
    "medium": ((2.601, 0.937, 0.0538, 0.196358), (1.518, 0.817, 0.0604, 0.32761)),
    "hard": ((1.247, 0.621, 0.077, 0.198633), (5.247, 0.846, 0.0710, 0.33174)),
}
EXPERIMENT = {  # Tables 5.4 to 5.6, "experiment": overshoot [%], settling [s], steady error
    "soft": ((4.521, 0.971, 0.0735), (3.521, 1.465, 0.0881)),
    "medium": ((12.835, 0.941, 0.0551), (4.370, 0.825, 0.0611)),
    "hard": ((3.521, 0.681, 0.065), (8.521, 0.920, 0.0731)),
}
TABLE_5_7 = {
    "FHIC-S": (0.202753, 0.33931),
    "FHIC-M": (0.196358, 0.32761),
    "FHIC-H": (0.198633, 0.33174),
    "HIC": (0.224021, 0.39471),
    "PD": (0.225524, 0.41920),
}
TABLE_5_10 = {
    "HI": (0.23821, 0.58727),
    "FHI-S": (0.19264, 0.42793),
    "FHI-M": (0.20486, 0.54835),
    "FHI-H": (0.23715, 0.58321),
    "AFHI": (0.18417, 0.37423),
}
RULES_4_7 = ("00112", "00112", "01123", "11233", "12234")  # VST, SFT, MDM, HRD, VHD as 0 to 4
FRICTION_3_1 = {"f_v": 2.910e-2, "f_a": 3.1413e-1, "f_b": 1.3905e-2, "f_c": 6.1431e-4}
SPEED_rad_per_s = 1.2  # output speed of Table 2.1
CASES_5_12 = (  # SEL, K_p, K_v, alpha, beta, gamma, delta
    (0, 0, 0, 0, 0, 0, 0),
    *((0.5, 2.175, 0.251, *powers) for powers in (
        (0.5, 0.5, 0.5, 0.5), (1, 1, 1, 0.5), (0, 1, 1, 0.5), (0, 1, 0, 0.5), (0, 1, 1, 0),
        (0, 1, 1, 1))),
    (0, 2.175, 0.251, 0, 1, 1, 1), (0, 2.175, 0.251, 0.5, 0.5, 0.5, 0.5),
    (0.5, 2.175, 0.251, 0.5, 1, 1, 1),
    *((0.5, 2.280, 0.345, *powers) for powers in (
        (1, 1, 1, 1), (0, 1, 1, 1), (0, 0, 1, 1), (0, 0, 0, 1), (0, 0, 0, 0))),
    *((1, 2.280, 0.345, *powers) for powers in (
        (0, 0, 0, 0), (0, 1, 0, 0), (0, 1, 1, 0), (0, 1, 0, 1), (0, 1, 0, 1))),
)  # fmt: skip


def arithmetic_rows() -> tuple[ThesisRow, ...]:
    """The rows of Tables 2.1, 2.8, 3.1, 4.5 to 4.7, 5.1, 5.2, 5.7, 5.10 and 5.12."""
    return (
        *_table_2_1(),
        *_table_2_8(),
        *_table_3_1(),
        *_table_4_5(),
        *_table_4_6(),
        *_table_4_7(),
        *_table_5_1(),
        *_table_5_2(),
        *_experiments(),
        *_table_5_7(),
        *_table_5_10(),
        *_table_5_12(),
    )


def _table_2_1() -> list[ThesisRow]:
    """Goals, on the nominal machine without losses in its gear."""
    found = performance_table(ActuatorModel(Rig.preset("rsea-bench")))
    return [
        ThesisRow(
            table="2.1", what=f"{r.name}: {r.definition}", line=375, printed=r.thesis,
            recomputed=r.value, unit=r.unit, verdict=r.verdict, note=r.why,
        )
        for r in found
        if r.thesis is not None
    ]  # fmt: skip


def _transform(alpha: float, a: float, d: float, theta: float) -> NDArray:
    """Craig's modified Denavit-Hartenberg transform."""
    c, s, ca, sa = math.cos(theta), math.sin(theta), math.cos(alpha), math.sin(alpha)
    return np.array(
        [[c, -s, 0, a], [s * ca, c * ca, -sa, -sa * d], [s * sa, c * sa, ca, ca * d], [0, 0, 0, 1]]
    )


def _table_2_8() -> list[ThesisRow]:
    """Table 2.8's product against eq. 2.13, at angles and lengths that hide nothing."""
    t1, t2, t3, d0, d1, d2, d3 = 0.3, 0.5, 0.7, 0.11, 0.13, 0.17, 0.19
    steps = ((0, 0, d0, t1), (math.pi / 2, d1, 0, t2), (0, 0, d2, t3), (0, d3, 0, 0))
    right = np.linalg.multi_dot([_transform(*step) for step in steps])
    c1, s1, c23, s23 = math.cos(t1), math.sin(t1), math.cos(t2 + t3), math.sin(t2 + t3)
    printed = np.array(
        [[c1 * s23, c1 * c23, -c1 * s23], [s1 * s23, s1 * c23, -s1 * s23], [-c23, s23, c23]]
    )
    place = np.array(
        [d1 * c1 + d2 * s1 + d3 * c1 * c23, d1 * s1 - d2 * c1 + d3 * s1 * c23, d0 + d3 * s23]
    )
    off = float(np.abs(place - right[:3, 3]).max())
    common = {"table": "2.8", "line": 696, "unit": "1"}
    return [
        ThesisRow(
            what="determinant of the rotation in 0T4 as eq. 2.13 prints it, against the product of"
            " Table 2.8's transforms", printed=float(np.linalg.det(printed)),
            recomputed=float(np.linalg.det(right[:3, :3])), verdict=MISPRINT, errata="D4",
            note="its first and third columns are the same but for the sign", **common,
        ),
        ThesisRow(
            what="largest difference of eq. 2.13's position from the product", printed=0.0,
            recomputed=off, verdict=REPRODUCED if off < 1e-12 else INCONSISTENT, **common,
        ),
    ]  # fmt: skip


def _table_3_1() -> list[ThesisRow]:
    """f_b is a share of a speed: per rad/s or per deg/s."""
    f, speed = FRICTION_3_1, SPEED_rad_per_s
    common = {"table": "3.1", "line": 958, "errata": "F4"}
    per_rad, per_deg = (
        f["f_a"] * math.atan(f["f_b"] * w) for w in (speed, math.degrees(speed))
    )  # fmt: skip
    return [
        ThesisRow(
            what=f"f_a atan(f_b w) at {speed:g} rad/s, f_b per {unit}", printed=None,
            recomputed=value, unit="Nm", verdict=verdict, note=note, **common,
        )
        for unit, value, verdict, note in (
            ("rad/s", per_rad, IMPOSSIBLE, "f_b is printed in Nm; f_a f_b and f_v are then one"
             " damping and cannot be distinguished"),
            ("deg/s", per_deg, "conditional", "the reading in which the term has an effect; the log"
             " is in degrees"),
        )
    ] + [
        ThesisRow(
            what="share of f_a f_b in the damping f_v + f_a f_b, f_b per rad/s", printed=None,
            recomputed=f["f_a"] * f["f_b"] / (f["f_v"] + f["f_a"] * f["f_b"]), unit="1",
            verdict=NOT_REPRODUCIBLE, note="identifiable only as a sum", **common,
        ),
        ThesisRow(
            what="Coulomb friction f_c of a worm gear that carries up to 25 Nm",
            printed=f["f_c"], recomputed=None, unit="Nm", verdict=MEASURED,
            note="the law has no friction that grows with the load: implausible for a worm",
            **common,
        ),
    ]  # fmt: skip


def _table_4_5() -> list[ThesisRow]:
    """Gains that PSO found, against those that chapter 5 calls the optimised ones."""
    rows = []
    for mode, gains in TUNED_GAINS.items():
        for name, printed, other in zip(("K_v", "K_p"), gains, GAINS_5_12, strict=True):
            rows.append(
                row(
                    0.05, INCONSISTENT, table="4.5", what=f"{name}, {mode}, against Table 5.12",
                    line=1422, printed=printed, recomputed=other, unit="1", errata="C26",
                    note="the experiments of chapter 5 state these; units depend on the exponents"
                    " (C19)",
                )
            )  # fmt: skip
    return rows


def _table_4_6() -> list[ThesisRow]:
    rows = []
    for number, (mode, both) in enumerate(TABLE_4_6.items()):
        source = list(TABLE_5_7.values())[number]
        for k, (what, figures) in enumerate(zip(("position", "force"), both, strict=True)):
            rows.append(
                row(
                    1e-9, INCONSISTENT, table="4.6", what=f"RMSE of {what}, {mode}, against 5.7",
                    line=1457, printed=figures[3], recomputed=source[k], unit="deg",
                    note="called simulation here, experiment against simulation there (R4); that"
                    " of a force is printed in degrees (C27)",
                )
            )  # fmt: skip
            rows.append(
                ThesisRow(
                    table="4.6", what=f"overshoot of {what}, {mode}, printed in deg; the same"
                    " number stands in Tables 5.4-5.6 in %", line=1457, printed=figures[0],
                    recomputed=0.01 * figures[0] * 20.0, unit="deg", verdict=INCONSISTENT,
                    note="recomputed: that percentage of a step of 20 deg, which is our assumption",
                )
            )  # fmt: skip
    return rows


def _table_4_7() -> list[ThesisRow]:
    rules = np.array([[int(c) for c in line] for line in RULES_4_7])
    common = {"table": "4.7", "line": 1487, "unit": "1", "errata": ""}
    note = "both axes are called K_e, VHN stands for VHH, tables of beta and gamma are absent (C28)"
    return [
        row(
            0.0, MISPRINT, what=f"{what} of rules in order, of 5", printed=5.0,
            recomputed=float((np.diff(rules, axis=axis) >= 0).all(axis=axis).sum()), note=note,
            **common,
        )
        for what, axis in (("rows", 1), ("columns", 0))
    ]  # fmt: skip


def _table_5_1() -> list[ThesisRow]:
    """The motor's data sheet against itself."""
    k_t, volts, ohm, inertia = 0.38, 48.0, 3.78, 1.7e-5
    k_e = 0.032 * 60.0 / (2.0 * math.pi)
    rows = (
        ("rated torque, K_t I_r", 0.535, k_t * 1.41, "Nm", 0.02, "", ""),
        ("peak torque, K_t I_peak", 1.84, k_t * 4.95, "Nm", 0.03, "", ""),
        ("no-load speed, 48 V over K_v", 1480.0, volts / 0.032, "rpm", 0.02, "", ""),
        ("rated speed, (48 V - R I_r) over K_v", 1280.0, (volts - ohm * 1.41) / 0.032, "rpm", 0.05,
         "", ""),
        ("total weight, stator and rotor", 0.61, 0.43 + 0.18, "kg", 1e-6, "", ""),
        ("K_t against K_v in the same units", k_t, k_e, "Nm/A", 0.02, "D13",
         "the ratio 1.24 is near sqrt(3/2): rms and peak, or phase and line, values"),
        ("mechanical time constant, J R / (K_t K_e)", 0.025, 1e3 * inertia * ohm / (k_t * k_e),
         "ms", 0.05, "D17", ""),
        ("motor constant, K_t / sqrt(R)", 0.063, k_t / math.sqrt(ohm), "Nm/sqrt(W)", 0.05, "D17",
         "printed in Nm/W"),
        ("no-load speed by eq. 5.1 with K_m = 0.063", 1480.0,
         volts / 0.063 * 60.0 / (2.0 * math.pi), "rpm", 0.02, "D16",
         "the motor constant is used in place of the back-EMF constant"),
    )  # fmt: skip
    return [
        row(
            tolerance, INCONSISTENT, table="5.1", what=what, line=1563, printed=printed,
            recomputed=found, unit=unit, errata=errata, note=note,
        )
        for what, printed, found, unit, tolerance, errata, note in rows
    ]  # fmt: skip


def _table_5_2() -> list[ThesisRow]:
    """tan l / tan(l + p) of a worm with friction angle p >= lead angle l is below (1 - tan^2 l)/2.

    Source: any machine design text, such as Shigley's, on power screws.
    """
    lead = math.atan(1.0 / 20.0)  # of one start on a worm 20 modules about: a common one
    highest = 50.0 * (1.0 - math.tan(lead) ** 2)
    return [
        ThesisRow(
            table="5.2", what="lowest efficiency of a worm gear, against the highest possible for a"
            " self-locking one", line=1632, printed=60.0, recomputed=highest, unit="%",
            verdict=IMPOSSIBLE, errata="F7",
            note="the text calls the same gear self-locking, with losses up to 50 %",
        ),
        ThesisRow(
            table="5.2", what="efficiencies, ratios and precisions of the other gears", line=1624,
            printed=None, recomputed=None, unit="1", verdict=MEASURED,
            note="ranges of a catalogue; no other number of the thesis depends on them",
        ),
    ]  # fmt: skip


def _experiments() -> list[ThesisRow]:
    """Rows "experiment" of Tables 5.4 to 5.6, beside their rows "simulation"."""
    names, units = ("overshoot", "settling", "steady error"), ("%", "s", "1")
    return [
        row(
            0.1, MEASURED, table="5.4-5.6", what=f"experiment, {name} of {what}, {mode}, against"
            " the simulation's", line=1753, printed=measured[k], recomputed=simulated[k], unit=unit,
        )
        for mode in MODES
        for what, measured, simulated in zip(
            ("position", "force"), EXPERIMENT[mode], TABLE_4_6[mode], strict=True
        )
        for k, (name, unit) in enumerate(zip(names, units, strict=True))
    ]  # fmt: skip


def _table_5_7() -> list[ThesisRow]:
    rows = []
    for k, what in enumerate(("position", "force")):
        order = sorted(TABLE_5_7, key=lambda name: TABLE_5_7[name][k])
        rows += [
            ThesisRow(
                table="5.7", what=f"place of {name} by its RMSE of {what} (the text: FHIC-M first)",
                line=1787, printed=None, recomputed=float(order.index(name) + 1), unit="1",
                verdict=MEASURED, note=f"RMSE {both[k]:g}; measured quantity not stated (R4)",
            )
            for name, both in TABLE_5_7.items()
        ]  # fmt: skip
    return rows


def _table_5_10() -> list[ThesisRow]:
    """Position in rad, against Table 5.7's in degrees; the fractional ones against the plain."""
    of = {"HI": "HIC", "FHI-S": "FHIC-S", "FHI-M": "FHIC-M", "FHI-H": "FHIC-H"}
    rows = [
        row(
            0.3, INCONSISTENT, table="5.10", what=f"RMSE of position, {name}, against Table 5.7",
            line=1842, printed=math.degrees(TABLE_5_10[name][0]), recomputed=TABLE_5_7[other][0],
            unit="deg", errata="C27",
            note=f"printed {TABLE_5_10[name][0]:g} 'rad'; the same magnitude as the degrees of 5.7",
        )
        for name, other in of.items()
    ]  # fmt: skip
    rows += [
        ThesisRow(
            table="5.10", what="RMSE of position of FHI-M, which the text calls better than FHI-S",
            line=1842, printed=TABLE_5_10["FHI-M"][0], recomputed=TABLE_5_10["FHI-S"][0],
            unit="rad", verdict=INCONSISTENT, errata="R2", note="recomputed is that of FHI-S",
        ),
        ThesisRow(
            table="5.10", what="RMSE of AFHI, the smallest of both columns", line=1842,
            printed=TABLE_5_10["AFHI"][0], recomputed=min(v[0] for v in TABLE_5_10.values()),
            unit="rad", verdict=REPRODUCED,
        ),
    ]  # fmt: skip
    return rows


def _table_5_12() -> list[ThesisRow]:
    powers = [case[3:] for case in CASES_5_12]
    common = {"table": "5.12", "line": 1879, "unit": "1", "errata": "C29"}
    counted = (
        ("different cases, of 20", 20.0, float(len(set(CASES_5_12))), INCONSISTENT,
         "case 20 is case 19"),
        ("cases with a command", 20.0, float(sum(any(c) for c in CASES_5_12)), INCONSISTENT,
         "case 1 is zero throughout"),
        ("cases without a power of zero", 20.0, float(sum(min(p) > 0 for p in powers)),
         NOT_REPRODUCIBLE, "a power of zero is a relay: its output does not depend on the error"),
        ("cases whose reference is followed in full (SEL 1)", 20.0,
         float(sum(c[0] == 1 for c in CASES_5_12)), NOT_REPRODUCIBLE,
         "SEL multiplies the reference: with 0.5 half of it is followed (C17)"),
    )  # fmt: skip
    return [
        row(0.0, otherwise, what=what, printed=printed, recomputed=found, note=note, **common)
        for what, printed, found, otherwise, note in counted
    ]
