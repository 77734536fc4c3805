"""200 randomly disguised logs: columns renamed, units, signs and rates changed, references added.

    python -m benchmarks.disguised_logs CASES [--logs 200] [--seed 1]

CASES is a folder of practice cases (rig files with a full bench). Each log is one recording of one
case. What `dftfs import --yes` proposes is compared with the truth up to one common sign of the
machine: `right` (all columns), `asked` (a wrong or missing column is one of the questions) or
`wrong` (silently). Prints the counts and every log that is wrong.
"""

import argparse
from pathlib import Path

import numpy as np

from rsea_core.importing.proposal import Proposal, propose
from rsea_core.machine.rig import Rig
from rsea_core.recordings.case import read_case

NAMES = {
    "time_s": ("t", "Time", "timestamp", "time_stamp", "clock", "TIME"),
    "duty": ("duty", "PWM", "pwm_out", "bridge duty", "dutyCycle"),
    "motor_angle_rad": ("motor_pos", "theta_m", "enc_motor", "qm", "MotorAngle", "rotor position"),
    "load_angle_rad": ("load_pos", "theta_l", "enc_out", "ql", "LinkAngle", "output position"),
    "current_A": ("current", "i_motor", "iq", "Imot", "motor current", "amps"),
    "torque_Nm": ("torque", "tau_s", "loadcell", "TorqueSensor", "trq"),
    "temperature_C": ("temp", "motor temperature"),
    "voltage_V": ("u", "voltage", "Vcmd"),
    "current_command_A": ("i_ref", "current_cmd", "iq_des"),
    "motor_velocity_rad_per_s": ("motor_vel", "dqm", "omega_m", "rotor speed"),
}
UNITS = {
    "time_s": (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)),
    "duty": (("", 1.0), ("percent", 0.01)),
    "motor_angle_rad": (("rad", 1.0), ("deg", np.pi / 180), ("turn", 2 * np.pi), ("count", None)),
    "load_angle_rad": (("rad", 1.0), ("deg", np.pi / 180), ("turn", 2 * np.pi), ("count", None)),
    "current_A": (("A", 1.0), ("mA", 1e-3)),
    "torque_Nm": (("Nm", 1.0), ("mNm", 1e-3)),
    "voltage_V": (("V", 1.0), ("mV", 1e-3)),
    "current_command_A": (("A", 1.0), ("mA", 1e-3)),
    "motor_velocity_rad_per_s": (("rad/s", 1.0), ("deg/s", np.pi / 180), ("rpm", np.pi / 30)),
}
FLIPPED = 0.3  # share of columns whose sign is turned
NAMED_UNIT = 0.4  # share of columns whose name says its unit


def disguised(rig: Rig, columns: dict, rng: np.random.Generator):
    """Raw columns, and for each contract column (name, factor to SI with sign)."""
    raw, truth = {}, {}
    stride = int(rng.choice([1, 1, 2]))
    columns = {n: np.asarray(v)[::stride] for n, v in columns.items()}
    time = columns["time_s"]
    if "motor_angle_rad" in columns and rng.random() < 0.5:
        speed = np.gradient(columns["motor_angle_rad"], time)
        columns["motor_velocity_rad_per_s"] = np.convolve(speed, np.ones(9) / 9, mode="same")
    order = ["time_s", *rng.permutation([n for n in columns if n != "time_s"])]
    for name in order:
        word = str(rng.choice(NAMES[name]))
        unit, factor = UNITS.get(name, (("", 1.0),))[rng.integers(len(UNITS.get(name, ((),))))] or (
            "",
            1.0,
        )
        if factor is None:
            side = name.split("_")[0]
            per_turn = getattr(rig, f"{side}_encoder_counts_per_rev") or 4096.0
            factor = 2 * np.pi / per_turn
        sign = -1.0 if name not in ("time_s", "temperature_C") and rng.random() < FLIPPED else 1.0
        values = sign * columns[name] / factor
        side_scale = 1.0
        if name == "motor_angle_rad" and rig.gear_ratio and rng.random() < 0.2 and unit != "count":
            side_scale = rig.gear_ratio
            values = values / side_scale
        if unit == "count":
            values = np.round(values)
        named = rng.random() < NAMED_UNIT and unit
        label = f"{word} [{unit}]" if named else word
        raw[label] = values
        truth[name] = (label, sign * factor * side_scale)
    if rng.random() < 0.5:
        raw["pos_goal"] = np.degrees(np.sin(time))
    if rng.random() < 0.3:
        raw["state"] = np.round(np.abs(np.sin(0.3 * time)))
    return raw, truth


def judged(proposal: Proposal, raw: dict, truth: dict, rig: Rig) -> tuple[str, list[str]]:
    """right, asked or wrong, and what is not right."""
    from rsea_core.recordings.units import factor_and_offset, unit_of_column

    faults, silent, flips = [], [], []
    proposed = {c.name: c for c in proposal.columns}
    for target, (label, factor) in truth.items():
        c = proposed.get(label)
        if c is None:
            asked = any(repr(label) in q for q in proposal.questions)
            faults.append(f"{label}: not recognised as {target}")
            silent += [] if asked else [label]
            continue
        own, _ = factor_and_offset(c.unit, unit_of_column(c.target), c.counts_per_rev,
                                  linear=rig.axis == "linear")  # fmt: skip
        if c.side is not None:
            own *= rig.gear_ratio if c.side == "load" else 1.0 / rig.gear_ratio
        ok = c.target == target and np.isclose(abs(own), abs(factor), rtol=1e-3)
        off = max(abs(own), abs(factor)) * float(np.abs(raw[label]).max())
        still = target == "load_angle_rad" and off <= 2.6 * 2.0 * np.pi / 8192.0
        if c.target == target and (still or not np.any(raw[label])):
            continue  # zero, or zero to two counts of its encoder: so in any unit and sign
        if not ok:
            faults.append(f"{label}: {target} x {factor:.4g} taken for {c.target} in {c.unit}")
            silent += [] if c.asks else [label]
        elif target not in ("time_s", "temperature_C"):
            flips.append((label, c.asks, np.sign(factor) * c.sign))
    common = np.sign(sum(f for _, asks, f in flips if not asks) + 1e-9)
    for label, asks, flip in flips:
        if flip != common:
            faults.append(f"{label}: sign")
            silent += [] if asks else [label]
    return ("wrong" if silent else "asked" if faults else "right"), faults


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", type=Path)
    parser.add_argument("--logs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    cases = [read_case(path) for path in sorted(arguments.cases.iterdir())]
    counts = {"right": 0, "asked": 0, "wrong": 0}
    unasked = 0
    for k in range(arguments.logs):
        case = cases[k % len(cases)]
        r = case.recordings[int(rng.integers(len(case.recordings)))]
        raw, truth = disguised(case.rig, dict(r.columns), rng)
        proposal = propose(raw, {}, case.rig)
        verdict, faults = judged(proposal, raw, truth, case.rig)
        counts[verdict] += 1
        unasked += not proposal.questions
        if verdict != "right":
            print(f"{k} {case.name} {r.file} {r.load.kind}: {verdict}: {'; '.join(faults)}")
    print(f"{counts}; {unasked} of {arguments.logs} without any question")


if __name__ == "__main__":
    main()
