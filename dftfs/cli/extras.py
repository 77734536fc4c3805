"""Which extra of pyproject.toml brings a library that a command lacks."""

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
