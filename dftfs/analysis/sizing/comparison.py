"""Known designs, on a sizing's grid or off it, judged by its own rules."""

from dataclasses import dataclass

from dftfs.analysis.sizing.rod_candidate import Candidate, assess_values
from dftfs.analysis.sizing.task import SizingTask
from dftfs.design import SpringDesign, load_design


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A design by name, how it stands, and its dimensions that are not on the task's grids."""

    name: str
    candidate: Candidate
    off_grid: tuple[str, ...]

    def lines(self) -> list[str]:
        """For people: what it is, and each limit that it breaks."""
        one = self.candidate
        if one.mass_kg is None or one.stress_Pa is None:
            return [f"{self.name}: cannot be judged: {one.why}"]
        broken = [
            f"{limit.name} {limit.found:.4g} {limit.unit} against {limit.asked:.4g}"
            for limit in one.limits
            if limit.margin < 0
        ]
        found_lines = [
            f"{self.name} as it is: {one.mass_kg * 1e3:.1f} g, K = {one.stiffness_Nm_per_rad:.2f}"
            f" Nm/rad, {one.stress_Pa / 1e6:.0f} MPa",
            "  breaks " + "; ".join(broken) if broken else "  within every limit",
        ]
        if self.off_grid:
            found_lines.append(f"  not on the grids: {', '.join(self.off_grid)} (errata S19)")
        return found_lines


def compare(task: SizingTask) -> tuple[Comparison, ...]:
    """Judge the designs that a task names, by its material and with its rings.

    Raises
    ------
    DesignError
        If a name is no design.
    """
    return tuple(_judged(task, load_design(name)) for name in task.compare)


def _judged(task: SizingTask, design: SpringDesign) -> Comparison:
    p = design.spiral
    values = {
        "thickness_mm": 1e3 * p.thickness_m,
        "inner_radius_mm": 1e3 * p.inner_radius_m,
        "outer_radius_mm": 1e3 * p.outer_radius_m,
        "turns": p.turns,
        "fillet_radius_mm": 1e3 * p.fillet_radius_m,
    }
    width = 1e3 * design.width_m
    named = {**values, "width_mm": width}
    off = tuple(
        f"{name} {value:g}" for name, value in named.items() if not task.by_name[name].holds(value)
    )
    candidate = assess_values(task, values, width_mm=width)
    return Comparison(name=design.name, candidate=candidate, off_grid=off)
