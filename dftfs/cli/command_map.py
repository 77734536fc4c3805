"""The map of commands: groups of them, first steps, and examples that a reader can type."""

from collections.abc import Mapping

# by the module of dftfs/cli that runs the command
COMMANDS = {
    "study": "design, CAD, finite elements, actuator simulation and one report",
    "design": "closed-form and rod models: stiffness, stress, gaps and contact, in milliseconds",
    "export": "write STEP, STL and DXF of a design",
    "deck": "input decks for CalculiX and Abaqus with named sets, and VTK fields of every step",
    "deliver": "zip for the workshop: STEP, DXF, toleranced drawing, certificate, measuring sheet",
    "mount": "stiffness with hub and rim held by bolts or on an elastic seat",
    "article": "stiffness predicted from the measured dimensions of a first article",
    "parts": "the reference parts with CAD files; `parts list`: sourced motors, gears, springs",
    "verify": "large-displacement finite elements: curve, stress, contact, mesh error",
    "sweep": "solve a design over a grid or a list of fields: table and plots, cached, resumable",
    "size": "find the best geometry for a stiffness, a torque, an envelope and a process",
    "shape": "optimise thickness and centreline of the arms for torque at yield per mass",
    "tolerance": "the spread of stiffness and first contact, and which tolerance to tighten",
    "simulate": "simulate the actuator with a spring and a controller, from a scenario file",
    "compare": "compare controllers on one plant, one reference and one tuning budget",
    "tune": "tune a controller on a task, over several seeds",
    "deploy": "a scenario's controller in C99 with safety limits, tested against its simulation",
    "fmu": "a scenario's machine as an FMU 3.0 for co-simulation, checked against its simulation",
    "import_log": "convert logs of any format to a case: proposes columns, units and signs",
    "doctor": "quality of recordings and detectable errors; without a case: this computer",
    "export_log": "recordings of a case as Parquet or MCAP, a machine as MJCF or URDF",
    "friction": "compare friction laws on the recordings of a case, with their identifiability",
    "diagnose": "where simulation and recordings differ, and which physics the model lacks",
    "predict": "predict sensor readings of a diagnosed machine for new inputs",
    "prove": "validation of the diagnosis: cases with hidden effects, blind runs, scores",
    "thesis": "recompute every number of the thesis, with a verdict",
    "materials": "the material table, every value with its source",
    "report": "redraw the pages of a result folder from their data",
    "check_report": "run a page's command again and compare every value with the page's data",
    "schema": "JSON schema of a file that the program reads, for editors",
    "new": "write a commented design, rig, scenario, comparison or sizing task to start from",
    "completion": "completion of commands and options for bash, zsh or fish",
}
SPELLED = {
    "import_log": "import",
    "export_log": "export-log",
    "check_report": "check-report",
}  # else the module's own name
SENTENCES = {SPELLED.get(module, module): text for module, text in COMMANDS.items()}

GROUPS = {
    "the spring": (
        "study", "design", "size", "shape", "verify", "sweep", "tolerance", "export", "deck",
        "deliver", "article", "mount", "parts", "materials",
    ),
    "the actuator": ("simulate", "compare", "tune", "deploy", "fmu"),
    "recordings": (
        "import", "doctor", "diagnose", "predict", "friction", "prove", "export-log",
    ),
    "other": ("new", "report", "check-report", "schema", "completion", "thesis"),
}  # fmt: skip
FIRST_STEPS = (
    ("dftfs study al1", "a spring from its parameters to CAD files and one report"),
    ("dftfs new scenario mine.toml", "a commented file; then: dftfs simulate mine.toml"),
    ("dftfs diagnose CASE", "recordings of a real machine: which physics is missing?"),
)
EXAMPLES = {
    "study": ("dftfs study al1", "dftfs study al1 --set width_mm=10 --out out/wide"),
    "design": ("dftfs design al1", "dftfs design mine.toml --set turns=2.1 --json"),
    "export": ("dftfs export al1", "dftfs export mine.toml --out parts --force"),
    "parts": ("dftfs parts --out cad_out --force", "dftfs parts list motor"),
    "verify": (
        "dftfs verify al1 --plane --load -8 8 1e6",
        "dftfs verify al1 --at-rad 0.2 --structure",
    ),
    "sweep": ("dftfs sweep al1 --vary width_mm=4:13:10", "dftfs sweep al1 --list designs.csv"),
    "size": ("dftfs size", "dftfs size mine.toml --set stiffness_Nm_per_rad=120"),
    "shape": ("dftfs shape al1", "dftfs shape mine.toml --process water-jet --no-fe"),
    "tolerance": ("dftfs tolerance al1",),
    "simulate": ("dftfs simulate mine.toml", "dftfs simulate mine.toml --solid --out out/sim"),
    "compare": ("dftfs compare compare-torque-worm --seeds 2", "dftfs compare mine.toml --resume"),
    "tune": ("dftfs tune mine.toml", "dftfs tune mine.toml --controller PID --method cma-es"),
    "deploy": ("dftfs deploy mine.toml --out out/c",),
    "fmu": ("dftfs fmu mine.toml --out out/fmu",),
    "friction": ("dftfs friction CASE",),
    "diagnose": ("dftfs diagnose CASE", "dftfs diagnose CASE --quick --out out/found"),
    "predict": ("dftfs predict out/found/model.toml CASE/test --out prediction.csv",),
    "prove": (
        "dftfs prove make --cases 20 --seed 7 --out set",
        "dftfs prove run set",
        "dftfs prove score set --out set/score",
    ),
    "report": ("dftfs report out/found", "dftfs report out/study --out elsewhere"),
    "check-report": ("dftfs check-report out/simulate/report.html",),
    "completion": ("dftfs completion bash", "dftfs completion fish"),
    "schema": ("dftfs schema", "dftfs schema design --out design.schema.json"),
    "deck": ("dftfs deck al1 --at-rad 0.05 0.1", "dftfs deck mine.toml --size 0.5 --layers 2"),
    "deliver": ("dftfs deliver al1",),
    "article": ("dftfs article al1 measuring-sheet.csv",),
    "mount": ("dftfs mount al1 --rim-bolts 8 3.2 165.5 --preload-N 3000",),
    "import": (
        "dftfs import log.csv --rig rig.toml --out my-case",
        "dftfs import log.csv --rig rig.toml --out my-case --column"
        """ 'current_A={ name = "TRQ", unit = "A", scale = 0.08 }'""",
    ),
    "doctor": ("dftfs doctor", "dftfs doctor CASE --out out/health"),
    "export-log": ("dftfs export-log CASE --out out/logs --format mcap",),
    "thesis": ("dftfs thesis",),
    "materials": ("dftfs materials", "dftfs materials 6061-T6"),
    "new": (
        "dftfs new design mine.toml",
        "dftfs new rig case/rig.toml",
        "dftfs new rig rig.toml --with quanser-srv02 quanser-srv02-high quanser-flexible-joint",
        "dftfs new scenario s.toml",
        "dftfs new task mine.toml --ask",
    ),
}


def overview(commands: Mapping[str, str]) -> str:
    """What `dftfs` alone prints: every command by group, and three first steps."""
    lines = ["dftfs: flat double-spiral springs and their series elastic actuators"]
    placed = {name for names in GROUPS.values() for name in names}
    rest = tuple(name for name in commands if name not in placed)
    for group, names in GROUPS.items():
        names = (*names, *rest) if group == "other" else names
        lines += ["", f"{group}:", *(f"  {name:<12} {commands[name]}" for name in names)]
    width = max(len(line) for line, _ in FIRST_STEPS)
    lines += ["", "to begin:", *(f"  {line:<{width}}  {what}" for line, what in FIRST_STEPS)]
    lines += ["", "dftfs COMMAND --help lists options and examples; docs/ is the manual"]
    return "\n".join(lines)
