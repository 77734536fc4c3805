"""A diagnosis page from made-up but consistent numbers, for the report's tests."""

import numpy as np

from dftfs.report.diagnosis.page import (
    Candidate,
    Comparison,
    DiagnosisPage,
    EffectCard,
    LawCurve,
    NextExperiment,
    ParameterRow,
    PortTrace,
    Remainder,
    Score,
    StateMap,
    TimeStrip,
)

FILES = ("triangle_locked.csv", "sine_locked.csv", "multisine.csv")


def example_page(**changes) -> DiagnosisPage:
    """A spring with hysteresis on a bench with every sensor."""
    rng = np.random.default_rng(4)
    time = np.linspace(0.0, 10.0, 5001)
    true = 6.0 * np.sin(2 * np.pi * 0.2 * time)
    loop = 0.5 * np.sign(np.cos(2 * np.pi * 0.2 * time))
    noise = 0.02 * rng.standard_normal(time.size)
    errors = (0.081, 0.062, 0.006)
    comparison = {
        "role": "validation",
        "description": "0.2 Hz sine, output clamped",
        "signal": "torque_Nm",
        "unit": "Nm",
        "time_s": time,
        "recorded": true + loop + noise,
        "before": 1.05 * true,
        "parameters_only": 0.99 * true,
        "after": true + 0.98 * loop,
        "noise_floor": 0.02,
        "nrmse_before": errors[0],
        "nrmse_parameters_only": errors[1],
        "nrmse_after": errors[2],
    }
    deflection = np.linspace(-0.2, 0.2, 81)
    traces = tuple(
        PortTrace(
            port=port,
            label=label,
            unit="Nm",
            file=file,
            time_s=time,
            value=size * loop + 0.1 * size * np.sin(0.7 * time + k),
            std=np.full(time.size, 0.05),
        )
        for k, file in enumerate(FILES)
        for port, label, size in (("G", "at the gear", 0.05), ("S", "in the spring", 1.0))
    )
    strips = tuple(
        TimeStrip(
            file=file, edges_s=np.linspace(0.0, 10.0, 81), level=rng.lognormal(k - 0.5, 0.4, 80)
        )
        for k, file in enumerate(FILES)
    )
    speed, load = np.linspace(-1.0, 1.0, 25), np.linspace(-8.0, 8.0, 19)
    level = 0.8 + 6.0 * np.abs(load[1:])[:, None] / 8.0 * (np.abs(speed[1:]) < 0.3)[None, :]
    level[np.hypot(speed[1:][None, :], load[1:][:, None] / 8.0) > 1.0] = np.nan
    page = {
        "case": "bench-03",
        "rig": "rsea-bench",
        "verdict": "missing-physics",
        "summary": "The spring loses 0.066 J in every loop of ±0.15 rad, whatever the speed: its"
        " torque lags its deflection by 0.29 Nm. Give the controller the loop or accept a 1.5 %"
        " torque error.",
        "subsystem": "spring",
        "where": "at every reversal of the deflection, above 0.05 rad, in all recordings with the"
        " output clamped; not with speed, not with time.",
        "shares": {"drive": 0.02, "gear": 0.06, "spring": 0.9, "load": 0.02},
        "parts": ("drive", "gear", "spring", "load"),
        "sensors": ("motor_angle_rad", "load_angle_rad", "current_A", "torque_Nm"),
        "loads": ("locked", "pendulum"),
        "separability": "4 independent relations: distinguishable in any combination: drive"
        " | gear | spring | load",
        "effects": (
            EffectCard(
                name="spring-hysteresis",
                subsystem="spring",
                confidence=0.97,
                law="maxwell-slip, 4 elements",
                words="The torque depends on where the deflection last turned.",
                parameters=(
                    ParameterRow(name="loop width", unit="Nm", value=0.291, std=0.006),
                    ParameterRow(name="loop energy", unit="J", value=0.0657, std=0.0012),
                ),
                alike=("spring-viscoelastic",),
            ),
        ),
        "parameters": (
            ParameterRow(
                name="spring_stiffness_Nm_per_rad", unit="Nm/rad", value=63.1, std=0.2,
                nominal=65.8,
            ),
            ParameterRow(
                name="terminal_resistance_ohm", unit="ohm", value=3.9, std=0.05, nominal=3.78,
                note="not identifiable alone: only R / k_t is",
            ),
        ),
        "comparisons": tuple(Comparison(file=file, **comparison) for file in FILES[:2]),
        "scores": tuple(
            Score(
                file=file, role="validation", signal="torque_Nm", unit="Nm", noise_floor=0.02,
                rmse_before=0.35, rmse_parameters_only=0.26, rmse_after=0.025,
            )
            for file in FILES
        ),
        "traces": traces,
        "strips": strips,
        "state_map": StateMap(
            x_label="wheel speed (rad/s)", y_label="spring torque (Nm)", x_edges=speed,
            y_edges=load, level=level, sentence="largest at low speed under high torque.",
        ),
        "signatures": (
            "The spring's extra torque changes by 0.58 ± 0.03 Nm where the deflection turns back.",
            "Loss per loop grows with amplitude to the power 1.4 ± 0.1 and not with rate (0.0 ±"
            " 0.05): dry, not viscous.",
        ),
        "ladder": (
            Candidate(
                name="spring-hysteresis", subsystem="spring", error=1.2, gain=412.0, se=6.0,
                chosen=True,
            ),
            Candidate(
                name="spring-viscoelastic", subsystem="spring", error=2.6, gain=300.0, se=12.0
            ),
            Candidate(name="gear-friction", subsystem="gear", error=4.0, gain=120.0, se=20.0),
            Candidate(name="parameters only", subsystem="", error=9.0, gain=0.0, se=5.0),
        ),
        "laws": (
            LawCurve(
                title="Spring torque against deflection", x_label="deflection (rad)",
                y_label="torque (Nm)", x=deflection, nominal=65.8 * deflection,
                found=63.0 * deflection + 0.3, low=63.0 * deflection + 0.25,
                high=63.0 * deflection + 0.35,
                points=(deflection, 63.0 * deflection + 0.3 + 0.05 * rng.standard_normal(81)),
            ),
        ),
        "remainder": Remainder(
            words="Nothing that repeats: the rest is within 1.3 noise floors and white.",
            signals=("torque", "motor angle", "load angle"),
            before=np.array([17.0, 40.0, 9.0]),
            parameters_only=np.array([13.0, 12.0, 5.0]),
            after=np.array([1.25, 1.3, 1.0]),
        ),
        "next_experiment": NextExperiment(
            sentence="Clamp the output and run a slow triangle at three amplitudes twice, once ten"
            " times faster: hysteresis keeps its loop, a viscoelastic spring does not.",
            file="next.csv", load="locked", sensors=("motor_angle_rad", "torque_Nm"),
            separation=14.2, threshold=3.0, rivals=("spring-hysteresis", "spring-viscoelastic"),
            command_label="duty", time_s=time, command=0.2 * np.sin(0.6 * time),
            signal="torque_Nm", unit="Nm", predicted=(true + loop, true + 0.2 * loop),
        ),
        "findings": (
            "torque_constant and back_emf_constant differ by 24 %: rms and peak mixed?",
        ),
        "facts": (
            ("command", "dftfs diagnose bench-03"),
            ("recordings", "3 identification, 2 validation"),
        ),
    }  # fmt: skip
    return DiagnosisPage(**(page | changes))
