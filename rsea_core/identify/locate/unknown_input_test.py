"""Whether what the parts of the machine say of a mismatch contradicts what was found.

Innovations are averages: a mode that rings for a second hardly lifts them, and a name that takes
most of a mismatch away is still wrong where the rest shows that it entered at another port. The
likelihood with an unknown signal at each port (`unknown_input`) sees both.
"""

import numpy as np

from rsea_core.effects.variant import Law
from rsea_core.identify.fitting.least_squares import Fit
from rsea_core.identify.fitting.problem import Problem
from rsea_core.identify.locate.unknown_input import fit_jointly, ranked_ports

# log-likelihood beyond what ports of the drive gain: on 60 machines without any effect at most
# 91; on those whose gearbox swung on its mount, some all but hidden in the innovations, 620 and
# more
PLAIN_TO_SEE = 300.0
# a bridge that does not repeat itself gains up to 600 there: not asked where all looks explained
DRIVEN = ("V", "G", "Y:motor_angle_rad", "Y:current_A")
ALIKE = 0.01  # share of the gain within which two ports are not distinguished
OWN = {
    "drive": ("V",),
    "gear": ("G", "S"),  # torques, and angle that is lost behind the motor
    "spring": ("S",),
    "load": ("L",),
    "environment": ("E", "L"),
}


def unmodelled_input_detected(problem: Problem, fit: Fit) -> bool:
    """Whether readings that look explained are far likelier with an unknown signal.

    Not one that a bridge which repeats itself less well than most explains nearly as well: through
    the gear and the spring its wander looks like a slow torque on the load, and like an error of
    the motor's angle.
    """
    found = ranked_ports(problem, fit)
    driven = max((e.gain for e in found if e.port in DRIVEN), default=0.0)
    return any(e.gain - max(driven, 0.0) > PLAIN_TO_SEE for e in found if e.port not in DRIVEN)


def explained_better_by_other_port(problem: Problem, parameters: Fit, fit: Fit) -> bool:
    """Whether an unknown signal at another part explains more without a fit's laws than with them.

    Both sides get one unknown signal: the laws one at a part of theirs, for a law of the right
    effect is only nearly the machine's, parameters alone one at any other part that readings tell
    from theirs (without a spring, say, gear and load are one body). If those do better then, the
    laws have only imitated what arises there.

    Parameters
    ----------
    parameters : Fit
        Without laws.
    fit : Fit
        With the laws in question.
    """
    own = {port for law in fit.hypothesis.laws for port in _own(law)}
    without = ranked_ports(problem, parameters)
    mine = max((e.log_posterior for e in without if e.port in own), default=-np.inf)
    others = [
        e for e in without
        if e.port not in own and e.gain > 0.0 and e.log_posterior - mine > ALIKE * e.gain
    ]  # fmt: skip
    if not others:
        return False
    ranked = ranked_ports(problem, fit)
    alone = ranked[0].log_posterior - ranked[0].gain
    named = max((alone, *(e.log_posterior for e in ranked if e.port in own)))
    return fit_jointly(problem, parameters, others[0]).log_posterior > named


def _own(law: Law) -> tuple[str, ...]:
    """Ports at which an unknown signal could be what a law of this effect lacks."""
    if law.subsystem.startswith("sensor:"):
        return (f"Y:{law.subsystem.removeprefix('sensor:')}",)
    return OWN.get(law.subsystem, ())
