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
`run_scenario` for a closed loop.
"""

from rsea_core.control import (
    CONTROLLERS,
    Controller,
    LoopMargins,
    PidTorque,
    loop_margins,
    require_stable,
    simulate_closed_loop,
)
from rsea_core.effects.registry import (
    LAWS,
    TERMS,
    ContactNonlinear,
    Context,
    DriveDeadTime,
    DriveDeadZone,
    DriveDelay,
    DriveSaturation,
    DriveThermal,
    GearBacklash,
    GearEfficiency,
    GearFriction,
    GearLoadFriction,
    GearTransmissionError,
    LoadDisturbance,
    LoadDrag,
    LoadFlexibility,
    LoadFriction,
    LoadPositionTorque,
    LoadUnbalance,
    MotorCogging,
    Parameter,
    Port,
    SensorDelay,
    SensorDrift,
    SensorNoise,
    SensorOffset,
    SensorScale,
    SensorTable,
    SpringBoucWen,
    SpringContact,
    SpringCurve,
    SpringHardening,
    SpringHysteresis,
    SpringParallel,
    SpringViscoelastic,
    Term,
    TorqueRipple,
)
from rsea_core.effects.sensor_reading import readings
from rsea_core.engines.event_driven.energy_ledger import EnergyLedger
from rsea_core.engines.fixed_step.replay import Replay
from rsea_core.engines.linear.linearise import LinearModel, linearise
from rsea_core.errors import (
    ControllerError,
    InputError,
    RigError,
    RseaError,
    ScenarioError,
    SimulationError,
    TermError,
)
from rsea_core.interop.netcdf_parquet import (
    StoredTrajectory,
    read_netcdf,
    read_parquet,
    write_netcdf,
    write_parquet,
)
from rsea_core.machine.configurations import Configuration
from rsea_core.machine.inputs import Inputs, Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.model_file import ModelFile, read_model, read_model_file, write_model
from rsea_core.model.spring_curve_file import read_spring_curve
from rsea_core.numeric.transfer_function import TransferFunction
from rsea_core.performance.bandwidth import TorqueBandwidth, torque_bandwidth
from rsea_core.performance.efficiency import CycleEfficiency, cycle_efficiency
from rsea_core.performance.frequency import (
    BodeData,
    NaturalFrequencies,
    bode,
    natural_frequencies,
    output_impedance,
)
from rsea_core.performance.limits import TrackingLimits, tracking_limits
from rsea_core.performance.table_2_1 import PerformanceRow, performance_table
from rsea_core.scenarios.scenario import Scenario, ScenarioResult, run_scenario
from rsea_core.simulation.batch import BatchResult, run_batch
from rsea_core.simulation.reference import Reference
from rsea_core.simulation.simulate import simulate
from rsea_core.simulation.simulate_fast import simulate_stepping
from rsea_core.simulation.step_response import StepMetrics, step_metrics
from rsea_core.simulation.tracking_metrics import TrackingMetrics, tracking_metrics
from rsea_core.simulation.trajectory import Trajectory

__all__ = [
    "CONTROLLERS",
    "LAWS",
    "TERMS",
    "ActuatorModel",
    "BatchResult",
    "BodeData",
    "Configuration",
    "ContactNonlinear",
    "Context",
    "Controller",
    "ControllerError",
    "CycleEfficiency",
    "DriveDeadTime",
    "DriveDeadZone",
    "DriveDelay",
    "DriveSaturation",
    "DriveThermal",
    "EnergyLedger",
    "GearBacklash",
    "GearEfficiency",
    "GearFriction",
    "GearLoadFriction",
    "GearTransmissionError",
    "InputError",
    "Inputs",
    "LinearModel",
    "Load",
    "LoadDisturbance",
    "LoadDrag",
    "LoadFlexibility",
    "LoadFriction",
    "LoadPositionTorque",
    "LoadUnbalance",
    "LoopMargins",
    "ModelFile",
    "MotorCogging",
    "NaturalFrequencies",
    "Parameter",
    "PerformanceRow",
    "PidTorque",
    "Port",
    "Reference",
    "Replay",
    "Rig",
    "RigError",
    "RseaError",
    "Scenario",
    "ScenarioError",
    "ScenarioResult",
    "SensorDelay",
    "SensorDrift",
    "SensorNoise",
    "SensorOffset",
    "SensorScale",
    "SensorTable",
    "SimulationError",
    "SpringBoucWen",
    "SpringContact",
    "SpringCurve",
    "SpringHardening",
    "SpringHysteresis",
    "SpringParallel",
    "SpringViscoelastic",
    "StepMetrics",
    "StoredTrajectory",
    "Term",
    "TermError",
    "TorqueBandwidth",
    "TorqueRipple",
    "TrackingLimits",
    "TrackingMetrics",
    "Trajectory",
    "TransferFunction",
    "bode",
    "cycle_efficiency",
    "linearise",
    "loop_margins",
    "natural_frequencies",
    "output_impedance",
    "performance_table",
    "read_model",
    "read_model_file",
    "read_netcdf",
    "read_parquet",
    "read_spring_curve",
    "readings",
    "require_stable",
    "run_batch",
    "run_scenario",
    "simulate",
    "simulate_closed_loop",
    "simulate_stepping",
    "step_metrics",
    "torque_bandwidth",
    "tracking_limits",
    "tracking_metrics",
    "write_model",
    "write_netcdf",
    "write_parquet",
]
