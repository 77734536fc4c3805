"""The actuator: a rotary series elastic joint, its physics, its simulation, its control.

    motor (theta_m, i) -> gear N:1 -> wheel (theta_w = theta_m / N) -> spring -> load (theta_l)

Conventions, everywhere in the package
--------------------------------------
Units: SI and radians; a name ends with its unit where a number crosses a boundary
(`spring_stiffness_Nm_per_rad`). Degrees, PWM percent and encoder counts are converted in
`quantities` only. `axis = "linear"` rigs are written with 1 m as 1 rad and 1 N as 1 Nm.

Sides: "motor" is the motor shaft, "wheel" or "output" the gear's slow shaft, "load" the link
beyond the spring. Angle and speed go from motor to output by 1/N, torque by N, inertia,
damping and stiffness by N^2 (`quantities`). Motor angle and speed are motor side, torque is at
the output.

Signs: one positive direction for all angles. A positive duty, voltage or current turns the
motor positively. Spring deflection is wheel angle less load angle; tau_s = f(deflection) is
positive when it pushes the load positively and holds the wheel back, and is what `torque_Nm`
reads. The load hangs at angle zero: gravity acts with -m g d sin(theta_l + offset).
A load torque helps positive motion, a contact resists it beyond its angle.

Currents are DC-equivalent, so that k_t [Nm/A] and k_e [Vs/rad] are one number.

Time: row k of a trajectory or recording is read at time_s[k] before row k's command acts; the
command is held from there to row k + 1. A simulation starts at rest and without current.

Start with `Rig.preset("rsea-bench")`, `ActuatorModel(rig).describe()`, `simulate`, and
`run_scenario` for a closed loop; with recordings of a machine, `diagnose` and `predict`.
"""

from importlib import import_module

__version__ = "0.2.0"

_PLACES = {
    "ActuatorModel": "rsea_core.model.actuator_model",
    "Case": "rsea_core.recordings.case",
    "Diagnosis": "rsea_core.identify.result.diagnosis",
    "InputError": "rsea_core.errors",
    "Inputs": "rsea_core.machine.inputs",
    "Load": "rsea_core.machine.inputs",
    "PidTorque": "rsea_core.control",
    "Prediction": "rsea_core.identify.result.predict",
    "Recording": "rsea_core.recordings.recording",
    "Reference": "rsea_core.simulation.reference",
    "Replay": "rsea_core.engines.fixed_step.replay",
    "Rig": "rsea_core.machine.rig",
    "RseaError": "rsea_core.errors",
    "Scenario": "rsea_core.scenarios.scenario",
    "Trajectory": "rsea_core.simulation.trajectory",
    "bode": "rsea_core.performance.frequency",
    "controller": "rsea_core.control.laws.own_law",
    "diagnose": "rsea_core.identify.diagnose",
    "linearise": "rsea_core.engines.linear.linearise",
    "loop_margins": "rsea_core.control",
    "natural_frequencies": "rsea_core.performance.frequency",
    "output_impedance": "rsea_core.performance.frequency",
    "performance_table": "rsea_core.performance.table_2_1",
    "predict": "rsea_core.identify.result.predict",
    "read_case": "rsea_core.recordings.case",
    "read_model": "rsea_core.model.model_file",
    "read_spring_curve": "rsea_core.model.spring_curve_file",
    "readings": "rsea_core.effects.sensor_reading",
    "run_batch": "rsea_core.simulation.batch",
    "run_scenario": "rsea_core.scenarios.scenario",
    "simulate": "rsea_core.simulation.simulate",
    "simulate_closed_loop": "rsea_core.control",
    "simulate_stepping": "rsea_core.simulation.simulate_fast",
    "step_metrics": "rsea_core.simulation.step_response",
    "torque_bandwidth": "rsea_core.performance.bandwidth",
    "tracking_metrics": "rsea_core.simulation.tracking_metrics",
    "write_model": "rsea_core.model.model_file",
}
__all__ = [
    "ActuatorModel",
    "Case",
    "Diagnosis",
    "InputError",
    "Inputs",
    "Load",
    "PidTorque",
    "Prediction",
    "Recording",
    "Reference",
    "Replay",
    "Rig",
    "RseaError",
    "Scenario",
    "Trajectory",
    "bode",
    "controller",
    "diagnose",
    "linearise",
    "loop_margins",
    "natural_frequencies",
    "output_impedance",
    "performance_table",
    "predict",
    "read_case",
    "read_model",
    "read_spring_curve",
    "readings",
    "run_batch",
    "run_scenario",
    "simulate",
    "simulate_closed_loop",
    "simulate_stepping",
    "step_metrics",
    "torque_bandwidth",
    "tracking_metrics",
    "write_model",
]
# names that stood here before 0.2; they go with the next release
_MOVED = {
    "BatchResult": "rsea_core.simulation.batch",
    "BodeData": "rsea_core.performance.frequency",
    "CONTROLLERS": "rsea_core.control",
    "Configuration": "rsea_core.machine.configurations",
    "ContactNonlinear": "rsea_core.effects",
    "Context": "rsea_core.effects",
    "Controller": "rsea_core.control",
    "ControllerError": "rsea_core.errors",
    "CycleEfficiency": "rsea_core.performance.efficiency",
    "DriveDeadTime": "rsea_core.effects",
    "DriveDeadZone": "rsea_core.effects",
    "DriveDelay": "rsea_core.effects",
    "DriveSaturation": "rsea_core.effects",
    "DriveThermal": "rsea_core.effects",
    "EnergyLedger": "rsea_core.engines.event_driven.energy_ledger",
    "GearBacklash": "rsea_core.effects",
    "GearEfficiency": "rsea_core.effects",
    "GearFriction": "rsea_core.effects",
    "GearLoadFriction": "rsea_core.effects",
    "GearTransmissionError": "rsea_core.effects",
    "LAWS": "rsea_core.effects",
    "LinearModel": "rsea_core.engines.linear.linearise",
    "LoadDisturbance": "rsea_core.effects",
    "LoadDrag": "rsea_core.effects",
    "LoadFlexibility": "rsea_core.effects",
    "LoadFriction": "rsea_core.effects",
    "LoadPositionTorque": "rsea_core.effects",
    "LoadUnbalance": "rsea_core.effects",
    "LoopMargins": "rsea_core.control",
    "ModelFile": "rsea_core.model.model_file",
    "MotorCogging": "rsea_core.effects",
    "NaturalFrequencies": "rsea_core.performance.frequency",
    "Parameter": "rsea_core.effects",
    "PerformanceRow": "rsea_core.performance.table_2_1",
    "Port": "rsea_core.effects",
    "RigError": "rsea_core.errors",
    "ScenarioError": "rsea_core.errors",
    "ScenarioResult": "rsea_core.scenarios.scenario",
    "SensorDelay": "rsea_core.effects",
    "SensorDrift": "rsea_core.effects",
    "SensorNoise": "rsea_core.effects",
    "SensorOffset": "rsea_core.effects",
    "SensorScale": "rsea_core.effects",
    "SensorTable": "rsea_core.effects",
    "SimulationError": "rsea_core.errors",
    "SpringBoucWen": "rsea_core.effects",
    "SpringContact": "rsea_core.effects",
    "SpringCurve": "rsea_core.effects",
    "SpringHardening": "rsea_core.effects",
    "SpringHysteresis": "rsea_core.effects",
    "SpringParallel": "rsea_core.effects",
    "SpringViscoelastic": "rsea_core.effects",
    "StepMetrics": "rsea_core.simulation.step_response",
    "StoredTrajectory": "rsea_core.interop.netcdf_parquet",
    "TERMS": "rsea_core.effects",
    "Term": "rsea_core.effects",
    "TermError": "rsea_core.errors",
    "TorqueBandwidth": "rsea_core.performance.bandwidth",
    "TorqueRipple": "rsea_core.effects",
    "TrackingLimits": "rsea_core.performance.limits",
    "TrackingMetrics": "rsea_core.simulation.tracking_metrics",
    "TransferFunction": "rsea_core.numeric.transfer_function",
    "cycle_efficiency": "rsea_core.performance.efficiency",
    "read_model_file": "rsea_core.model.model_file",
    "read_netcdf": "rsea_core.interop.netcdf_parquet",
    "read_parquet": "rsea_core.interop.netcdf_parquet",
    "require_stable": "rsea_core.control",
    "tracking_limits": "rsea_core.performance.limits",
    "write_netcdf": "rsea_core.interop.netcdf_parquet",
    "write_parquet": "rsea_core.interop.netcdf_parquet",
}


def __getattr__(name: str):
    """Import a public name where it is first used: numba and scipy take seconds."""
    if name in _PLACES:
        value = getattr(import_module(_PLACES[name]), name)
    elif name in _MOVED:
        import warnings

        place = _MOVED[name]
        warnings.warn(f"rsea_core.{name} is {place}.{name} now", DeprecationWarning, stacklevel=2)
        return getattr(import_module(place), name)
    else:
        raise AttributeError(f"module 'rsea_core' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "control", "effects", "identify", "interop", "performance"])
