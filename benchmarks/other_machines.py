"""Machines of other kinds, simulated by other means, and what the diagnosis says of them.

One-axis machines in the manner of public benchmarks of system identification are simulated with a
Runge-Kutta method of fourth order on fine steps and smoothed dry friction: nothing of this
program's engines is used. Sources of the equations: Bouc-Wen, Noel & Schoukens, Hysteretic
benchmark with a dynamic nonlinearity (2016); Silverbox, Wigren & Schoukens, ECC 2013; a linear
stage in the manner of EMPS, Janot, Gautier & Brunot (2019).

    python -m benchmarks.other_machines FOLDER [NAME...]
"""

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROLES = ("identification", "identification", "validation")
SHAFT = {
    "parts": ["drive", "gear"], "terminal_resistance_ohm": 2.1, "terminal_inductance_H": 1e-3,
    "torque_constant_Nm_per_A": 0.051, "back_emf_constant_Vs_per_rad": 0.051,
    "motor_inertia_kgm2": 1.9e-4, "gear_ratio": 1.0,
}  # fmt: skip
COUPLED = {
    "parts": ["drive", "gear", "spring", "load"], "gear_ratio": 1.0,
    "motor_inertia_kgm2": 2.05e-3, "motor_viscous_Nms_per_rad": 0.021,
    "spring_stiffness_Nm_per_rad": 1.33, "load_inertia_kgm2": 3.7e-3,
    "load_viscous_Nms_per_rad": 0.004, "motor_encoder_counts_per_rev": 8192,
    "load_encoder_counts_per_rev": 8192,
}  # fmt: skip


def runge_kutta(rate: Callable, start, rows: int, row_s: float, parts: int) -> NDArray:
    """States (rows, n) of x' = rate(row, x) with `parts` steps in a row."""
    x, found, h = np.array(start, float), np.empty((rows, len(start))), row_s / parts
    for row in range(rows):
        found[row] = x
        for _ in range(parts):
            a = rate(row, x)
            b = rate(row, x + 0.5 * h * a)
            c = rate(row, x + 0.5 * h * b)
            d = rate(row, x + h * c)
            x = x + h / 6.0 * (a + 2.0 * b + 2.0 * c + d)
    return found


def multisine(rows: int, rate_Hz: float, band_Hz: tuple, rms: float, seed: int) -> NDArray:
    """A random-phase multisine (rows,)."""
    f = np.fft.rfftfreq(rows, 1.0 / rate_Hz)
    inside = (f >= band_Hz[0]) & (f <= band_Hz[1])
    phases = np.random.default_rng(seed).random(inside.sum())
    spectrum = np.zeros(f.size, complex)
    spectrum[inside] = np.exp(2j * np.pi * phases)
    u = np.fft.irfft(spectrum, rows)
    return u * rms / np.std(u)


def rounded(angle: NDArray, counts: int) -> NDArray:
    """An angle as an encoder gives it."""
    step = 2.0 * np.pi / counts
    return np.round(angle / step) * step


def bouc_wen():
    """m y'' + c y' + k y + z = u with z' of Bouc and Wen, the benchmark's own values."""
    for seed in range(3):
        u = multisine(3000, 750.0, (5.0, 150.0), 50.0, 10 + seed)

        def rate(row, x, u=u):
            y, v, z = x
            turn = 5e4 * v - 1e3 * (0.8 * abs(v) * z - 1.1 * v * abs(z))
            return np.array([v, (u[row] - 10.0 * v - 5e4 * y - z) / 2.0, turn])

        y = runge_kutta(rate, [0.0] * 3, 3000, 1 / 750, 20)[:, 0]
        noise = 8e-6 * np.random.default_rng(seed).standard_normal(3000)
        yield 1 / 750, {"motor_torque_Nm": u, "motor_angle_rad": y + noise}


def silverbox():
    """m y'' + d y' + k y + k3 y^3 = u: resonance near 68 Hz, 610 Hz."""
    w = 2.0 * np.pi * 68.0
    for seed in range(3):
        u = multisine(4000, 610.35, (1.0, 200.0), 0.0223, 20 + seed)
        u = u * (1.0 if seed else np.linspace(0.3, 1.2, 4000))

        def rate(row, x, u=u):
            force = u[row] - 0.0466 / w * x[1] - x[0] - 3.9 * x[0] ** 3
            return np.array([x[1], force * w**2])

        y = runge_kutta(rate, [0.0, 0.0], 4000, 1 / 610.35, 20)[:, 0]
        noise = 2e-4 * np.random.default_rng(seed).standard_normal(4000)
        yield 1 / 610.35, {"motor_torque_Nm": u, "motor_angle_rad": y + noise}


def shaft(*, coulomb=0.0, static=None, viscous=1e-5, drag=0.0, mean=0.0, velocity=False):
    """A direct-current motor under voltage, 500 Hz; current and angle or speed are read."""
    static, t = static or coulomb, np.arange(3000) / 500.0
    commands = (
        np.sin(0.8 * np.pi * t),
        np.sign(np.sin(np.pi * t)),
        np.sin(0.4 * np.pi * (1 + t) * t),
    )
    for seed, wave in enumerate(commands):
        u = mean + (4.0 if mean else 3.5) * wave
        rng = np.random.default_rng(seed)

        def rate(row, x, u=u):
            i, w = x[0], x[1]
            dry = coulomb + (static - coulomb) * np.exp(-((w / 1.5) ** 2))
            friction = dry * np.tanh(w / 0.02) + viscous * w + drag * w * abs(w)
            return np.array([(u[row] - 2.0 * i - 0.05 * w) / 1e-3, (0.05 * i - friction) / 2e-4, w])

        x = runge_kutta(rate, [0.0] * 3, 3000, 0.002, 40)
        columns = {"voltage_V": u, "current_A": x[:, 0] + 0.005 * rng.standard_normal(3000)}
        if velocity:
            columns["motor_velocity_rad_per_s"] = x[:, 1] + 0.05 * rng.standard_normal(3000)
        else:
            columns["motor_angle_rad"] = rounded(x[:, 2], 4096)
        yield 0.002, columns


def coupled(torque=lambda twist, rate: 1.3 * twist, *, friction=0.0, cogging=0.0, late=0):
    """Two inertias and a coupling under a known torque, 500 Hz; both angles are read."""
    for seed in range(3):
        u = multisine(4000, 500.0, (0.2, 8.0), 0.25, 60 + seed)
        acts = np.concatenate([np.zeros(late), u])[:4000]

        def rate(row, x, u=acts):
            t = torque(x[0] - x[2], x[1] - x[3])
            motor = u[row] - t - 0.02 * x[1] - cogging * np.sin(6.0 * x[0])
            load = t - 0.004 * x[3] - friction * np.tanh(x[3] / 2e-3)
            return np.array([x[1], motor / 2e-3, x[3], load / 3.8e-3])

        x = runge_kutta(rate, [0.0] * 4, 4000, 0.002, 10)
        yield 0.002, {
            "motor_torque_Nm": u, "motor_angle_rad": rounded(x[:, 0], 8192),
            "load_angle_rad": rounded(x[:, 2], 8192),
        }  # fmt: skip


def joint(*, closed=True, parallel=0.0, drag=0.0, dahl=0.0, dead=0.0, loss=(0.0, 0.0),
          error=0.0, pulse_Nm=0.0, dry=0.0, scale=1.0, rate_Hz=250.0):  # fmt: skip
    """A geared elastic joint under gravity, by motor current; both angles and the current."""
    rows, N, k = 3000, 30.0, 40.0
    t = np.arange(rows) / rate_Hz
    motor_kgm2, load_kgm2, weight = 2e-5, 0.05, 1.2
    for seed in range(3):
        aim = 0.5 * np.sin(2 * np.pi * (0.3 + 0.2 * seed) * t) + 0.25 * np.sign(
            np.sin(2 * np.pi * 0.21 * t + seed)
        )
        held = {"row": -1, "amps": 0.0}
        pushed = pulse_Nm * (seed == 1) * ((t > 4.0) & (t < 4.6))

        def rate(row, x, aim=aim, held=held, pushed=pushed):
            m, w, q, v, z = x
            if row != held["row"]:
                held["row"] = row
                wish = 4.0 * (aim[row] - q) - 0.25 * v + 0.35 * np.sin(q) if closed else aim[row]
                held["amps"] = float(np.clip(wish, -3.0, 3.0))
            amps = held["amps"]
            acts = np.sign(amps) * max(abs(amps) - dead, 0.0)
            deflection = m / N - q + error * np.sin(m / N * 2.0 + 0.4)
            spring = k * deflection + dahl * z
            lost = loss[0] if spring * w > 0.0 else loss[1]
            friction = 4e-4 * w + np.tanh(w / 0.5) * (dry + lost * abs(spring) / N)
            weighs = weight * np.sin(q) + parallel * q + drag * v * abs(v) + 0.05 * v
            deflection_rate = w / N - v
            return np.array([
                w, (0.05 * acts - friction - spring / N) / motor_kgm2,
                v, (spring + pushed[row] - weighs) / load_kgm2,
                (deflection_rate - abs(deflection_rate) * z) / 0.004,
            ])  # fmt: skip

        x = runge_kutta(rate, [0.0] * 5, rows, 1.0 / rate_Hz, 60)
        amps = np.array([held_amps(aim[j], x[j], closed) for j in range(rows)])
        yield 1.0 / rate_Hz, {
            "current_command_A": amps,
            "motor_angle_rad": rounded(x[:, 0], 2048),
            "load_angle_rad": rounded(scale * x[:, 2], 16384),
        }  # fmt: skip


def held_amps(aim: float, x: NDArray, closed: bool) -> float:
    """The current that the joint's controller asks for."""
    wish = 4.0 * (aim - x[2]) - 0.25 * x[3] + 0.35 * np.sin(x[2]) if closed else aim
    return float(np.clip(wish, -3.0, 3.0))


def gap(twist: float, _rate: float) -> float:
    """A coupling with play."""
    return 1.3 * np.sign(twist) * max(abs(twist) - 0.02, 0.0)


def stop(twist: float, _rate: float) -> float:
    """A coupling that stiffens beyond 0.25 rad."""
    return 1.3 * twist + 3.0 * np.sign(twist) * max(abs(twist) - 0.25, 0.0)


BOUC_WEN = {"parts": ["drive", "gear", "spring"], "gear_ratio": 1.0, "motor_inertia_kgm2": 2.0,
            "motor_viscous_Nms_per_rad": 10.0, "spring_stiffness_Nm_per_rad": 1e5}  # fmt: skip
SILVERBOX = {"parts": ["drive", "gear", "spring"], "gear_ratio": 1.0,
             "motor_inertia_kgm2": 1.03 / (2.0 * np.pi * 68.0) ** 2,
             "motor_viscous_Nms_per_rad": 0.0466 / (2.0 * np.pi * 68.0),
             "spring_stiffness_Nm_per_rad": 0.97}  # fmt: skip
MACHINES = {
    "bouc-wen": (BOUC_WEN, "locked", "spring-hysteresis", bouc_wen),
    "silverbox": (SILVERBOX, "locked", "spring-hardening", silverbox),
    "stribeck-motor": (SHAFT, "free", "gear-friction",
                       lambda: shaft(coulomb=0.01, static=0.016, velocity=True)),
    "propeller": (SHAFT | {"motor_encoder_counts_per_rev": 4096}, "free", "load-drag",
                  lambda: shaft(coulomb=1e-3, drag=3e-6, mean=6.0)),
    "sound-motor": (SHAFT | {"motor_encoder_counts_per_rev": 4096}, "free", "",
                    lambda: shaft(viscous=2e-4)),
    "late-coupling": (COUPLED, "free", "", lambda: coupled(late=1)),
    "hard-coupling": (COUPLED, "free", "spring-hardening",
                      lambda: coupled(lambda b, r: 1.3 * b + 6.0 * b**3)),
    "play": (COUPLED, "free", "gear-backlash", lambda: coupled(gap)),
    "load-friction": (COUPLED, "free", "load-friction", lambda: coupled(friction=0.03)),
    "cogging": (COUPLED, "free", "motor-cogging", lambda: coupled(cogging=0.05)),
    "damped-coupling": (COUPLED, "free", "spring-viscoelastic",
                        lambda: coupled(lambda b, r: 1.3 * b + 0.01 * r)),
    "stops": (COUPLED, "free", "spring-contact", lambda: coupled(stop)),
}  # fmt: skip


JOINT = {
    "parts": ["drive", "gear", "spring", "load"], "gear_ratio": 30.0,
    "torque_constant_Nm_per_A": 0.051, "motor_inertia_kgm2": 2.05e-5,
    "motor_viscous_Nms_per_rad": 3.6e-4, "spring_stiffness_Nm_per_rad": 39.0,
    "load_inertia_kgm2": 0.051, "load_viscous_Nms_per_rad": 0.06, "load_mass_kg": 0.61,
    "load_distance_m": 0.2, "motor_encoder_counts_per_rev": 2048,
    "load_encoder_counts_per_rev": 16384,
}  # fmt: skip
JOINTS = {
    "sound-joint": ("", {}),
    "counterbalanced-joint": ("spring-parallel", {"parallel": 0.5}),
    "joint-in-water": ("load-drag", {"drag": 0.12}),
    "rubber-joint": ("spring-hysteresis", {"dahl": 0.35}),
    "dead-zone-joint": ("drive-dead-zone", {"dead": 0.06}),
    "worm-joint": ("gear-load-friction", {"loss": (0.25, 0.5)}),
    "eccentric-gear-joint": ("gear-transmission-error", {"error": 0.004}),
    "pushed-joint": ("load-disturbance", {"pulse_Nm": 0.4}),
    "dry-gear-joint": ("gear-friction", {"dry": 0.003}),
    "wrong-scale-joint": ("sensor-scale", {"scale": 1.03}),
}
MACHINES |= {
    name: (JOINT, "pendulum", planted, lambda options=options: joint(**options))
    for name, (planted, options) in JOINTS.items()
}


def write_case(folder: Path, name: str) -> None:
    """A case folder of one machine."""
    rig, load, _, recordings = MACHINES[name]
    folder.mkdir(parents=True, exist_ok=True)
    text = f'[rig]\nname = "{name}"\n' + "".join(f"{k} = {v!r}\n" for k, v in rig.items())
    for number, (row_s, columns) in enumerate(recordings()):
        rows = len(next(iter(columns.values())))
        table = np.stack([row_s * np.arange(rows), *columns.values()], axis=1)
        header = ",".join(["time_s", *columns])
        np.savetxt(folder / f"r{number}.csv", table, "%.9g", ",", header=header, comments="")
        text += f'\n[[recording]]\nfile = "r{number}.csv"\nrole = "{ROLES[number]}"\n'
        text += f'load = "{load}"\n'
    (folder / "rig.toml").write_text(text, encoding="utf-8")


def main(out: Path, names: Sequence[str]) -> None:
    """Make the cases, diagnose them, print one line each."""
    from rsea_core.identify.diagnose import diagnose
    from rsea_core.recordings.case import read_case

    for name in names or MACHINES:
        folder = out / name
        write_case(folder, name)
        begun = time.perf_counter()
        found = diagnose(read_case(folder)).document
        claims = [(e["name"], e["confidence"], {k: v["value"] for k, v in e["parameters"].items()})
                for e in found["effects"]]  # fmt: skip
        seconds = time.perf_counter() - begun
        planted = MACHINES[name][2] or "nothing"
        print(f"{name}: planted {planted}; {found['verdict']} {claims} {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the cases are written")
    parser.add_argument(
        "names",
        nargs="*",
        metavar="NAME",
        choices=[*MACHINES, []],
        help=f"machines; all where none is given: {', '.join(MACHINES)}",
    )
    given = parser.parse_args()
    main(given.folder, given.names)
