"""`dftfs export`: STEP, STL and DXF of the part, each read back and checked."""

import argparse
from typing import TYPE_CHECKING

from dftfs.cli.common import add_author, add_design, add_output, emit, read_design
from dftfs.cli.output import default_folder
from dftfs.errors import DesignError

if TYPE_CHECKING:  # `--help` needs no CAD kernel
    from dftfs.cad.export import ExportResult

FORMATS = ("step", "stl", "dxf")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    parser.add_argument(
        "--formats",
        default=",".join(FORMATS),
        metavar="LIST",
        help="any of step, stl, dxf, separated by commas",
    )
    parser.add_argument(
        "--stl-tolerance-mm", type=float, metavar="MM", help="chord tolerance of the STL"
    )
    add_author(parser)
    add_output(parser, folder=True)


def run(arguments: argparse.Namespace) -> int:
    """Write the files and print what was measured on them."""
    from dftfs.cad.export import export_design

    design = read_design(arguments)
    formats = tuple(word.strip() for word in arguments.formats.split(","))
    if not set(formats) <= set(FORMATS):
        raise DesignError(f"--formats {arguments.formats}: known are {', '.join(FORMATS)}")
    chosen = {}
    if arguments.stl_tolerance_mm is not None:
        chosen["stl_chord_tolerance_mm"] = arguments.stl_tolerance_mm
    result = export_design(
        design,
        arguments.out or default_folder(arguments, f"export-{design.name}"),
        author=arguments.author,
        formats=formats,
        overwrite=arguments.force,
        **chosen,
    )
    emit(result, summary(result), as_json=arguments.json)
    return 0


def summary(result: "ExportResult") -> str:
    """The result for people."""
    x, y, z = (side * 1e3 for side in result.bounding_box_m)
    lines = [
        f"{result.name}: volume {result.volume_m3 * 1e9:.2f} mm3,"
        f" mass {result.mass_kg * 1e3:.2f} g,"
        f" box {x:.3f} x {y:.3f} x {z:.3f} mm"
    ]
    lines += [f"  {path}" for path in result.files.values()]
    return "\n".join(lines)
