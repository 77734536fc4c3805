"""Recordings of a machine with planted effects, and searches that begin on them."""

from dataclasses import replace

import numpy as np

import rsea_core.machine.quantities as q
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.identify.candidates.catalogue import catalogue
from rsea_core.identify.fitting.least_squares import Fit, Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.criteria import Search
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording

RIG = Rig(
    name="planted",
    supply_voltage_V=48.0,
    terminal_resistance_ohm=3.8,
    terminal_inductance_H=4.5e-3,
    torque_constant_Nm_per_A=0.37,
    back_emf_constant_Vs_per_rad=0.31,
    current_limit_A=6.0,
    motor_inertia_kgm2=3.2e-4,
    motor_viscous_Nms_per_rad=1e-4,
    gear_ratio=60.0,
    output_inertia_kgm2=2e-3,
    output_viscous_Nms_per_rad=0.02,
    spring_stiffness_Nm_per_rad=65.0,
    load_mass_kg=0.3,
    load_distance_m=0.3,
    load_inertia_kgm2=0.03,
    load_viscous_Nms_per_rad=0.02,
    gravity_angle_offset_rad=0.0,
    motor_encoder_counts_per_rev=8192,
    load_encoder_counts_per_rev=8192,
    torque_sensor_noise_Nm=0.02,
    current_sensor_noise_A=0.005,
)


def recording(terms, load: str, name: str, seed: int, rig: Rig = RIG, duty=None) -> Recording:
    """A noisy reading of the fixed-step engine, 4 s at 500 Hz, with a bridge of wandering gain.

    duty : function of the time or None, for a command of one's own
    """
    rng = np.random.default_rng(seed)
    t = 0.002 * np.arange(2000)
    given = duty
    duty = 0.08 * np.sin(2 * np.pi * 0.4 * t) if load == "locked" else sum(
        0.07 * np.sin(2 * np.pi * f * t + f) for f in (0.7, 1.9, 4.1, 7.3)
    )  # fmt: skip
    duty = np.round(duty if given is None else given(t), 5)
    wander = 3e-4 * np.sin(2 * np.pi * 0.13 * t + seed)
    inputs = Inputs(time_s=t, duty=duty * (1.0 + wander), load=Load(kind=load))
    out = Replay.of(inputs).run(ActuatorModel(rig, terms))
    count = 2 * np.pi / 8192
    columns = {
        "time_s": t,
        "duty": duty,
        "motor_angle_rad": q.quantise_angle(out[:, 0] + 0.3 * count, 8192),
        "load_angle_rad": q.quantise_angle(out[:, 1] + 0.3 * count, 8192),
        "current_A": out[:, 3] + 0.005 * rng.standard_normal(t.size),
        "torque_Nm": out[:, 2] + 0.02 * rng.standard_normal(t.size),
    }
    return Recording(file=name, load=Load(kind=load), columns=columns, sample_time_s=0.002)


def planted(tmp_path, *terms, rig: Rig = RIG) -> Problem:
    made = tuple(
        recording(terms, load, f"{load}.csv", seed, rig)
        for seed, load in ((1, "locked"), (2, "pendulum"))
    )
    case = Case(name="planted", folder=tmp_path, rig=RIG, recordings=made)
    return Problem(case, step_s=1e-3)


def parameters_of(problem: Problem) -> Search:
    """A search that has got as far as parameters alone."""
    fitter, plain = Fitter(problem, far=10.0), Hypothesis()
    fit = fitter.fit(plain, problem.start(plain), iterations=12)
    _, power, _ = fitter.evaluate(plain, problem.start(plain)[None])
    return Search(problem=problem, fitter=fitter, nominal_msni=power[0], parameters=fit, best=fit)


def misread(folder, column: str, error) -> Problem:
    """The planted machine whose sensor reads `error(time, columns)` too much."""
    made = []
    for seed, load in ((1, "locked"), (2, "pendulum")):
        r = recording((), load, f"{load}.csv", seed, RIG)
        columns = dict(r.columns)
        columns[column] = columns[column] + error(columns["time_s"], columns)
        made.append(replace(r, columns=columns))
    return Problem(
        Case(name="misread", folder=folder, rig=RIG, recordings=tuple(made)), step_s=1e-3
    )


def fit_at(problem: Problem, fitter: Fitter, keys, x=None) -> Fit:
    """One evaluation of the laws `keys` at `x`, or where their search would begin."""
    laws = catalogue(problem.case)
    hypothesis = Hypothesis(laws=tuple(laws[key] for key in keys))
    x = problem.start(hypothesis) if x is None else x
    cost, power, _ = fitter.evaluate(hypothesis, x[None])
    centre, weight = problem.prior(hypothesis)
    prior = 0.5 * float(np.sum((weight * (x - centre)) ** 2))
    return Fit(hypothesis=hypothesis, x=x, cost=cost[0], prior_cost=prior, msni=power[0])
