"""The rules of the house, kept by reading the imports of every module."""

import ast
import functools
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cases.places import ROOT
from tests.cases.sources import LIMITS, MODULES, every_statement, exceptions, measured, offenders


def name_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path: Path) -> set[str]:
    """Every module that a file imports, wherever in the file the import stands."""
    found: set[str] = set()
    for node in every_statement(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


@functools.cache
def imports() -> dict[str, set[str]]:
    """What each module imports; not read while tests are collected, which every process does."""
    return {name_of(path): imports_of(path) for path in MODULES}


def importers_of(*targets: str) -> set[str]:
    return {
        module
        for module, imported in imports().items()
        if any(name == t or name.startswith(t + ".") for name in imported for t in targets)
    }


def inside(module: str, *packages: str) -> bool:
    return any(module == p or module.startswith(p + ".") for p in packages)


def test_there_are_modules_to_check():
    assert {
        "dftfs.cli.main",
        "dftfs.fem.newton",
        "rsea_core.engines.event_driven.equations",
    } <= imports().keys()


def test_core_never_imports_dftfs():
    assert not {m for m in importers_of("dftfs") if inside(m, "rsea_core")}


def test_fem_knows_no_springs():
    allowed = ("dftfs.fem", "dftfs.errors")
    for module, imported in imports().items():
        if inside(module, "dftfs.fem"):
            foreign = {i for i in imported if inside(i, "dftfs") and not inside(i, *allowed)}
            assert not foreign - {"dftfs"}, module


def test_spring_geometry_knows_no_fem_cad_or_mesher():
    offenders = importers_of(
        "dftfs.fem", "dftfs.cad", "dftfs.analysis", "gmsh", "skfem", "cadquery"
    )
    assert not {m for m in offenders if inside(m, "dftfs.spring")}


def test_only_cad_imports_cadquery_and_one_file_imports_gmsh():
    assert all(inside(m, "dftfs.cad") for m in importers_of("cadquery", "OCP", "ezdxf", "trimesh"))
    assert importers_of("gmsh") == {"dftfs.analysis.meshing.sector_mesh"}


def test_only_fem_imports_scikit_fem():
    assert all(inside(m, "dftfs.fem") for m in importers_of("skfem"))
    assert not importers_of("skfem.models")


def test_only_report_modules_draw():
    assert all("report" in m for m in importers_of("matplotlib", "pyvista"))


def test_python_control_is_used_by_its_own_module_only():
    assert importers_of("control") == {"rsea_core.interop.python_control"}
    assert not importers_of("rsea_core.interop.python_control")
    assert not importers_of("xarray", "pyarrow", "pandas", "distributed", "dask")


def test_core_is_reached_only_through_the_bridge_and_the_cli():
    readers = {
        "rsea_core.files",
        "rsea_core.files.toml_tables",
        "rsea_core.files.bounded_text",
    }
    reached = {
        module: {i for i in imported if inside(i, "rsea_core")} - readers
        for module, imported in imports().items()
    }  # the readers of TOML and text know no physics and serve both packages
    outside = {
        m
        for m, found in reached.items()
        if inside(m, "dftfs") and any(i.rpartition(".")[0] not in readers for i in found)
    }
    allowed = ("dftfs.cli", "dftfs.analysis.study.actuator", "dftfs.examples")
    assert all(inside(m, *allowed) for m in outside)  # an example is a user's own file


def test_nothing_imports_the_command_line():
    assert all(inside(m, "dftfs.cli", "dftfs.__main__") for m in importers_of("dftfs.cli"))


# every folder of the core, lowest layer first; a folder imports its own layer's folder and below
CORE_LAYERS = (
    ("errors",),
    ("numeric", "files", "recordings.readers.tables"),
    ("machine", "control.fuzzy", "recordings.readers"),
    ("effects",),
    ("terms",),
    ("recordings",),
    ("importing.streams",),
    ("identify.candidates", "importing"),
    ("model", "importing.doctor"),
    ("engines.event_driven",),
    ("engines.fixed_step", "engines.linear", "engines.piecewise_linear"),
    ("simulation",),
    ("identify.smoothing", "identify.friction", "control.laws"),
    ("identify.fitting", "control.stability"),
    ("identify.locate", "control"),
    ("identify.selection", "identify.experiment", "control.tuning"),
    ("identify.judgement", "performance"),
    ("identify.result", "identify.spring_bench", "scenarios", "interop"),
    ("identify.steady_map", "identify.multistep"),
    ("identify.law_search",),
    ("identify.whole_runs",),
    ("identify.formula",),
    ("identify", "engines"),
)
RANK = {folder: rank for rank, layer in enumerate(CORE_LAYERS) for folder in layer}
ANALYSIS_LAYERS = (
    ("meshing", "jobs"),
    ("torsion",),
    ("strength", "sweep"),
    ("structure",),
    ("sizing", "shape"),
    ("study",),
)
ANALYSIS_RANK = {folder: rank for rank, layer in enumerate(ANALYSIS_LAYERS) for folder in layer}
IS_PACKAGE = {name_of(path) for path in MODULES if path.stem == "__init__"}


def folder_of(name: str, top: str) -> str | None:
    """The folder below `top` that a module (or a name in it) stands in."""
    while name not in imports():
        name = name.rpartition(".")[0]
    if name in ("", top) or not inside(name, top):
        return None
    if name.removeprefix(top + ".") == "errors":
        return "errors"
    folder = name if name in IS_PACKAGE else name.rpartition(".")[0]
    return folder.removeprefix(top + ".")


def upward_imports(top: str, rank: dict[str, int]) -> list[str]:
    found = []
    for module, imported in imports().items():
        own = folder_of(module, top) if inside(module, top) and module != top else None
        for name in imported if own is not None else ():
            other = folder_of(name, top) if inside(name, top) else None
            if other is None or other == own:
                continue
            if rank[other] > rank[own] or (rank[other] == rank[own] and module not in IS_PACKAGE):
                found.append(f"{module} imports {name}")
    return sorted(found)


def test_every_folder_of_the_core_has_a_layer():
    folders = {folder_of(m, "rsea_core") for m in imports() if inside(m, "rsea_core")}
    assert folders - {None} == RANK.keys()


def test_core_folders_import_downwards_only():
    assert not upward_imports("rsea_core", RANK)
    assert not {m for m in importers_of("rsea_core.identify") if inside(m, "rsea_core.control")}
    assert not {m for m in importers_of("rsea_core.control") if inside(m, "rsea_core.identify")}


def test_analysis_folders_import_downwards_only():
    top = "dftfs.analysis"
    folders = {folder_of(m, top) for m in imports() if inside(m, top)}
    assert folders - {None} == ANALYSIS_RANK.keys()
    assert not upward_imports(top, ANALYSIS_RANK)


def test_effects_know_the_machine_and_each_other_only():
    allowed = ("rsea_core.effects", "rsea_core.machine", "rsea_core.numeric", "rsea_core.errors")
    for module, imported in imports().items():
        if inside(module, "rsea_core.effects"):
            foreign = {i for i in imported if inside(i, "rsea_core") and not inside(i, *allowed)}
            assert not foreign, module


# one file is one effect, one figure, one command; the rest read well as they are
MANY_MODULES = {"rsea_core/effects", "dftfs/report/figures", "dftfs/cli"}
MANY_MODULES |= {"dftfs/fem", "dftfs/spring", "dftfs/cad", "dftfs/proof"}


def test_folders_hold_about_a_dozen_modules():
    count: dict[str, int] = {}
    for path in MODULES:
        if path.stem != "__init__":
            folder = path.parent.relative_to(ROOT).as_posix()
            count[folder] = count.get(folder, 0) + 1
    assert not {f: n for f, n in count.items() if n > 13 and f not in MANY_MODULES}


def test_no_import_cycles():
    graph = {
        module: {i for i in imported if i in imports() and i != module}
        for module, imported in imports().items()
    }
    done: set[str] = set()

    def visit(module: str, path: tuple[str, ...]) -> None:
        assert module not in path, " -> ".join([*path, module])
        if module in done:
            return
        for other in graph[module]:
            visit(other, (*path, module))
        done.add(module)

    for module in graph:
        visit(module, ())


def test_commands_are_thin():
    for path in (ROOT / "dftfs" / "cli").glob("*.py"):
        lines = len(path.read_text(encoding="utf-8").splitlines())
        assert lines < 130, f"{path.name} has {lines} lines"
        imported = imports()[name_of(path)]
        assert not {i for i in imported if i.split(".")[0] in ("numpy", "scipy", "numba")}, (
            path.name
        )


@pytest.mark.parametrize("package", ["rsea_core", "dftfs"])
def test_import_needs_no_cad_mesher_or_plots(package):
    heavy = ("cadquery", "gmsh", "matplotlib", "pyvista", "skfem", "control", "pyarrow", "xarray")
    heavy += ("distributed",)
    code = f"import sys, {package}; print([m for m in {heavy!r} if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT)
    assert done.stdout.strip() == "[]", done.stderr


@pytest.mark.parametrize("rule", LIMITS)
def test_sizes_keep_their_limits(rule):
    """Lines of modules, classes and functions, and positional arguments."""
    assert not offenders()[rule], f"more than {LIMITS[rule]} {rule}"


def test_long_kernels_have_their_reasons():
    sizes, compiled = measured()
    for key, reason in exceptions()["kernels"].items():
        assert key in compiled, f"{key} is no compiled function"
        assert LIMITS["function_lines"] < sizes["function_lines"][key], f"{key} needs no reason now"
        assert len(reason.split()) >= 5, f"{key}: say why it stays in one piece"
