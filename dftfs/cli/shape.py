"""`dftfs shape`: thickness profile and centreline of the arms for the most torque per mass."""

import argparse

from dftfs.cli.common import add_design, add_output, emit, progress, read_design, table
from dftfs.cli.output import default_folder, prepared, write_result
from dftfs.errors import DesignError
from dftfs.files import refuse_existing, to_json, write_bytes, write_text

_FILES = ("shape.toml", "uniform.toml", "shape.json", "shape.png", "report.html")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    parser.add_argument(
        "--process", default="wire-edm", help="manufacturing process (default wire-edm)"
    )
    parser.add_argument("--rounds", type=int, default=12, help="rounds of the search at most")
    parser.add_argument("--no-fe", action="store_true", help="use the rod model only")
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Optimise, confirm by elements, write; exit status 1 if a limit of the aim is not kept."""
    from dftfs.analysis.shape.compare import compared
    from dftfs.design import design_toml
    from dftfs.process import find_process
    from dftfs.report.figures.shape import shape_figure

    if not 1 <= arguments.rounds <= 200:
        raise DesignError(f"--rounds {arguments.rounds} must be 1 to 200, for example 12")
    design, process, say = read_design(arguments), find_process(arguments.process), progress()
    folder = arguments.out or default_folder(arguments, f"shape-{design.name}")
    refuse_existing([folder / name for name in _FILES], force=arguments.force)
    prepared(arguments, folder)
    found = compared(
        design, process, rounds=arguments.rounds, elements=not arguments.no_fe, on_progress=say
    )
    write_text(folder / "shape.toml", design_toml(found.shaped))
    write_text(folder / "uniform.toml", design_toml(found.uniform))
    write_text(folder / "shape.json", to_json(found))
    write_bytes(folder / "shape.png", shape_figure(found).png)
    title, text = f"Shape of the arms of {design.name}", _text(found)
    write_result(arguments, folder / "report.html", title, text, [folder / "shape.png"])
    _export(found.shaped, folder, arguments.force, say)
    emit(found, text, as_json=arguments.json)
    return 0 if found.kept else 1


def _text(found) -> str:
    rows = [
        (
            one.name,
            one.model,
            f"{one.stiffness_Nm_per_rad:.2f}",
            f"{1e3 * one.mass_kg:.1f}",
            *("none" if value is None else f"{value:.2f}" for value in one.contact_Nm.values()),
            f"{one.torque_at_yield_Nm:.2f}",
            f"{one.torque_per_mass:.1f}",
        )
        for one in found.judged
    ]
    header = ("design", "model", "K Nm/rad", "g", "contact +", "contact - Nm", "yield Nm", "Nm/kg")
    return f"{table(header, rows)}\ntorque at yield per mass: {found.gain:.3f} times the start's"


def _export(design, folder, force: bool, say) -> None:
    """Write the CAD files; where the kernel's solid is refused, say so and keep the rest."""
    from dftfs.cad.export import export_design
    from dftfs.cad.verify import CadError

    try:
        export_design(design, folder, overwrite=force)
    except CadError as error:
        say(f"no CAD files written: {error}")
