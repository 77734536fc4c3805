"""`dftfs deck`: the design for CalculiX and Abaqus, and our own fields of every step for VTK."""

import argparse

from dftfs.cli.common import add_design, add_output, emit, progress, read_design, table
from dftfs.cli.output import default_folder, prepared
from dftfs.cli.spring_options import add_mesh, mesh_of
from dftfs.errors import DesignError
from dftfs.files import refuse_existing, write_text

_ABOUT = (
    "half of the width (the mid-plane is a mirror): torque = 2 x moment of the bore's reactions"
)
_FARTHEST_RAD = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    add_mesh(parser)
    parser.add_argument(
        "--at-rad",
        type=float,
        nargs="+",
        default=[0.05, 0.1],
        metavar="RAD",
        help="deflections, one step each, in this order (default 0.05 0.1; negative: unwinding)",
    )
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Mesh, solve, write decks, fields and torques."""
    from dftfs.analysis.torsion.problem import meshed_problem
    from dftfs.analysis.torsion.ring_fields import ring_model, ring_of, ring_steps
    from dftfs.fem.deck import DIALECTS, deck
    from dftfs.fem.vtu import pvd_text, vtu_text

    design, say, at = read_design(arguments), progress(), _deflections(arguments.at_rad)
    problem = meshed_problem(design, mesh_of(arguments, design), dimension=3)
    folder, name = arguments.out or default_folder(arguments, f"deck-{design.name}"), design.name
    files = {dialect: folder / f"{name}-{dialect}.inp" for dialect in DIALECTS}
    steps = {folder / f"{name}-{k:03d}.vtu": t for k, t in enumerate(at, 1)}
    files |= {"steps": folder / f"{name}.pvd", "torque": folder / f"torque-{name}.csv"}
    refuse_existing([*files.values(), *steps], force=arguments.force)
    prepared(arguments, folder)
    ring = ring_of(problem)
    say(f"{name}: {len(ring.cells)} elements, {len(ring.nodes)} nodes")
    found = ring_steps(problem, at)
    model = ring_model(problem, ring)
    for dialect in DIALECTS:
        heading = f"{name}, {design.material.name}, SI units; {_ABOUT}"
        options = {"dialect": dialect, "direct": False, "every_step": True, "heading": heading}
        write_text(files[dialect], deck(model, at, tight=dialect == "calculix", **options))
    for path, step in zip(steps, found):
        fields = {"displacement_m": step.displacement_m, "von_mises_Pa": step.von_mises_Pa}
        write_text(path, vtu_text(ring, fields))
    write_text(files["steps"], pvd_text([(t, path.name) for path, t in steps.items()]))
    rows = [[repr(step.deflection_rad), repr(step.torque_Nm)] for step in found]
    lines = [f"# sign: winding; {_ABOUT}", "deflection_rad,torque_Nm", *map(",".join, rows)]
    write_text(files["torque"], "\n".join(lines) + "\n")
    record = {
        "design": name,
        "elements": len(ring.cells),
        "nodes": len(ring.nodes),
        "steps": [
            {"deflection_rad": s.deflection_rad, "torque_Nm": s.torque_Nm, "gap_m": s.clearance_m}
            for s in found
        ],
        "files": [str(path) for path in (*files.values(), *steps)],
    }
    emit(record, _text(record), as_json=arguments.json)
    return 0


def _deflections(given: list[float]) -> list[float]:
    for value in given:
        if not 0 < abs(value) <= _FARTHEST_RAD:
            raise DesignError(
                f"--at-rad {value:g} must be above 0 and up to {_FARTHEST_RAD:g} rad either way,"
                " for example --at-rad 0.05 0.1"
            )
    return given


def _text(record: dict) -> str:
    rows = [
        [f"{s['deflection_rad']:+.5f}", f"{s['torque_Nm']:+.6f}", f"{1e3 * s['gap_m']:.3f}"]
        for s in record["steps"]
    ]
    lines = [f"{record['design']}: {record['elements']} elements, {record['nodes']} nodes"]
    lines.append(table(["deflection rad", "torque Nm", "gap mm"], rows))
    if any(s["gap_m"] <= 0 for s in record["steps"]):
        lines.append("the coils penetrate where the gap is 0: the decks define no contact;")
        lines[-1] += " the surfaces FLOOR and CEILING are named for a contact pair"
    return "\n".join([*lines, *(f"  {path}" for path in record["files"])])
