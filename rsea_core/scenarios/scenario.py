"""A closed-loop experiment in a file: rig, spring, load, reference, controller, duration."""

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path

from rsea_core.control import CONTROLLERS, Controller, simulate_closed_loop
from rsea_core.control.laws.own_law import load_controller
from rsea_core.effects.registry import SpringCurve, Term
from rsea_core.errors import RseaError, ScenarioError
from rsea_core.files.toml_tables import (
    file_name,
    nearest,
    number,
    read_toml,
    require_known,
    table,
    word,
)
from rsea_core.machine.inputs import Load
from rsea_core.machine.rig import Rig
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.model.model_file import read_model, read_model_file
from rsea_core.model.spring_curve_file import read_spring_curve
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.performance.limits import TrackingLimits, tracking_limits
from rsea_core.scenarios.scenario_terms import scenario_terms, with_sensors
from rsea_core.simulation.reference import AngleReference, Reference
from rsea_core.simulation.tracking_metrics import AngleMetrics, TrackingMetrics, tracking_metrics
from rsea_core.simulation.trajectory import Trajectory

PHYSICS = ("terms", "environment", "disturbance", "sensors")
TABLES = ("name", "rig", "spring", "load", "reference", "controller", "simulation", *PHYSICS)
SPRING_KEYS = ("stiffness_Nm_per_rad", "curve_csv", "design")
LARGEST = 1e12  # of a controller's number: beyond it is an error of units
SIMULATION_KEYS = ("duration_s", "row_s", "step_s", "judge_from_s")


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """An experiment with a controller of the torque or of the load's angle.

    Attributes
    ----------
    name : str
    rig : Rig
    spring : SpringCurve or None
        In place of the rig's stiffness.
    spring_design : str or None
        Name or file of a spring design; whoever runs the scenario turns it into a curve.
    terms : tuple of Term
        Physics beyond the rig: friction, delay, environment, disturbance and the like.
    load : Load
    reference : Reference or AngleReference
    controller : Controller
    duration_s : float
    row_s : float or None
        Time between rows of the result; None: the controller's sample time, at most 1 ms.
    step_s : float or None
        Longest integration step; None: what the fastest mode allows.
    judge_from_s : float
        Metrics count from here on.
    notes : tuple of str
        What of a diagnosed rig's file the simulation goes without, a sentence each.
    """

    name: str
    rig: Rig
    spring: SpringCurve | None = None
    spring_design: str | None = None
    terms: tuple[Term, ...] = ()
    load: Load
    reference: Reference | AngleReference
    controller: Controller
    duration_s: float
    row_s: float | None = None
    step_s: float | None = None
    judge_from_s: float = 0.0
    notes: tuple[str, ...] = ()

    def __post_init__(self):
        for f in ("duration_s", "row_s", "step_s"):
            value = getattr(self, f)
            if value is not None and not number(value, f, ScenarioError) > 0.0:
                raise ScenarioError(f"[simulation] {f} = {value} must be above 0")
        start = number(self.judge_from_s, "judge_from_s", ScenarioError)
        if not 0.0 <= start < self.duration_s:
            raise ScenarioError(
                f"[simulation] judge_from_s = {start:g} must be at least 0 and below duration_s ="
                f" {self.duration_s:g}"
            )

    @classmethod
    def from_toml(cls, path: str | Path) -> "Scenario":
        """The scenario of a file; files that it names are looked for beside it.

        Raises
        ------
        ScenarioError
            If the file cannot be read, or an entry is unknown, missing or unusable.
        """
        return cls.from_tables(
            read_toml(path, ScenarioError), where=str(path), folder=Path(path).parent
        )

    @classmethod
    def from_tables(cls, tables: Mapping, *, where: str, folder: Path) -> "Scenario":
        """The scenario of parsed TOML tables; `where` names their origin in messages.

        Raises
        ------
        ScenarioError
            As `from_toml`.
        """
        try:
            require_known(tables, TABLES, "the scenario", ScenarioError)
            for name in ("rig", "load", "reference", "controller", "simulation"):
                if name not in tables:
                    raise ScenarioError(f"{name} is missing")
            parts = {name: table(tables.get(name, {}), name, ScenarioError) for name in TABLES[2:7]}
            simulation = parts["simulation"]
            require_known(simulation, SIMULATION_KEYS, "[simulation]", ScenarioError)
            if "duration_s" not in simulation:
                raise ScenarioError("[simulation] duration_s is missing")
            rig, spring, design = rig_and_spring(tables["rig"], parts["spring"], folder)
            sensors = table(tables.get("sensors", {}), "sensors", ScenarioError)
            reference = dict(parts["reference"])
            if isinstance(reference.get("file"), str):
                reference["file"] = str(folder / reference["file"])
            return cls(
                name=file_name(tables.get("name", Path(where).stem), "name", ScenarioError),
                rig=with_sensors(rig, sensors),
                spring=spring,
                spring_design=design,
                terms=(
                    *terms_of_rig(tables["rig"], parts["spring"], folder),
                    *scenario_terms(tables),
                ),
                load=Load.from_table(parts["load"], "[load]"),
                reference=reference_kind(reference).from_table(reference, "[reference]"),
                controller=controller_from_table(parts["controller"], folder),
                notes=notes_of_rig(tables["rig"], folder),
                **simulation,
            )
        except RseaError as problem:
            raise ScenarioError(f"{where}: {problem}") from problem


@dataclass(frozen=True, kw_only=True, repr=False)
class ScenarioResult(BriefRepr):
    """What a scenario gave.

    Attributes
    ----------
    scenario : Scenario
    trajectory : Trajectory
    metrics : TrackingMetrics or AngleMetrics
    limits : TrackingLimits
    """

    scenario: Scenario
    trajectory: Trajectory
    metrics: TrackingMetrics | AngleMetrics
    limits: TrackingLimits


def run_scenario(scenario: Scenario, spring: SpringCurve | None = None) -> ScenarioResult:
    """Simulate a scenario and judge it.

    Parameters
    ----------
    spring : SpringCurve or None
        Takes the place of the scenario's own spring; needed where that is a design.

    Raises
    ------
    ScenarioError
        If the scenario names a spring design and no curve of it is given.
    RseaError
        As `simulate_closed_loop`.
    """
    curve = spring or scenario.spring
    if curve is None and scenario.spring_design is not None:
        raise ScenarioError(
            f"scenario {scenario.name!r}: the spring design {scenario.spring_design!r} must be"
            " solved first: pass its curve, or run it by `dftfs simulate`"
        )
    model = ActuatorModel(scenario.rig, (*(() if curve is None else (curve,)), *scenario.terms))
    trajectory = simulate_closed_loop(
        model,
        scenario.controller,
        scenario.reference,
        scenario.load,
        duration_s=scenario.duration_s,
        row_s=scenario.row_s,
        step_s=scenario.step_s,
    )
    metrics = tracking_metrics(trajectory, scenario.reference, from_s=scenario.judge_from_s)
    limits = tracking_limits(model, scenario.controller, scenario.reference, trajectory, metrics)
    return ScenarioResult(scenario=scenario, trajectory=trajectory, metrics=metrics, limits=limits)


def rig_and_spring(
    rig: object, spring: Mapping, folder: Path
) -> tuple[Rig, SpringCurve | None, str | None]:
    """The rig of a preset, file or table, with the spring's table: a curve, or a design's name.

    Raises
    ------
    RseaError
        If an entry is unknown or unusable.
    """
    if isinstance(rig, Mapping):
        machine = Rig.from_tables({"rig": rig}, where="[rig]")
    elif isinstance(rig, str) and rig.endswith(".toml"):
        file = folder / rig
        machine = read_model_file(file).rig if _is_model(file) else Rig.from_toml(file)
    elif isinstance(rig, str):
        machine = Rig.preset(rig)
    else:
        raise ScenarioError(f"rig = {rig!r} must be a preset, a .toml file or a table")
    require_known(spring, SPRING_KEYS, "[spring]", ScenarioError)
    if len(spring) > 1:
        raise ScenarioError(f"[spring] needs one of {', '.join(SPRING_KEYS)}, not {len(spring)}")
    curve = design = None
    if "stiffness_Nm_per_rad" in spring:
        machine = replace(machine, spring_stiffness_Nm_per_rad=spring["stiffness_Nm_per_rad"])
    if "curve_csv" in spring:
        curve = read_spring_curve(folder / str(spring["curve_csv"]))
    if "design" in spring:
        design = spring["design"]
        if not isinstance(design, str) or not design:
            raise ScenarioError(f"[spring] design = {design!r} must be a name or a file")
    return machine, curve, design


def reference_kind(entries: Mapping) -> type[Reference] | type[AngleReference]:
    """What a [reference] table is of: an angle where it has an amplitude in radians."""
    return AngleReference if "amplitude_rad" in entries else Reference


def terms_of_rig(rig: object, spring: Mapping, folder: Path) -> tuple[Term, ...]:
    """The terms of a rig given by a `model.toml`; none of any other rig.

    Raises
    ------
    RseaError
        If the file cannot be used, or [spring] names another spring than the model's curve.
    """
    if not (isinstance(rig, str) and rig.endswith(".toml") and _is_model(folder / rig)):
        return ()
    terms = read_model(folder / rig).terms
    if spring and any(isinstance(term, SpringCurve) for term in terms):
        raise ScenarioError(f"[spring] and the spring-curve of {rig}: give one of them")
    return terms


def notes_of_rig(rig: object, folder: Path) -> tuple[str, ...]:
    """What a rig given by a `model.toml` says that a simulation goes without."""
    if not (isinstance(rig, str) and rig.endswith(".toml") and _is_model(folder / rig)):
        return ()
    return read_model_file(folder / rig).notes


def _is_model(path: Path) -> bool:
    return bool({"term", "law", "found"} & read_toml(path, ScenarioError).keys())


def controller_from_table(entries: Mapping, folder: Path = Path()) -> Controller:
    """The controller of a TOML table with a `kind`: a name, or "my_module:MyLaw" of an own law.

    A module is looked for in `folder` first.

    Raises
    ------
    RseaError
        If the kind or a key is unknown, or a value is unusable.
    """
    if "kind" not in entries:
        raise ScenarioError(f"[controller] kind is missing ({', '.join(CONTROLLERS)})")
    kind = word(entries["kind"], "[controller] kind", ScenarioError)
    made = CONTROLLERS.get(kind)
    if made is None and ":" in kind:
        made = load_controller(kind, folder)
    if made is None:
        raise ScenarioError(f"[controller] kind {kind!r} is unknown; {nearest(kind, CONTROLLERS)}")
    known = {f.name: f for f in fields(made)}
    values = {key: value for key, value in entries.items() if key != "kind"}
    require_known(values, known, "[controller]", ScenarioError)
    for key, value in values.items():
        default = known[key].default
        if isinstance(default, tuple):
            values[key] = tuple(value) if isinstance(value, list) else value
            continue
        expected = bool if isinstance(default, bool) else str if isinstance(default, str) else None
        if expected is None and default is not MISSING:
            plain = number(value, f"[controller] {key}", ScenarioError)
            if abs(plain) > LARGEST:
                raise ScenarioError(f"[controller] {key} = {plain:g} must be within +-1e12")
            values[key] = type(default)(plain)
        elif expected is not None and not isinstance(value, expected):
            kind_text = "true or false" if expected is bool else "a word"
            raise ScenarioError(f"[controller] {key} = {value!r} must be {kind_text}")
    return made(**values)
