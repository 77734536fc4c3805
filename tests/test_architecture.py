"""The rules of the house, kept by reading the imports of every module."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
MODULES = sorted([*ROOT.glob("dftfs/**/*.py"), *ROOT.glob("rsea_core/**/*.py")])


def name_of(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path: Path) -> set[str]:
    """Every module that a file imports, wherever in the file the import stands."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return found


IMPORTS = {name_of(path): imports_of(path) for path in MODULES}


def importers_of(*targets: str) -> set[str]:
    return {
        module
        for module, imported in IMPORTS.items()
        if any(name == t or name.startswith(t + ".") for name in imported for t in targets)
    }


def inside(module: str, *packages: str) -> bool:
    return any(module == p or module.startswith(p + ".") for p in packages)


def test_there_are_modules_to_check():
    assert {"dftfs.cli.main", "dftfs.fem.newton", "rsea_core.kernel"} <= IMPORTS.keys()


def test_core_never_imports_dftfs():
    assert not {m for m in importers_of("dftfs") if inside(m, "rsea_core")}


def test_fem_knows_no_springs():
    allowed = ("dftfs.fem", "dftfs.errors")
    for module, imported in IMPORTS.items():
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
    assert importers_of("gmsh") == {"dftfs.analysis.meshing"}


def test_only_fem_imports_scikit_fem():
    assert all(inside(m, "dftfs.fem") for m in importers_of("skfem"))
    assert not importers_of("skfem.models")


def test_only_report_modules_draw():
    assert all("report" in m for m in importers_of("matplotlib", "pyvista"))


def test_python_control_is_used_by_its_own_module_only():
    assert importers_of("control") == {"rsea_core.control_objects"}
    assert not importers_of("rsea_core.control_objects")
    assert not importers_of("xarray", "pyarrow", "pandas", "distributed", "dask")


def test_core_is_reached_only_through_the_bridge_and_the_cli():
    outside = {m for m in importers_of("rsea_core") if inside(m, "dftfs")}
    assert all(inside(m, "dftfs.cli", "dftfs.analysis.actuator") for m in outside)


def test_nothing_imports_the_command_line():
    assert all(inside(m, "dftfs.cli") for m in importers_of("dftfs.cli"))


def test_core_layers_import_downwards_only():
    rank = {"errors": 0, "quantities": 0, "rig": 1, "recording": 1, "case": 1, "terms": 2}
    rank |= {"kernel": 3, "model": 3, "simulate": 4, "linearise": 4, "trajectory": 3}
    rank |= {"control": 5, "identify": 5, "report": 6}
    rank |= {"transfer_function": 0, "kinematics": 0, "configurations": 1}
    rank |= {"propagator_modes": 4, "propagator_events": 4, "propagator_kernel": 4}
    rank |= {"propagator": 5, "propagator_batch": 5, "mjcf": 4, "scenario_terms": 3}
    rank |= {"frequency": 4, "bandwidth": 4, "efficiency": 4, "step_metrics": 4}
    rank |= {"step_laws": 3, "step_parts": 3, "stepping": 3, "step_rows": 3, "step_size": 3}
    rank |= {
        "step_loop": 3,
        "step_judge": 3,
        "step_kernel": 3,
        "step_numbers": 4,
        "replay": 4,
        "simulate_stepping": 4,
        "batch": 5,
    }
    rank |= {"angle_reference": 1, "batch": 4, "gym_environment": 5, "comparison_file": 7}
    rank |= {"control_objects": 5, "zero_impedance": 6, "performance": 6, "interop": 6}
    for module, imported in IMPORTS.items():
        part = module.split(".")[1] if inside(module, "rsea_core") and "." in module else None
        for name in imported:
            other = name.split(".")[1] if inside(name, "rsea_core") and "." in name else None
            if part in rank and other in rank and part != other:
                assert rank[other] <= rank[part], f"{module} imports {name}"
    assert not {m for m in importers_of("rsea_core.identify") if inside(m, "rsea_core.control")}
    assert not {m for m in importers_of("rsea_core.control") if inside(m, "rsea_core.identify")}


def test_terms_import_only_their_base():
    for module, imported in IMPORTS.items():
        if inside(module, "rsea_core.terms") and module not in (
            "rsea_core.terms",
            "rsea_core.terms.base",
        ):
            allowed = ("rsea_core.terms.base", "rsea_core.errors", "rsea_core.terms")
            foreign = {i for i in imported if inside(i, "rsea_core") and not inside(i, *allowed)}
            assert not foreign, module


def test_no_import_cycles():
    graph = {
        module: {i for i in imported if i in IMPORTS and i != module}
        for module, imported in IMPORTS.items()
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
        imported = IMPORTS[name_of(path)]
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


def test_modules_stay_readable():
    long = {
        path.name: len(path.read_text(encoding="utf-8").splitlines())
        for path in MODULES
        if len(path.read_text(encoding="utf-8").splitlines()) > 450
    }
    assert not long
