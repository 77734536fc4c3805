"""Formulas of what has no name, fitted in windows and confirmed as named laws are.

An unknown torque is a sum of functions of angle and speed; a drive may be a static function of its
command (docs/diagnosis-search.md 10.5).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rsea_core.effects.drive_dead_zone import DriveDeadZone
from rsea_core.effects.drive_nonlinear_gain import DriveNonlinearGain
from rsea_core.effects.drive_saturation import DriveSaturation
from rsea_core.effects.formula_torque import FORMULAS, FormulaTorque, formula_law
from rsea_core.effects.load_inertia_variation import LoadInertiaVariation
from rsea_core.identify.fitting.problem import Hypothesis
from rsea_core.identify.formula.sparse_regression import STATES, Selection, select
from rsea_core.identify.formula.varying_inertia import VaryingInertia, varying_inertia
from rsea_core.identify.law_search.candidate_fits import at_bound, confirmed, gain_of, settled
from rsea_core.identify.law_search.found import Found, Step
from rsea_core.identify.law_search.hold_out import held_out
from rsea_core.identify.law_search.screening import Projection
from rsea_core.identify.law_search.shape_search import Shape, ports
from rsea_core.identify.multistep.criteria import (
    FURTHER_GAIN,
    INERTIA_GAIN,
    INERTIA_LEAST,
    INERTIA_RATIO,
    KEPT_RATIO,
    LEAST_GAIN,
    MUCH_LEFT,
    PER_VALUE,
    SHAPE_GAIN,
    SHAPE_RATIO,
)
from rsea_core.identify.multistep.estimator import Estimate, Estimator
from rsea_core.identify.whole_runs.sensor_noise import (
    converged,
    in_sensor_noise,
    misfit,
    refitted_from_rig,
)
from rsea_core.identify.window_fit import fit_of, spread_of
from rsea_core.machine.inputs import POSITION_COMMAND

OF_COMMAND = (DriveSaturation.effect, DriveDeadZone.effect)
OF_SHAPE = 0.6  # of the free shape's held-out gain, that a formula must reach


@dataclass(frozen=True, kw_only=True)
class Formula:
    """An unknown torque as a sum of terms, confirmed.

    Attributes
    ----------
    deviations : tuple of float
        Of the coefficients, Nm.
    of_shape : float or None
        Held-out gain of the regression over that of a free function of one signal, if one is seen.
    held_out : float or None
        Gain on recordings, or parts of them, that were not fitted.
    """

    selection: Selection
    term: FormulaTorque
    deviations: tuple[float, ...]
    estimator: Estimator
    fit: Estimate
    gain: float
    ratio: float
    of_shape: float | None
    held_out: float | None

    @property
    def side(self) -> str:
        """Part of the machine."""
        return self.term.side

    def sentence(self) -> str:
        """What it is, with the formula."""
        return f"a torque of angle and speed together; {self.text()}"

    def report(self) -> dict:
        """The formula as data."""
        chosen = self.selection
        sizes = zip(self.term.terms, self.deviations, chosen.shares, strict=True)
        return {
            "words": self.text(),
            "usual_speed_rad_per_s": chosen.usual_speed_rad_per_s,
            "share_of_free_function": self.of_shape and round(self.of_shape, 3),
            "terms": [
                {"function": term.text(), "coefficient_Nm": size, "std_Nm": std, "selected": share}
                for (size, term), std, share in sizes
            ],
        }

    def text(self) -> str:
        """The formula with its error bars."""
        place = "on the load" if self.selection.port == "L" else "at the gear's output"
        return f"tau = {self.term.sum_text(self.deviations)} {place}"


@dataclass(frozen=True, kw_only=True)
class CommandFormula:
    """A drive's gain as a function of its command, confirmed.

    Attributes
    ----------
    deviations : tuple of float
        Of the coefficients.
    """

    term: DriveNonlinearGain
    deviations: tuple[float, ...]
    estimator: Estimator
    fit: Estimate
    gain: float
    ratio: float
    side: str = "drive"

    def text(self) -> str:
        """The formula with its error bars."""
        sign, size, square = self.deviations
        return (
            f"acting command = u + ({self.term.by_sign:.3g} +- {sign:.1g}) |u|"
            f" + ({self.term.by_size:.3g} +- {size:.1g}) u |u|"
            f" + ({self.term.by_square:.3g} +- {square:.1g}) u^3"
        )

    def sentence(self) -> str:
        """What it is, with the formula."""
        return f"the drive's output is not in proportion to its command; {self.text()}"

    def report(self) -> dict:
        """The formula as data."""
        names = ("by_sign", "by_size", "by_square")
        sizes = zip(names, self.deviations, strict=True)
        return {
            "words": self.text(),
            "terms": [
                {"function": function, "coefficient": getattr(self.term, name), "std": std}
                for function, (name, std) in zip(("|u|", "u |u|", "u^3"), sizes, strict=True)
            ],
        }


def unnamed_formula(
    found: Found, shape: Shape | None, say: Callable[[str], None],
    instead: CommandFormula | None = None,
) -> tuple[Shape | None, Formula | CommandFormula | VaryingInertia | None]:  # fmt: skip
    """What has no name: its shape, and a formula of the command if that predicts, or of the motion.

    A formula of the command, or an inertia that varies, takes the place of the shape; beside laws
    there is none. Where parameters leave little more than noise, a formula of the command alone is
    tried. Where commands are smoothed, a torque on the body that they move is not reported:
    commands that the log lacks may cause it.

    Parameters
    ----------
    instead : CommandFormula or None
        The one that took the place of a law.
    """
    if instead is not None:
        return None, instead
    if found.problem.timing.smooth and not _beyond_spring(found, shape):
        return None, None
    if found.steps:
        return shape, None
    if found.sound:
        return None, command_formula_of(found, say) if found.beyond_noise else None
    if shape is None or shape.signal in ("command", "current"):
        formula = command_formula_of(found, say)
        if formula is not None:
            return None, formula
    inertia = inertia_of(found, shape, say)
    if inertia is not None:
        return None, inertia
    return shape, formula_of(found, shape, say)


def inertia_of(
    found: Found, shape: Shape | None, say: Callable[[str], None] = lambda _: None
) -> VaryingInertia | None:
    """An inertia that varies with the angle; None where a shape gains as much, or none is seen.

    It gains where the motion is fast: the gain is less even than that of a torque. A small gain
    counts where its fit is confirmed. A linear axis has no turn.
    """
    if found.problem.case.rig.axis == "linear":
        return None
    projection = Projection(found.base_estimator, found.base)
    places = [port for port in ports(found.base_estimator.tracks[0]) if port in STATES]
    trials = [varying_inertia(projection, found.base, port) for port in places]
    best = max(filter(None, trials), key=lambda w: w.held_out, default=None)
    if best is None:
        return None
    say(f"  {best.sentence()}: held-out gain {best.held_out:.1f} +- {best.deviation:.1f}")
    least = max(SHAPE_GAIN, INERTIA_RATIO * best.deviation, shape.held_out if shape else 0.0)
    if best.held_out < least or not INERTIA_LEAST < best.share < 1.0:
        return None
    wave, stands = _fitted_inertia(found, best, say)
    return wave if stands or best.held_out > INERTIA_GAIN else None


def _fitted_inertia(found: Found, wave: VaryingInertia, say) -> tuple[VaryingInertia, bool]:
    """The inertia fitted, and whether the fit is confirmed by the criteria of a torque's formula.

    The inertia as regressed, if it is not that of the load.
    """
    own, base, case = found.base_estimator, found.base, found.problem.case
    inertia = own.tracks[0].plant.load_inertia
    if wave.side != "load" or not 0.0 < wave.amplitude_kgm2 < inertia or not case.rig.has("load"):
        return wave, False
    law = LoadInertiaVariation.unnamed(wave.cycles)
    part, shares = law.unknowns[0], np.array([wave.cosine_kgm2, wave.sine_kgm2]) / inertia
    parts = np.clip(shares, part.low, part.high) / part.scale
    h = Hypothesis(laws=(*base.hypothesis.laws, law))
    own, fit = settled(own, own.fit(h, np.concatenate([base.x, parts]), iterations=8))
    gain, ratio = gain_of(own, base, fit), confirmed(own, base, fit)
    say(f"  fitted: gain {gain:.1f}, ratio {ratio:.1f}")
    if gain < LEAST_GAIN or at_bound(own.problem, fit, law):
        return wave, False
    stands = gain > SHAPE_GAIN and ratio > KEPT_RATIO
    stands = stands and not _loses_held_out(found, own, fit, law, gain, ratio)
    own, fit = _in_whole_recordings(found, (own, fit))
    nominal, laws = own.problem.values(h, fit.x)
    inertia = nominal.get("load_inertia_kgm2", case.rig.load_inertia_kgm2)
    cosine, sine = (inertia * laws[-1][f"{part}_share"] for part in ("cosine", "sine"))
    share = wave.share * float(np.hypot(cosine, sine)) / wave.amplitude_kgm2
    return (
        replace(wave, cosine_kgm2=cosine, sine_kgm2=sine, share=share, estimator=own, fit=fit),
        stands,
    )


def _in_whole_recordings(
    found: Found, windows: tuple[Estimator, Estimate]
) -> tuple[Estimator, Estimate]:
    """A law's fit to whole recordings, if it leaves far less than parameters alone; else as given.

    In windows an unknown torque may explain in part what the law's values should.
    """
    h, x = windows[1].hypothesis, windows[1].x
    own = in_sensor_noise(found.base_estimator, found.base)
    fit = refitted_from_rig(own, converged(own, h, x))
    before = misfit(own, found.base.hypothesis, found.base.x)
    return (own, fit) if misfit(own, h, fit.x) < MUCH_LEFT * before else windows


def _beyond_spring(found: Found, shape: Shape | None) -> bool:
    """Whether an unknown torque acts where no command does: in a spring or behind it."""
    sprung = "S" in ports(found.estimator.tracks[0])
    return sprung and shape is not None and shape.port in ("S", "L")


def gain_over_named(found: Found, say: Callable[[str], None]) -> CommandFormula | None:
    """A formula of the command that says clearly more than the drive's law that was named.

    A limit or a dead zone is the nearest name of a gain that falls or grows with the command.
    """
    if len(found.steps) != 1 or found.steps[0].law.effect not in OF_COMMAND:
        return None
    formula = command_formula_of(found, say)
    clearly = found.steps[0].gain + FURTHER_GAIN
    return formula if formula is not None and formula.gain > clearly else None


def command_formula_of(found: Found, say: Callable[[str], None]) -> CommandFormula | None:
    """The drive's gain as a function of its command; None where none is confirmed."""
    estimator, base = found.base_estimator, found.base
    commands = [t.experiment.recording for t in estimator.tracks]
    span = max((float(np.max(np.abs(r[r.command_name]))) for r in commands if r.command_name
                and r.command_name != POSITION_COMMAND), default=0.0)  # fmt: skip
    if span == 0.0:
        return None
    law = DriveNonlinearGain.unnamed(span)
    h = Hypothesis(laws=(*base.hypothesis.laws, law))
    x = np.concatenate([base.x, np.zeros(len(law.unknowns))])
    own, fit = settled(estimator, estimator.fit(h, x, iterations=8))
    gain = gain_of(own, base, fit) - PER_VALUE * len(law.unknowns)
    if gain < SHAPE_GAIN or at_bound(own.problem, fit, law):
        return None
    ratio = confirmed(own, base, fit)
    say(f"  gain of the drive by its command: gain {gain:.1f}, ratio {ratio:.1f}")
    unit_steps = np.array([p.scale for p in law.unknowns])
    std = spread_of(own, fit_of(own, fit)).std[-len(unit_steps) :] * unit_steps
    values = own.problem.values(h, fit.x)[1][-1]
    sizes = np.array([values[p.name] for p in law.unknowns])
    if (
        ratio < SHAPE_RATIO
        or np.all(np.abs(sizes) < 3.0 * std)
        or _loses_held_out(found, own, fit, law, gain, ratio)
    ):
        return None
    return CommandFormula(
        term=law.term(values, found.problem.case.rig), deviations=tuple(float(s) for s in std),
        estimator=own, fit=fit, gain=gain, ratio=ratio,
    )  # fmt: skip


def _loses_held_out(found: Found, own: Estimator, fit: Estimate, law, gain, ratio) -> bool:
    """Whether a law does no better than parameters alone on rows that were not fitted."""
    step = Step(law=law, screened=gain, gain=gain, ratio=ratio, tempering=own.tempering,
                rivals=())  # fmt: skip
    unseen = held_out(replace(found, steps=[step], estimator=own, best=fit))
    return unseen is not None and unseen.gain <= 0.0


def formula_of(
    found: Found, shape: Shape | None, say: Callable[[str], None] = lambda _: None
) -> Formula | None:
    """The formula of an unknown torque; None where no sum of the library is confirmed.

    Parameters
    ----------
    shape : Shape or None
        The torque as a free function of one signal; None: none is seen, and a function of angle
        and speed together may be there all the same.
    """
    estimator, base = found.base_estimator, found.base
    projection = Projection(estimator, base)
    places = ports(estimator.tracks[0]) if shape is None else (shape.port,)
    chosen = [select(projection, port) for port in places if port in FORMULAS]
    chosen = max(filter(None, chosen), key=lambda s: s.held_out, default=None)
    if chosen is None:
        return None
    sizes = zip(chosen.coefficients, chosen.terms, strict=True)
    text = " + ".join(f"{size:.3g} {term.text()}" for size, term in sizes)
    say(f"  formula {text}: held-out gain {chosen.held_out:.1f} +- {chosen.deviation:.1f}")
    least = max(SHAPE_GAIN, SHAPE_RATIO * chosen.deviation)
    if chosen.held_out < max(least, OF_SHAPE * (shape.held_out if shape else 0.0)):
        return None
    return _fitted(found, chosen, shape, say)


def _fitted(found: Found, chosen: Selection, shape: Shape | None, say) -> Formula | None:
    estimator, base = found.base_estimator, found.base
    torque = float(estimator.tracks[0].scale.torque_Nm[int(chosen.port == "L")])
    law = formula_law(chosen.port, chosen.terms, chosen.usual_speed_rad_per_s, torque)
    h = Hypothesis(laws=(*base.hypothesis.laws, law))
    scale = law.unknowns[0].scale
    x = np.concatenate([base.x, np.array(chosen.coefficients) / scale])
    own, fit = settled(estimator, estimator.fit(h, x, iterations=8))
    gain, ratio = gain_of(own, base, fit), confirmed(own, base, fit)
    say(f"  fitted: gain {gain:.1f}, ratio {ratio:.1f}")
    count = len(chosen.terms)
    if gain < LEAST_GAIN + PER_VALUE * count or ratio < KEPT_RATIO:
        return None
    std = spread_of(own, fit_of(own, fit)).std[-count:] * scale
    values = own.problem.values(h, fit.x)[1][-1]
    term = law.term(values, found.problem.case.rig)
    sizes = np.array([abs(values[f"coefficient_{j}_Nm"]) for j in range(1, count + 1)])
    if np.any(sizes < 2.0 * std):
        return None
    step = Step(law=law, screened=chosen.held_out, gain=gain, ratio=ratio,
                tempering=own.tempering, rivals=())  # fmt: skip
    unseen = held_out(replace(found, steps=[step], estimator=own, best=fit))
    if unseen is not None and unseen.gain <= 0.0:
        return None
    return Formula(selection=chosen, term=term, deviations=tuple(float(s) for s in std),
                   estimator=own, fit=fit, gain=gain, ratio=ratio,
                   of_shape=None if shape is None else chosen.held_out / shape.held_out,
                   held_out=None if unseen is None else unseen.gain)  # fmt: skip
