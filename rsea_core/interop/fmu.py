"""The actuator as an FMU 3.0 for co-simulation: C99, its description, and the zip of both.

The C (`data/c/plant.h`, `effects.h`, `fmu.c`) carries winding, current limit, gear, any spring
table, load, gravity, contact and the effects whose numbers it names; a model with anything else is
refused by name. Steps of a twentieth of the fastest mode and located switches keep it within 1e-6
of `simulate`. The caller compiles it.

Source: Functional Mock-up Interface specification 3.0.1, sections 2.4 (description), 2.5 (zip)
and 4 (co-simulation).
"""

import io
import re
import zipfile
from dataclasses import dataclass
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.formula_torque as f
import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
from rsea_core.control.c_header import c_name, template
from rsea_core.effects.registry import Port
from rsea_core.effects.slots import place_of
from rsea_core.engines.linear.linearise import fastest_per_s
from rsea_core.errors import SimulationError
from rsea_core.machine.inputs import Load
from rsea_core.machine.quantities import GearReflection
from rsea_core.model.actuator_model import ActuatorModel
from rsea_core.numeric.content_hash import content_hash
from rsea_core.simulation.trajectory import Trajectory

LAWS = template("effects.h") + template("plant.h")
NAMED = frozenset(re.findall(r"\bE_(\w+)", LAWS))
"""Numbers of `layout.EFFECTS` that the C names, a constant each; zero where an effect is absent."""
BLOCKS = {
    "POSITION_TORQUE": (e.POSITION_TORQUE, e.N_POSITIONS),
    "KNEES": (e.KNEE, 4),
    "BRANCH_STIFFNESS": (e.BRANCH_STIFFNESS, e.N_BRANCHES),
    "BRANCH_TIME": (e.BRANCH_TIME, e.N_BRANCHES),
    "GEAR_TERMS": (f.GEAR_TERMS, f.MOST_TERMS),
    "GEAR_ANGLES": (f.GEAR_ANGLES, f.MOST_TERMS),
    "GEAR_SPEEDS": (f.GEAR_SPEEDS, f.MOST_TERMS),
    "LOAD_TERMS": (f.LOAD_TERMS, f.MOST_TERMS),
    "LOAD_ANGLES": (f.LOAD_ANGLES, f.MOST_TERMS),
    "LOAD_SPEEDS": (f.LOAD_SPEEDS, f.MOST_TERMS),
}
"""Those that it has as arrays: the first one's place and how many."""
CARRIED = (
    NAMED
    | {"any", "internal_states", "wheel_dry", "load_dry"}
    | {e.EFFECTS[first + j] for first, count in BLOCKS.values() for j in range(count)}
)
FURTHER_STATES = ("winding_heat_capacity", "link_stiffness", "branch_stiffness_1",
                  "branch_stiffness_2", "branch_stiffness_3")  # fmt: skip
STEPS_PER_MODE = 20.0
DRIVES = {"DUTY": mp.DUTY, "VOLTAGE": mp.VOLTAGE, "CURRENT": mp.CURRENT,
          "MOTOR_TORQUE": mp.MOTOR_TORQUE}  # fmt: skip
UNITS = {"s": "s='1'", "rad": "rad='1'", "rad/s": "rad='1' s='-1'", "A": "A='1'",
         "V": "kg='1' m='2' s='-3' A='-1'", "Nm": "kg='1' m='2' s='-2'"}  # fmt: skip
COMMAND_UNITS = {"voltage_V": "V", "current_command_A": "A", "motor_torque_Nm": "Nm"}
OUTPUTS = {
    "motor_angle_rad": "rad", "motor_velocity_rad_per_s": "rad/s", "load_angle_rad": "rad",
    "load_velocity_rad_per_s": "rad/s", "current_A": "A", "torque_Nm": "Nm",
}  # fmt: skip
"""Outputs in the order of `fmu.c`, by the names of a recording."""


@dataclass(frozen=True, kw_only=True)
class FmuSource:
    """An FMU before it is compiled.

    Attributes
    ----------
    name : str
        The model's identifier, and that of the library.
    files : dict of str
        C texts by file name; `fmu.c` is the one to compile.
    description : str
        modelDescription.xml.
    """

    name: str
    files: dict[str, str]
    description: str


def plant_header(model: ActuatorModel, load: Load, command_name: str) -> str:
    """The machine as a C99 header: its numbers, the spring's law, `rsea_plant_advance`.

    Raises
    ------
    SimulationError
        If the model has what the C has not; the message names it.
    RigError, TermError
        If the model cannot be simulated for this drive and load.
    """
    plant, fx = model.plant(command_name, load), model.effects(command_name, load)
    spring = model.spring_table(load)
    regions = spring.regions
    _require_carried(model, plant, fx, load)
    held = plant.structure == mp.ELASTIC_HELD
    given = dict(zip(e.EFFECTS, fx, strict=True))
    numbers = {
        **DRIVES,
        "DRIVE": plant.drive,
        "VOLTS_PER_COMMAND": plant.volts_per_command,
        "RESISTANCE": plant.resistance,
        "INDUCTANCE": plant.inductance,
        "TORQUE_PER_AMPERE": plant.torque_per_ampere,
        "VOLTS_PER_SPEED": plant.volts_per_speed,
        "TORQUE_PER_MOTOR_TORQUE": plant.torque_per_motor_torque,
        "CURRENT_LIMIT": plant.current_limit,
        "INERTIA": plant.inertia,
        "DAMPING": plant.damping,
        "LOAD_INERTIA": 1.0 if held else plant.load_inertia,
        "LOAD_DAMPING": plant.load_damping,
        "GRAVITY": plant.gravity,
        "GRAVITY_OFFSET": plant.gravity_offset,
        "LOAD_TORQUE": plant.load_torque,
        "CONTACT_STIFFNESS": plant.contact_stiffness,
        "CONTACT_DAMPING": plant.contact_damping,
        "CONTACT_ANGLE": plant.contact_angle,
        "GEAR_RATIO": plant.gear_ratio,
        "WHEEL_DRY": int(fx[e.WHEEL_DRY] != 0.0),
        "GEAR_LOSS": int(fx[e.GEAR_DRIVE_LOSS] != 0.0 or fx[e.GEAR_BACKDRIVE_LOSS] != 0.0),
        "LOAD_DRY": int(fx[e.LOAD_DRY] != 0.0),
        "LOAD_HELD": int(held),
        "PLANT_STEP_s": 1.0 / (STEPS_PER_MODE * max(fastest_per_s(plant, spring, fx), 1.0)),
        "N_REGIONS": len(regions),
        "N_STATES": "MOST_STATES" if any(given[name] for name in FURTHER_STATES) else "WINDING_x",
        "N_POSITIONS": e.N_POSITIONS,
        "N_BRANCHES": e.N_BRANCHES,
        "N_TERMS": f.MOST_TERMS,
        "SMOOTH": f.SMOOTH,
        **{f"E_{name}": given[name] for name in sorted(NAMED)},
    }
    return "\n".join(
        (
            f"/* Rig {c_name(model.rig.name)}, load {load.kind}, command {command_name}. */",
            "#include <math.h>",
            *(f"#define {name} {_c(value)}" for name, value in numbers.items()),
            *_tables(regions, fx),
            template("spring.h"),
            LAWS,
        )
    )


def _tables(regions: NDArray, fx: NDArray) -> list[str]:
    """The spring's regions and the blocks of numbers, as arrays of C."""
    rows = ",\n    ".join(", ".join(_c(x) for x in row) for row in regions)
    found = [f"static const double REGIONS[] = {{\n    {rows}}};"]
    for name, (first, count) in BLOCKS.items():
        values = ", ".join(map(_c, fx[first : first + count]))
        found.append(f"static const double {name}[] = {{{values}}};")
    return found


def row_of(run: Trajectory) -> float:
    """Time between the rows of a run [s], which are even."""
    return float(run.time_s[-1] - run.time_s[0]) / (run.time_s.size - 1)


def fmu_source(run: Trajectory, *, name: str) -> FmuSource:
    """Description and C of a run's machine as an FMU; start and experiment are the run's.

    Raises
    ------
    SimulationError, RigError, TermError
        As `plant_header`.
    """
    start_rad = (float(run.motor_angle_rad[0]), float(run.load_angle_rad[0]))
    header = plant_header(run.model, run.load, run.command_name)
    stem = c_name(name)
    token = content_hash(header, *start_rad)[:32]
    code = template("fmu.c").replace("TOKEN", f'"{token}"')
    build = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiBuildDescription fmiVersion="3.0"><BuildConfiguration modelIdentifier="{stem}">'
        '<SourceFileSet language="C99"><SourceFile name="fmu.c"/></SourceFileSet>'
        "</BuildConfiguration></fmiBuildDescription>\n"
    )
    return FmuSource(
        name=stem,
        files={"fmu.c": code, "plant.h": header, "buildDescription.xml": build},
        description=_description(stem, token, run, start_rad),
    )


def fmu_zip(source: FmuSource, library: bytes, platform: str, ending: str) -> bytes:
    """The FMU's bytes.

    Parameters
    ----------
    library : bytes
        The compiled shared library.
    platform, ending : str
        As the standard names them, such as "x86_64-linux" and ".so".
    """
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", source.description)
        for name, text in source.files.items():
            archive.writestr(f"sources/{name}", text)
        archive.writestr(f"binaries/{platform}/{source.name}{ending}", library)
    return made.getvalue()


def _require_carried(model: ActuatorModel, plant: mp.Plant, fx: NDArray, load: Load) -> None:
    gear, others = GearReflection(plant.gear_ratio), []
    for term in model.terms:
        numbers = set(term.numbers(gear)) - CARRIED
        names = sorted(name for name in numbers if fx[place_of(name)] != 0.0)
        if names:
            others.append(f"{term.key} ({', '.join(names)})")
    problem = None
    if plant.structure not in (mp.ELASTIC_FREE, mp.ELASTIC_HELD) or load.kind == "imposed":
        problem = f"load {load.kind!r} on rig {model.rig.name!r}: it needs a spring between wheel"
        problem += " and load, and a load that is free or locked"
    elif plant.drive not in DRIVES.values():
        problem = "a servo in place of a motor's command"
    elif others:
        problem = f"effects: {', '.join(others)}"
    elif sensors := [term.key for term in model.terms if term.port is Port.SENSOR]:
        problem = f"what sensors misread: {', '.join(sensors)}"
    if problem is not None:
        raise SimulationError(f"the C of the plant cannot hold {problem}")


def _description(stem: str, token: str, run: Trajectory, start_rad: tuple[float, float]) -> str:
    units = "".join(
        f'<Unit name="{name}"><BaseUnit {text.replace(chr(39), chr(34))}/></Unit>'
        for name, text in UNITS.items()
    )
    unit = COMMAND_UNITS.get(run.command_name)
    described = f' unit="{unit}"' if unit else ""
    inputs = 'causality="input" variability="continuous" start="0"'
    lines = [
        '<Float64 name="time" valueReference="0" causality="independent" variability="continuous"'
        ' unit="s"/>',
        f'<Float64 name={quoteattr(run.command_name)} valueReference="1" {inputs}{described}/>',
        f'<Float64 name="load_torque_Nm" valueReference="2" {inputs} unit="Nm"/>',
    ]
    for number, (what, angle) in enumerate(
        zip(("motor_start_rad", "load_start_rad"), start_rad), 3
    ):
        lines.append(
            f'<Float64 name="{what}" valueReference="{number}" causality="parameter"'
            f' variability="fixed" initial="exact" start="{angle!r}" unit="rad"/>'
        )
    references = range(5, 5 + len(OUTPUTS))
    for number, (what, its) in zip(references, OUTPUTS.items()):
        lines.append(
            f'<Float64 name="{what}" valueReference="{number}" causality="output"'
            f' variability="continuous" initial="calculated" unit="{its}"/>'
        )
    structure = "".join(f'<Output valueReference="{n}"/>' for n in references)
    structure += "".join(f'<InitialUnknown valueReference="{n}"/>' for n in references)
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        f'<fmiModelDescription fmiVersion="3.0" modelName="{stem}" instantiationToken="{token}"'
        ' generationTool="rsea_core">\n'
        f'<CoSimulation modelIdentifier="{stem}" canHandleVariableCommunicationStepSize="true"'
        ' canGetAndSetFMUState="true"/>\n'
        f"<UnitDefinitions>{units}</UnitDefinitions>\n"
        f'<DefaultExperiment startTime="0" stopTime="{float(run.time_s[-1])!r}"'
        f' stepSize="{row_of(run)!r}"/>\n'
        "<ModelVariables>\n" + "\n".join(lines) + "\n</ModelVariables>\n"
        f"<ModelStructure>{structure}</ModelStructure>\n</fmiModelDescription>\n"
    )


def _c(value: float | str) -> str:
    value = value if isinstance(value, int | str) else float(value)
    if isinstance(value, str):
        return value
    if np.isinf(value):
        return "HUGE_VAL" if value > 0 else "(-HUGE_VAL)"
    return f"({value!r})" if value < 0 else repr(value)
