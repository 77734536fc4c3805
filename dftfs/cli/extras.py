"""Libraries that pyproject.toml names: which are here, and which extra brings one that is not."""

from collections.abc import Mapping

EXTRA_OF = {
    **dict.fromkeys(("skfem", "gmsh", "rainflow", "pypardiso"), "fe"),
    **dict.fromkeys(("cadquery", "OCP", "trimesh", "ezdxf"), "cad"),
    **dict.fromkeys(("pyvista", "vtk", "vtkmodules"), "render"),
}


def missing_library(error: Exception) -> str:
    """One line for an import of such a library that failed; empty for any other error."""
    name = (getattr(error, "name", None) or "").partition(".")[0]
    if not isinstance(error, ModuleNotFoundError) or name not in EXTRA_OF:
        return ""
    return f"{name} is not installed: pip install 'dftfs[{EXTRA_OF[name]}]'"


def versions() -> Mapping[str, str]:
    """Every library that pyproject.toml names, with its version or `not installed`."""
    return {name: installed(name) or "not installed" for name, _ in requirements()}


def installed(name: str) -> str:
    """The version of an installed library, empty if there is none."""
    from importlib.metadata import PackageNotFoundError, version  # `dftfs --help` needs it not

    try:
        return version(name)
    except PackageNotFoundError:
        return ""


def requirements() -> list[tuple[str, str]]:
    """Library and extra of each requirement of this program; the extra is empty for all."""
    import re
    from importlib.metadata import PackageNotFoundError, requires

    try:
        lines = requires("dftfs") or ()
    except PackageNotFoundError:  # run from its sources, not installed
        lines = ()
    split = [re.match(r'([\w.-]+)(?:.*extra == "(\w+)")?', line) for line in lines]
    return [(m[1], m[2] or "") for m in split if m]
