"""Options that the study and the verification share: friction loop, inertia of the ends."""

import argparse
from typing import TYPE_CHECKING

from dftfs.errors import DesignError

if TYPE_CHECKING:  # what the work needs is imported by it: `--help` needs none of it
    from dftfs.analysis.torsion.result import StiffnessResult
    from dftfs.design import MeshChoice, SpringDesign

_LOOP_BEYOND = 1.35  # of the first contact's deflection


def add_friction(parser: argparse.ArgumentParser) -> None:
    """--contact-friction and --loop-rad."""
    parser.add_argument(
        "--contact-friction",
        type=float,
        metavar="MU",
        help="Coulomb friction between the coils: adds a loading-unloading loop (plane stress)",
    )
    parser.add_argument(
        "--loop-rad",
        type=float,
        metavar="RAD",
        help="deflection at which the loop reverses (default: 1.35 times first contact, unwinding)",
    )


def add_mesh(parser: argparse.ArgumentParser) -> None:
    """--size and --layers."""
    parser.add_argument(
        "--size",
        type=float,
        metavar="FACTOR",
        help="element size relative to the default (0.5: half); else the design file's mesh_size",
    )
    parser.add_argument(
        "--layers",
        type=int,
        metavar="N",
        help="elements through half the width; else the design file's mesh_layers (default 1)",
    )


def mesh_of(arguments: argparse.Namespace, design: "SpringDesign") -> "MeshChoice":
    """The mesh that the options, else the design file, ask for.

    Raises
    ------
    DesignError
        If a size or number of layers is out of range.
    """
    from dftfs.design import MeshChoice

    size = design.mesh.size if arguments.size is None else arguments.size
    layers = design.mesh.layers if arguments.layers is None else arguments.layers
    return MeshChoice(size=size, layers=layers)


def loop_end(arguments: argparse.Namespace, free: "StiffnessResult") -> float | None:
    """Where the loop turns back, None where no loop is asked for.

    Raises
    ------
    DesignError
        If a turning point has no friction, or the coils do not touch when unwinding.
    """
    from dftfs.analysis.torsion.result import UNWINDING

    if arguments.contact_friction is None:
        return None
    if arguments.loop_rad is not None:
        return arguments.loop_rad
    onset = free.contact_onset.get(UNWINDING)
    if onset is None:
        raise DesignError(
            "the coils do not touch in unwinding: give the turning point with --loop-rad"
        )
    return _LOOP_BEYOND * onset.deflection_rad


def add_inertia(parser: argparse.ArgumentParser) -> None:
    """--load-inertia and --hub-inertia."""
    parser.add_argument(
        "--load-inertia",
        type=float,
        metavar="KG_M2",
        help="inertia that turns with the rim (kg m2)",
    )
    parser.add_argument(
        "--hub-inertia", type=float, metavar="KG_M2", help="inertia that turns with the hub (kg m2)"
    )


def check_inertia(arguments: argparse.Namespace) -> None:
    """Refuse an inertia that is none.

    Raises
    ------
    DesignError
        If one is negative or no number.
    """
    from dftfs.analysis.structure.modes import require_inertia

    for name in ("load_inertia", "hub_inertia"):
        value = getattr(arguments, name)
        if value is not None:
            require_inertia(name.replace("_", "-"), value)


def check_friction(arguments: argparse.Namespace) -> None:
    """Refuse the options of a loop before anything is solved.

    Raises
    ------
    DesignError
        If a number is out of range, or a turning point has no friction.
    """
    from dftfs.analysis.strength.friction_loop import require_loop

    if arguments.contact_friction is not None:
        require_loop(arguments.contact_friction, arguments.loop_rad or 1.0)
        if arguments.loop_rad is not None:
            require_loop(arguments.contact_friction, arguments.loop_rad)
    elif arguments.loop_rad is not None:
        raise DesignError("--loop-rad needs --contact-friction: without friction there is no loop")
