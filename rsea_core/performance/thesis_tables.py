"""The thesis' numbers of its controllers: printed, recomputed, verdict, erratum.

What is arithmetic is recomputed from the thesis' own other numbers; what is a law is evaluated;
what is a simulation is run with this package's engines under the conditions that are said with
it, because the thesis states neither references, loads nor units. Nothing is tuned to reach a
printed number. Verdicts: "reproduced" within the tolerance; "order reproduced" where only the
order of several numbers can be compared; "inconsistent" with other numbers of the thesis;
"impossible" whatever the conditions; "not reproducible" where conditions are unstated and this
plant gives something else.
"""

import math
from dataclasses import replace

import numpy as np

import rsea_core.engines.event_driven.states as kernel
from rsea_core.control.closed_loop import simulate_closed_loop
from rsea_core.control.fuzzy.rule_base_checks import check_rule_base
from rsea_core.control.fuzzy.thesis_rules import printed_rules, torque_table
from rsea_core.control.laws.impedance import HybridImpedance
from rsea_core.control.laws.pid import PidTorque
from rsea_core.control.stability.describing_functions import amplitude_margins
from rsea_core.control.stability.margins import loop_margins
from rsea_core.control.tuning.optimisers import CHI
from rsea_core.engines.linear.linearise import linearise
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.performance.thesis_arithmetic import (
    TABLE_4_6,
    TABLE_5_7,
    TABLE_5_10,
    TUNED_GAINS,
    arithmetic_rows,
)
from rsea_core.performance.thesis_row import MEASURED, ORDER, REPRODUCED, ThesisRow, row
from rsea_core.simulation.reference import AngleReference
from rsea_core.simulation.step_response import step_shape

ENVIRONMENTS = {"soft": 10.0, "medium": 25.0, "hard": 50.0}  # Nm/rad, ours: the thesis says <= 50
EXPONENTS = {  # Table 4.5: alpha, beta, gamma, delta
    "soft": (0.3821, 0.7508, 0.7958, 0.6824),
    "medium": (0.4249, 0.7939, 0.7944, 0.7079),
    "hard": (0.4650, 0.8142, 0.7891, 0.7031),
}
TABLE_4_1 = {"PID": (2.31, 1.74, 3.89), "PID-FF": (2.50, 1.32, 3.27)}
TABLE_5_3 = {"PID-FFC": 0.101952, "FL-FFC": 0.089924, "FTC-FC": 0.085806}
TABLE_5_8 = (
    ("FHIC-S", "HIC", 10.48, 16.32),
    ("FHIC-S", "PD", 11.23, 23.54),
    ("FHIC-M", "HIC", 14.08, 20.48),
    ("FHIC-M", "PD", 14.85, 27.95),
    ("FHIC-H", "HIC", 11.33, 18.98),
    ("FHIC-H", "PD", 13.53, 26.36),
)
TABLE_5_9 = {  # gain margin dB, its rad/s, phase margin deg, its rad/s
    "soft": (2.02, 1.14, 58.1, 1.76),
    "medium": (2.8, 0.978, 48.4, 2.01),
    "hard": (4.1, 0.72, 59.2, 3.58),
}
TABLE_5_11 = (
    ("AFHI", "HI", 11.38, 18.15),
    ("AFHI", "FHI-S", 6.84, 12.37),
    ("AFHI", "FHI-M", 6.03, 9.26),
    ("AFHI", "FHI-H", 7.55, 15.54),
    ("FHI-M", "HI", 8.46, 13.51),
    ("FHI-M", "FHI-S", 6.17, 10.80),
    ("FHI-M", "FHI-H", 7.25, 12.72),
)
MARGIN_AMPLITUDE_deg = 5.0


def control_rows() -> tuple[ThesisRow, ...]:
    """All rows, in the order of the tables; three simulations of a few seconds."""
    return (
        *arithmetic_rows(),
        *_position_loop(),
        *_torque_loop(),
        *_fuzzy(),
        *_exchanged_columns(),
        *_swarm(),
        *_settling(),
        *_table_5_3(),
        *_improvements(),
        *_margins(),
    )


def _position_loop() -> list[ThesisRow]:
    """Gains of Table 4.1 on the free pendulum, linear and continuous, in both readings of its unit.

    u = K_p e + K_i int e + K_d e' of the load's angle; feedforward does not move a pole.
    """
    rig = replace(Rig.preset("rsea-bench"), motor_inertia_kgm2=1.7e-5)
    machine = linearise(ActuatorModel(rig), load=Load(kind="pendulum"))
    rows = []
    for name, gains in TABLE_4_1.items():
        for reading, per_rad in (("duty per rad", 1.0), ("% of PWM per deg", 180 / math.pi / 50)):
            kp, ki, kd = (per_rad * gain for gain in gains)
            n = kernel.N_STATES
            A = np.zeros((n + 1, n + 1))
            A[:n, :n], A[n, kernel.TL] = machine.A, 1.0
            feedback = np.zeros(n + 1)
            feedback[[kernel.TL, kernel.WL, n]] = kp, kd, ki
            A[:n] -= np.outer(machine.b, feedback)
            fastest = float(np.linalg.eigvals(A).real.max())
            rows.append(
                ThesisRow(
                    table="4.1",
                    what=f"largest real part of a pole, {name} {gains}, {reading} (J_m 1.7e-5)",
                    line=1001,
                    printed=None,
                    recomputed=fastest,
                    unit="1/s",
                    verdict="stable" if fastest < 0.0 else "unstable",
                    note="output unit not stated; joint angle fed back, no delay, no friction",
                )
            )
    return rows


def _exchanged_columns() -> list[ThesisRow]:
    """Whether Table 4.2's columns ZE and PS are exchanged: how much is then in order."""
    printed = printed_rules()
    repaired = printed[:, [0, 1, 2, 4, 3, 5, 6]]
    rows = []
    for what, rules in (("as printed", printed), ("with columns ZE and PS exchanged", repaired)):
        falling = int((np.diff(rules, axis=1) <= 0).all(axis=1).sum())
        rows.append(
            ThesisRow(
                table="4.2",
                what=f"rows of rules in order, {what}, of 7",
                line=1152,
                printed=7.0,
                recomputed=float(falling),
                unit="1",
                verdict=REPRODUCED if falling == len(rules) else "misprint",
                errata="" if falling == len(rules) else "C6",
            )
        )
    return rows


def _torque_loop() -> list[ThesisRow]:
    """The gains of 4.3.1 as Nm per Nm at the joint: are they stable at the stated 1 kHz?"""
    rig = replace(Rig.preset("rsea-bench"), motor_inertia_kgm2=1.7e-5)
    rows = []
    for tick, at in ((1e-3, "1 kHz"), (0.016, "62.5 Hz")):
        law = PidTorque(kp=2.16, ki=1.12, kd=2.59, sample_time_s=tick, back_emf="none",
                        delay_samples=0)  # fmt: skip
        radius = loop_margins(ActuatorModel(rig), law, Load(kind="locked")).pole_radius
        rows.append(
            ThesisRow(
                table="4.3.1",
                what=f"pole radius of PID-FFC 2.16/1.12/2.59 at {at} (J_m 1.7e-5)",
                line=1047,
                printed=None,
                recomputed=radius,
                unit="1",
                verdict="stable" if radius < 1.0 else "unstable",
                errata="C1",
                note="read as Nm/Nm, 1/s and s at the joint",
            )
        )
    return rows


def _fuzzy() -> list[ThesisRow]:
    """What is wrong in Tables 4.2 and 4.3, by the linter."""
    found = {f.check: f for f in check_rule_base(torque_table("printed")) if f.severity == "fault"}
    rows = []
    for table, check, line, errata in (
        ("4.2", "rules monotone", 1152, "C6"),
        ("4.2", "rules symmetric", 1152, "C6"),
        ("4.3", "bias", 1171, "C9"),
        ("4.3", "order", 1168, "C8"),
        ("4.3", "coverage", 1168, "C8"),
        ("4.3", "sets symmetric", 1171, "C9"),
    ):
        rows.append(
            ThesisRow(
                table=table,
                what=found[check].sentence,
                line=line,
                printed=None,
                recomputed=found[check].value,
                unit="1",
                verdict="misprint" if check != "bias" else "inconsistent",
                errata=errata,
            )
        )
    return rows


def _swarm() -> list[ThesisRow]:
    return [
        ThesisRow(
            table="4.4",
            what="chi of 4.37 for phi 2.05 + 2.05 (phi is not printed)",
            line=1375,
            printed=None,
            recomputed=CHI,
            unit="1",
            verdict="not reproducible",
            errata="C26",
            note="iterations and phi are not stated; 40 and 4.1 are assumed here",
        )
    ]


def environment(stiffness_Nm_per_rad: float) -> Load:
    """The contact that the impedance tables are tried on; the thesis states none."""
    return Load(
        kind="contact",
        contact_stiffness_Nm_per_rad=stiffness_Nm_per_rad,
        contact_angle_rad=math.radians(5.0),
        contact_damping_Nms_per_rad=0.3,
    )


def _settling() -> list[ThesisRow]:
    """Settling of FHIC on three environments: gains of Table 5.12, exponents of Table 4.5."""
    rig = replace(Rig.preset("rsea-bench"), load_inertia_kgm2=0.1, load_viscous_Nms_per_rad=0.5)
    height = math.radians(20.0)
    step = AngleReference(kind="step", amplitude_rad=height)
    found: dict[str, list[tuple[float, float, float]]] = {"position": [], "force": []}
    for name, stiffness in ENVIRONMENTS.items():
        alpha, beta, gamma, delta = EXPONENTS[name]
        law = HybridImpedance(alpha=alpha, beta=beta, gamma=gamma, delta=delta, force_N=20.0)
        ran = simulate_closed_loop(
            ActuatorModel(rig), law, step, environment(stiffness), duration_s=4.0
        )
        wanted = (math.degrees(0.5 * height), 0.5 * 20.0)  # S = 0.5 of both references
        signals = (np.degrees(ran.load_angle_rad), law.force_per_torque_per_m * ran.torque_Nm)
        for times, signal, asked in zip(found.values(), signals, wanted, strict=True):
            own = step_shape(ran.time_s, signal, followed=asked)
            settling = math.nan if own.settling_to_final_s is None else own.settling_to_final_s
            times.append((own.overshoot_percent, settling, abs(own.final - asked)))
    return [row for what, figures in found.items() for row in _settled(what, figures)]


def _settled(what: str, figures: list[tuple[float, float, float]]) -> list[ThesisRow]:
    """Rows of overshoot, settling and steady error of the position or the force."""
    rows, column = [], ("position", "force").index(what)
    columns = (("overshoot", "%"), ("settling", "s"), ("steady error", "deg"))
    for k, (name, unit) in enumerate(columns):
        printed = [TABLE_4_6[mode][column][k] for mode in ENVIRONMENTS]
        ours = [each[k] for each in figures]
        same = bool((np.argsort(ours) == np.argsort(printed)).all())
        if (name, what) == ("steady error", "force"):
            unit = "N"
        for mode, shown, value in zip(ENVIRONMENTS, printed, ours, strict=True):
            rows.append(
                ThesisRow(
                    table="5.4-5.6",
                    what=f"{name} of {what}, {mode}",
                    line=1737,
                    printed=shown,
                    recomputed=value,
                    unit=unit,
                    verdict=ORDER if same else "not reproducible",
                    note="gains of Table 5.12 (2.175, 0.251), exponents of Table 4.5, S = 0.5, step"
                    f" of 20 deg against {ENVIRONMENTS[mode]:g} Nm/rad at 5 deg, f_r 20 N: ours",
                )
            )
    return rows


def _table_5_3() -> list[ThesisRow]:
    fuzzy = 100.0 * (1.0 - TABLE_5_3["FL-FFC"] / TABLE_5_3["PID-FFC"])
    friction = 100.0 * (1.0 - TABLE_5_3["FTC-FC"] / TABLE_5_3["FL-FFC"])
    rows = [
        row(
            1e-3, "inconsistent", table="5.3", what=what, line=1687, printed=printed,
            recomputed=found, unit="%", errata="R3",
        )
        for what, printed, found in (
            ("RMSE of FL-FFC below PID-FFC", 11.84, fuzzy),
            ("RMSE of FTC-FC below FL-FFC", 4.75, friction),
        )
    ]  # fmt: skip
    rows.append(
        ThesisRow(
            table="5.3",
            what="order of RMSE PID-FFC > FL-FFC > FTC-FC",
            line=1690,
            printed=None,
            recomputed=None,
            unit="1",
            verdict="see benchmarks/table_5_3.py",
            note="over seeds, frictions and ticks, with the controller that the thesis leaves out",
        )
    )
    return rows


def _improvements() -> list[ThesisRow]:
    """Tables 5.8 and 5.11 as (old - new) / old of the tables that they are said to come from."""
    rows = []
    for table, source, of, line, errata in (
        ("5.8", TABLE_5_7, TABLE_5_8, 1802, "R1"),
        ("5.11", TABLE_5_10, TABLE_5_11, 1845, "R2"),
    ):
        for better, worse, *printed in of:
            for k, what in enumerate(("position", "force")):
                old, new = source[worse][k], source[better][k]
                text = f"{better} against {worse}, {what}"
                rows.append(
                    row(
                        0.01, "inconsistent", table=table, what=text, line=line,
                        printed=printed[k], recomputed=100.0 * (old - new) / old, unit="%",
                        errata=errata,
                        note=f"divided by the new value: {100.0 * (old - new) / new:.2f} %",
                    )
                )  # fmt: skip
    return rows


def _margins() -> list[ThesisRow]:
    """Table 5.9: margins of a power law hold at an amplitude; ours at 5 degrees, free load."""
    model, free = ActuatorModel(Rig.preset("rsea-bench")), Load(kind="free")
    rows = []
    for name, (gain, at_gain, phase, at_phase) in TABLE_5_9.items():
        alpha, beta, gamma, delta = EXPONENTS[name]
        kv, kp = TUNED_GAINS[name]
        law = HybridImpedance(kv=kv, kp=kp, alpha=alpha, beta=beta, gamma=gamma, delta=delta)
        found = amplitude_margins(law, model, free, amplitude=math.radians(MARGIN_AMPLITUDE_deg))
        clash = at_gain < at_phase and gain > 0.0 and phase > 0.0
        note = f"at {MARGIN_AMPLITUDE_deg:g} deg with the gains of Table 4.5 in App. A's units"
        for what, printed, value, unit in (
            ("gain margin", gain, found.gain_margin_dB, "dB"),
            (
                "frequency of its gain margin",
                at_gain,
                2.0 * math.pi * found.gain_margin_Hz,
                "rad/s",
            ),
            ("phase margin", phase, found.phase_margin_deg, "deg"),
            (
                "frequency of its phase margin",
                at_phase,
                2.0 * math.pi * found.crossover_Hz,
                "rad/s",
            ),
        ):
            rows.append(
                ThesisRow(
                    table="5.9",
                    what=f"FHIC {name}: {what}",
                    line=1814,
                    printed=printed,
                    recomputed=value,
                    unit=unit,
                    verdict="impossible" if clash else "not reproducible",
                    errata="C30",
                    note=f"{note}; the printed crossovers contradict two positive margins",
                )
            )
    rows += [
        ThesisRow(
            table="5.9", what=f"{name}: gain margin", line=1820, printed=printed, recomputed=None,
            unit="dB", verdict=MEASURED, note="no gains of it are printed",
        )
        for name, printed in (("HIC", 8.5), ("PD", 10.6))
    ]  # fmt: skip
    return rows
