"""Recordings of the bench from the event-driven engine, and the search that begins on them."""

from dataclasses import replace

import numpy as np

import rsea_core.machine.quantities as q
from rsea_core.identify.fitting.least_squares import Fitter
from rsea_core.identify.fitting.problem import Hypothesis, Problem
from rsea_core.identify.selection.criteria import FAR, Search
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.recordings.case import Case
from rsea_core.recordings.recording import Recording
from rsea_core.simulation.simulate import simulate

RIG = Rig.preset("rsea-bench")
COUNT = q.count_angle_rad(8192)


def read(angle, phase):
    """An encoder of unknown phase."""
    return (np.floor(angle / COUNT + phase) + 0.5 - phase) * COUNT


def recorded(model, time, load, *, sensors=(), seed=0, **command):
    """A simulated machine and the columns of its recording."""
    rng = np.random.default_rng(seed)
    run = simulate(model, Inputs(time_s=time, load=load, **command))
    columns = {"time_s": time, **command}
    columns["motor_angle_rad"] = read(run.motor_angle_rad, rng.random())
    columns["load_angle_rad"] = read(run.load_angle_rad, rng.random())
    if "current_A" in sensors:
        columns["current_A"] = run.current_A + 0.005 * rng.standard_normal(time.size)
    if "torque_Nm" in sensors:
        columns["torque_Nm"] = run.torque_Nm + 0.02 * rng.standard_normal(time.size)
    return run, columns


def multisine(time):
    frequencies = np.array([0.4, 0.7, 1.1, 1.9, 2.9, 4.3, 6.1])
    duty = sum(np.sin(2 * np.pi * f * time + 7 * f**2) for f in frequencies)
    return 0.35 * duty / np.abs(duty).max()


WITHOUT_ANCHORS = replace(RIG, anchors=())
TIME = np.arange(3000) * 2e-3
LOCKED, PENDULUM = Load(kind="locked"), Load()
SLOW = 0.12 * np.sin(2 * np.pi * 0.3 * TIME)


def search_of(*made, terms=(), sensors=(), folder=None):
    """A search as far as the parameters' fit; made: (load, duty) of each recording."""
    recordings = []
    for k, (load, duty) in enumerate(made):
        model = ActuatorModel(WITHOUT_ANCHORS, terms)
        _, columns = recorded(model, TIME, load, sensors=sensors, seed=k, duty=duty)
        recordings.append(
            Recording(
                file=f"rec{k}.csv", role="identification", load=load, columns=columns,
                sample_time_s=2e-3,
            )
        )  # fmt: skip
    problem = Problem(
        Case(name="shown", folder=folder, rig=WITHOUT_ANCHORS, recordings=tuple(recordings))
    )
    fitter, plain = Fitter(problem, far=FAR), Hypothesis()
    x = problem.start(plain)
    _, power, _ = fitter.evaluate(plain, x[None])
    first = fitter.fit(plain, x, iterations=6)
    search = Search(problem=problem, fitter=fitter, nominal_msni=power[0], parameters=first)
    search.best = search.keep(first)
    return search
