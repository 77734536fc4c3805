"""The bridge to `rsea_core`: the spring's finite-element curve as the actuator's spring."""

from dataclasses import replace

from dftfs.analysis.torsion.result import UNWINDING, WINDING, StiffnessResult
from rsea_core.effects.registry import SpringCurve
from rsea_core.scenarios.scenario import Scenario, ScenarioResult, run_scenario


def spring_curve(result: StiffnessResult, source: str) -> SpringCurve:
    """The contact-free curve of a result as a spring of the actuator, both directions.

    Deflection of the actuator's spring (gear output less load) winds when the hub turns against the
    rim negatively: the rim is the load side, so the actuator's positive deflection unwinds the
    arms. The curve is mirrored accordingly.
    """
    onset = result.contact_onset
    wound, unwound = onset.get(WINDING), onset.get(UNWINDING)
    return SpringCurve(
        deflection_rad=-result.deflection_rad[::-1],
        torque_Nm=-result.torque_Nm[::-1],
        tangent_Nm_per_rad=result.tangent_Nm_per_rad[::-1],
        contact_onset_rad=(
            None if wound is None else -wound.deflection_rad,
            None if unwound is None else -unwound.deflection_rad,
        ),
        source=source,
    )


def run_with_spring(scenario: Scenario, result: StiffnessResult, source: str) -> ScenarioResult:
    """Run a scenario with the spring of a result in place of its own."""
    return run_scenario(
        replace(scenario, spring_design=source), spring=spring_curve(result, source)
    )
