"""An inertia that varies with the angle is found with its wave; a sound axis has none."""

from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from rsea_core.effects.load_inertia_variation import LoadInertiaVariation
from rsea_core.identify.window_diagnosis import diagnose_windows
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.model.model_file import read_model
from rsea_core.recordings.recording import Recording
from rsea_core.simulation.simulate import simulate
from tests.cases.one_axis import COUNTS, ROW_s, axis_case, axis_rig

COSINE_kgm2, SINE_kgm2 = 0.004, -0.003


def crank_recording(seed: int) -> Recording:
    """An axis whose inertia has a wave twice in a turn: J alpha + J' omega^2 / 2 = tau - b omega.

    DOP853, row by row with the command held: apart from the product's engines.
    """
    rig, rng = axis_rig(), np.random.default_rng(seed)
    time = ROW_s * np.arange(900)
    phases = rng.uniform(0.0, 6.0, 3)
    current = sum(
        1.2 * np.sin(2.0 * np.pi * f * time + p) for f, p in zip((0.31, 0.83, 1.9), phases)
    )
    constant = rig.motor_inertia_kgm2 + rig.load_inertia_kgm2

    def rates(_, y, torque):
        angle, speed = y
        cosine, sine = np.cos(2.0 * angle), np.sin(2.0 * angle)
        inertia = constant + COSINE_kgm2 * cosine + SINE_kgm2 * sine
        slope = 2.0 * (SINE_kgm2 * cosine - COSINE_kgm2 * sine)
        needed = rig.load_viscous_Nms_per_rad * speed + 0.5 * slope * speed**2
        return speed, (torque - needed) / inertia

    states = [np.zeros(2)]
    for command in current[:-1]:
        torque = (rig.torque_constant_Nm_per_A * command,)
        piece = solve_ivp(rates, (0.0, ROW_s), states[-1], "DOP853", args=torque, rtol=1e-9)
        states.append(piece.y[:, -1])
    count = 2.0 * np.pi / COUNTS
    read = count * np.floor(np.array(states)[:, 0] / count + rng.uniform())
    columns = {"time_s": time, "current_command_A": current, "motor_angle_rad": read}
    return Recording(file=f"crank{seed}.csv", role="identification", load=Load(kind="free"),
                     columns=columns, sample_time_s=ROW_s)  # fmt: skip


def test_the_inertia_of_a_crank_is_reported_with_its_wave_and_simulated(tmp_path):
    case = axis_case(tmp_path, crank_recording(1), crank_recording(2), rig=axis_rig())
    diagnosis = diagnose_windows(case, quick=True)
    found = diagnosis.document
    assert found["verdict"] == "unexplained"
    assert found["remainder"]["where"] == "load"
    assert "an inertia that varies with the angle" in found["remainder"]["words"]
    first, second = found["remainder"]["formula"]["terms"]
    assert (first["function"], second["function"]) == ("cos(2 theta)", "sin(2 theta)")
    size = np.hypot(COSINE_kgm2, SINE_kgm2)
    assert abs(first["coefficient_kgm2"] - COSINE_kgm2) < 0.05 * size
    assert abs(second["coefficient_kgm2"] - SINE_kgm2) < 0.05 * size

    path = tmp_path / "model.toml"
    path.write_text(diagnosis.model.to_toml(), encoding="utf-8")
    unseen, model = crank_recording(3), read_model(path)
    (term,) = [t for t in model.terms if isinstance(t, LoadInertiaVariation)]
    without = replace(model, terms=tuple(t for t in model.terms if t is not term))
    inputs = Inputs(time_s=unseen.time_s, current_command_A=unseen["current_command_A"],
                    load=Load(kind="free"))  # fmt: skip
    read = unseen["motor_angle_rad"]
    error, error_without = (
        np.std(simulate(m, inputs).motor_angle_rad - read) for m in (model, without)
    )
    assert error < 0.05 * error_without
