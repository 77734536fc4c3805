"""`dftfs materials`: the table, every value with its source."""

import argparse
from pathlib import Path

from dftfs.cli.common import add_output, emit, table
from dftfs.material import Material, builtin_materials, load_materials, lookup, properties


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of the command."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="show all values of one material")
    parser.add_argument("--file", type=Path, metavar="TOML", help="add the materials of a file")
    add_output(parser, folder=False)


def run(arguments: argparse.Namespace) -> int:
    """Print the table or one material."""
    extra = load_materials(arguments.file) if arguments.file else ()
    if arguments.name:
        material = lookup(arguments.name, extra=extra)
        emit(_whole(material), _sheet(material), as_json=arguments.json)
        return 0
    materials = (*builtin_materials(), *extra)
    emit([_whole(m) for m in materials], _overview(materials), as_json=arguments.json)
    return 0


def _whole(material: Material) -> dict:
    rows = {p.key: {"value": p.value, "source": p.source} for p in properties(material)}
    about = {"name": material.name, "family": material.family, "creeps": material.creeps}
    return {**about, "note": material.note, "errata": material.errata, "values": rows}


def _overview(materials: tuple[Material, ...]) -> str:
    def number(value: float | None, scale: float) -> str:
        return "-" if value is None else f"{value / scale:.4g}"

    rows = [
        [
            m.name,
            number(m.youngs_modulus_Pa, 1e9),
            f"{m.poisson_ratio:.3g}",
            f"{m.density_kg_per_m3:.0f}",
            number(m.yield_strength_Pa, 1e6),
            number(m.ultimate_strength_Pa, 1e6),
            number(m.fatigue_strength_Pa, 1e6),
            "creeps" if m.creeps else ("as printed" if m.as_printed else ""),
        ]
        for m in materials
    ]
    header = ["material", "E GPa", "nu", "kg/m3", "yield MPa", "ultimate MPa", "fatigue MPa", ""]
    foot = "\n`dftfs materials NAME` shows the source of every value."
    return table(header, rows) + foot


def _sheet(material: Material) -> str:
    rows = [[p.key, f"{p.value:.6g}", p.source] for p in properties(material)]
    lines = [f"{material.name}: {material.description}", table(["value", "", "source"], rows)]
    lines += [f"strengths: {material.strength_basis}"] if material.strength_basis else []
    lines += [f"buy: {material.alloy}"] if material.alloy else []
    lines += [f"no strengths: {material.no_strengths}"] if material.no_strengths else []
    lines += [f"note: {material.note}"] if material.note else []
    lines += [f"errata: {', '.join(material.errata)}"] if material.errata else []
    return "\n".join(lines)
