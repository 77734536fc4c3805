"""The torque curve that a spring should have, for `--fe`: of a CSV file, or of a design."""

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # what the work needs is imported by it: `--help` needs none of it
    from rsea_core.effects.registry import SpringCurve


def read_fe(name: str, say: Callable[[str], None]) -> "SpringCurve":
    """The curve that a spring should have: of a CSV file, or solved of a design."""
    if name.endswith(".csv"):
        from rsea_core.model.spring_curve_file import read_spring_curve

        return read_spring_curve(name)
    from dftfs.analysis.study.actuator import spring_curve
    from dftfs.analysis.torsion.problem import TorsionProblem
    from dftfs.analysis.torsion.solve import solve_torsion  # mesher and engine take a second
    from dftfs.design import load_design

    design = load_design(name)
    problem = TorsionProblem(design=design, dimension=2)
    say(f"spring {design.name}: {problem.model}")
    return spring_curve(solve_torsion(problem, on_progress=say), f"{design.name}, {problem.model}")
