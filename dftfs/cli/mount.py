"""`dftfs mount`: stiffness with hub and rim held by bolts or on an elastic seat."""

import argparse

from dftfs.analysis.structure.mounting import Bolts, Mount, Seat, mounted_stiffness
from dftfs.cli.common import add_design, add_output, emit, read_design
from dftfs.errors import DesignError
from dftfs.spring.rod import wide_over_plane

_WORTH_SAYING = 0.005  # by which a wide strip is stiffer than plane stress


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    add_design(parser)
    for where in ("rim", "hub"):
        add_bolts(parser, where, f"bolts that hold the {where} below their washers")
        parser.add_argument(
            f"--{where}-seat",
            type=float,
            metavar="N_PER_MM3",
            help=f"elastic seat along the {where}'s edge, for example 1000",
        )
    parser.add_argument(
        "--bolt-N-per-mm", type=float, metavar="K", help="shear stiffness of one bolt (rigid)"
    )
    parser.add_argument("--preload-N", type=float, default=0.0, metavar="F", help="of one bolt")
    parser.add_argument("--friction", type=float, default=0.12, metavar="MU", help="(default 0.12)")
    add_output(parser, folder=False)


def add_bolts(parser: argparse.ArgumentParser, where: str, text: str) -> None:
    """--rim-bolts or --hub-bolts, read by `bolts`."""
    parser.add_argument(
        f"--{where}-bolts",
        nargs=3,
        type=float,
        metavar=("COUNT", "HOLE_MM", "CIRCLE_MM"),
        help=f"{text}, for example 8 3.2 165.5",
    )


def bolts(arguments: argparse.Namespace, where: str) -> dict | None:
    """Number of bolts and diameters of hole and circle, None where none are given.

    Raises
    ------
    DesignError
        If the number is not whole.
    """
    given = getattr(arguments, f"{where}_bolts")
    if given is None:
        return None
    count, hole, circle = given
    if count != int(count):
        raise DesignError(f"--{where}-bolts: COUNT = {count:g} must be a whole number, e.g. 8")
    return {"count": int(count), "hole_m": 1e-3 * hole, "circle_m": 1e-3 * circle}


def run(arguments: argparse.Namespace) -> int:
    """Solve twice, print; exit status 1 if a bolted joint slips below the operating torque."""
    design = read_design(arguments)
    mounts = {where: _mount(arguments, where) for where in ("hub", "rim")}
    if not any(mounts.values()):
        raise DesignError("nothing is mounted; for example --rim-bolts 8 3.2 165.5")
    if not (arguments.preload_N >= 0 and 0 < arguments.friction < 2):
        raise DesignError("--preload-N must be 0 or more, --friction above 0, e.g. 3000 and 0.12")
    found = mounted_stiffness(design, mounts["hub"], mounts["rim"])
    asked = design.requirements.operating_torque_Nm
    slips = {
        where: mount.slip_Nm(arguments.preload_N, arguments.friction)
        for where, mount in mounts.items()
        if isinstance(mount, Bolts) and arguments.preload_N > 0
    }
    lines = [
        f"{design.name} (2D, linear): K = {found.rigid_Nm_per_rad:.3f} Nm/rad with rigid edges,"
        f" {found.mounted_Nm_per_rad:.3f} as mounted ({100 * found.change:+.2f} %)"
    ]
    material = design.material
    elastic = material.youngs_modulus_Pa, material.poisson_ratio
    wide = wide_over_plane(design.outline, design.width_m, *elastic)
    if wide > 1 + _WORTH_SAYING:
        lines.append(
            f"plane stress is {100 * (wide - 1):.1f} % too soft for so wide a strip (rod model):"
            " the change in percent stays, both stiffnesses are higher"
        )
    for where, torque in slips.items():
        verdict = "" if asked is None else ("; pass" if torque >= asked else "; FAIL")
        needs = "" if asked is None else f", {asked:g} Nm in operation"
        lines.append(f"the {where}'s joint slips at {torque:.3g} Nm{needs}{verdict}")
    record = {"design": design.name, "stiffness": found, "change": found.change, "slip_Nm": slips}
    record["wide_over_plane"] = wide
    emit(record, "\n".join(lines), as_json=arguments.json)
    return 1 if asked is not None and any(torque < asked for torque in slips.values()) else 0


def _mount(arguments: argparse.Namespace, where: str) -> Mount:
    sizes, seat = bolts(arguments, where), getattr(arguments, f"{where}_seat")
    if sizes is None:
        return None if seat is None else Seat(stiffness_N_per_m3=1e9 * seat)
    if seat is not None:
        raise DesignError(f"--{where}-bolts and --{where}-seat exclude each other")
    each = arguments.bolt_N_per_mm
    return Bolts(**sizes, stiffness_N_per_m=None if each is None else 1e3 * each)
