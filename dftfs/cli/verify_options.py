"""The options of `dftfs verify`, checked before anything is solved."""

import argparse
from pathlib import Path

from dftfs.analysis.strength.fatigue import LoadBlock
from dftfs.analysis.strength.fkm import SURFACES, fatigue_strength, survival_factor
from dftfs.analysis.strength.torque_history import read_blocks
from dftfs.analysis.strength.yield_and_set import assumed_hardening, require_angles
from dftfs.analysis.torsion.problem import BOUNDARIES
from dftfs.cli.common import add_design, add_output
from dftfs.cli.spring_options import (
    add_friction,
    add_inertia,
    add_mesh,
    check_friction,
    check_inertia,
)
from dftfs.design import SpringDesign
from dftfs.errors import DesignError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    add_mesh(parser)
    parser.add_argument(
        "--at-rad",
        type=float,
        nargs="+",
        default=[],
        metavar="RAD",
        help="further deflections to solve at (negative: unwinding)",
    )
    parser.add_argument("--states", type=int, default=8, help="states per direction (default 8)")
    parser.add_argument(
        "--beyond",
        type=float,
        default=1.5,
        metavar="TIMES",
        help="end of the curve as a multiple of the first-contact deflection (default 1.5)",
    )
    parser.add_argument("--plane", action="store_true", help="use the fast plane-stress model only")
    parser.add_argument(
        "--boundary", default="bearing", choices=BOUNDARIES, help="how the rim is held"
    )
    add_fatigue(parser)
    parser.add_argument(
        "--overload-rad",
        type=float,
        nargs="+",
        default=[],
        metavar="RAD",
        help="deflections after which the permanent set is computed (plane stress)",
    )
    add_friction(parser)
    parser.add_argument(
        "--structure",
        action="store_true",
        help="six directions, natural frequencies, out-of-plane stability, energy per mass",
    )
    add_inertia(parser)
    parser.add_argument("--no-mesh-error", action="store_true", help="skip the mesh series")
    add_output(parser, folder=True)


def add_fatigue(parser: argparse.ArgumentParser) -> None:
    """--load, --torque-history, --history-times, --survival-percent and --surface."""
    parser.add_argument(
        "--load",
        type=float,
        nargs=3,
        action="append",
        default=[],
        metavar=("LOW_NM", "HIGH_NM", "CYCLES"),
        help="a block of the load spectrum for the fatigue check (repeatable)",
    )
    parser.add_argument(
        "--torque-history",
        type=Path,
        metavar="CSV",
        help="recorded torque (column torque_Nm), counted by rainflow into the load spectrum",
    )
    parser.add_argument(
        "--history-times", type=float, default=1.0, metavar="N", help="repetitions of the history"
    )
    parser.add_argument(
        "--survival-percent",
        type=float,
        default=99.0,
        metavar="PERCENT",
        help="share of parts that the stated life must hold for (default 99)",
    )
    parser.add_argument(
        "--surface",
        default="machined",
        choices=tuple(SURFACES),
        help="surface finish, for the fatigue check",
    )


def spectrum_of(arguments: argparse.Namespace, design: SpringDesign) -> list[LoadBlock]:
    """The load spectrum, every option checked.

    Raises
    ------
    DesignError
        If an option is out of range or needs a value that the material lacks.
    """
    spectrum = [LoadBlock(low_Nm=a, high_Nm=b, cycles=n) for a, b, n in arguments.load]
    survival_factor(arguments.survival_percent / 100)
    if arguments.torque_history is not None:
        spectrum += read_blocks(arguments.torque_history, arguments.history_times)
    if spectrum:
        fatigue_strength(design.material)
    check_friction(arguments)
    check_inertia(arguments)
    given = arguments.load_inertia is not None or arguments.hub_inertia is not None
    if given and not arguments.structure:
        raise DesignError("--load-inertia and --hub-inertia need --structure")
    require_angles("overload-rad", arguments.overload_rad)
    if arguments.overload_rad:
        assumed_hardening(design.material)
    return spectrum
