"""Terms that the rig file of a case states: physics that the machine is known to have.

A data sheet's friction torque belongs to the machine before any recording is made. Such a term is
part of every hypothesis of a diagnosis, its stated values free within a tolerance, as those of
[rig] are (Bayesian priors: Ljung, System Identification (1999), section 7.4).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace

from rsea_core.effects.base import Port, Term
from rsea_core.effects.drive_delay import DriveDelay
from rsea_core.effects.drive_offset import DriveOffset
from rsea_core.effects.drive_thermal import DriveThermal
from rsea_core.effects.formula_torque import FormulaTorque
from rsea_core.effects.gear_backlash import GearBacklash
from rsea_core.effects.load_disturbance import LoadDisturbance
from rsea_core.effects.registry import LAWS
from rsea_core.effects.typical import TypicalMagnitudes
from rsea_core.effects.variant import Law, Unknown, candidates_of, writes_numbers
from rsea_core.errors import RseaError, TermError
from rsea_core.machine.rig import Rig
from rsea_core.terms.tables import TOLERANCE, term_from_table

USUAL_TOLERANCE = 0.5  # of a stated value, relative: data sheets give typical values or limits
OF_RECORDINGS = (DriveThermal, LoadDisturbance)  # depend on what was before, or when
OTHERWISE = (DriveOffset, FormulaTorque, GearBacklash)  # estimated anyway; by number; of two bodies
COUNT = "cycles"  # in the name of a count, which a fit does not move
RANGE = 1e3  # a fit may leave a stated value by this factor
STEP = 0.2  # tolerances that a step of a fit is worth
HELD_LOADS_SPARE = (Port.LOAD, Port.ENVIRONMENT)


@dataclass(frozen=True, kw_only=True)
class KnownTerm:
    """A term with how well it is known.

    Attributes
    ----------
    term : Term
    stated : tuple of str
        The parameters that the file states: a fit moves those above zero that are no counts.
    tolerance : float
        Relative standard deviation of their values.
    """

    term: Term
    stated: tuple[str, ...]
    tolerance: float = USUAL_TOLERANCE

    def law(self, typical: TypicalMagnitudes) -> Law:
        """The term as a part of every hypothesis.

        Stated values are free within the tolerance. Of the form of a law that data sheets give one
        value of, as presliding beside a friction torque, the values of `Term.known_form` are free.
        """
        kind, unknowns, starts = type(self.term), [], []
        form = self._form(typical)
        for name, p in self.term.parameters().items():
            if name in form:
                unknown, start = form[name]
                unknowns.append(unknown)
                starts.append(start)
                continue
            free, low, high = self._is_free(name), *p.bounds
            if free:
                low, high = max(low, p.value / RANGE), min(high, p.value * RANGE)
            unknowns.append(
                Unknown(name=name, unit=p.unit, low=low, high=high, log=free,
                        scale=STEP * self.tolerance if free else 0.0,
                        prior=self.tolerance if free else None)
            )  # fmt: skip
            starts.append(p.value)
        return Law(
            effect=kind.effect, law=kind.law, subsystem=kind.port.value[0], kind=kind,
            unknowns=tuple(unknowns), starts=(tuple(starts),), nuisance=True, known=True,
            write=writes_numbers(kind, moving_load=kind.port in HELD_LOADS_SPARE),
        )  # fmt: skip

    def without_form(self, typical: TypicalMagnitudes) -> "KnownTerm":
        """The same, its form as stated: friction that the file states no presliding of is rigid."""
        return replace(self, stated=(*self.stated, *self._form(typical)))

    def _is_free(self, name: str) -> bool:
        return name in self.stated and COUNT not in name and getattr(self.term, name) > 0.0

    def _form(self, typical: TypicalMagnitudes) -> dict[str, tuple[Unknown, float]]:
        """Free values of the law's form that the file does not state, and where they start."""
        kind = type(self.term)
        for law in candidates_of(kind, typical) if kind.known_form else ():
            if law.law == kind.known_form:
                pairs = zip(law.unknowns, law.starts[0], strict=True)
                free = {u.name: (u, start) for u, start in pairs if u.name not in self.stated}
                try:
                    replace(self.term, **{name: start for name, (_, start) in free.items()})
                except TermError:  # another form is stated
                    return {}
                return free
        return {}

    def to_toml(self) -> str:
        """Its [[term]] table, with what differs from the defaults alone."""
        kind = type(self.term)
        lines = ["[[term]]", f'effect = "{kind.effect}"']
        lines += [] if kind is next(iter(LAWS[kind.effect].values())) else [f'law = "{kind.law}"']
        lines += [
            f"{f.name} = {getattr(self.term, f.name)!r}" for f in fields(kind)
            if f.name in self.stated or getattr(self.term, f.name) != f.default
        ]  # fmt: skip
        lines += [] if self.tolerance == USUAL_TOLERANCE else [f"{TOLERANCE} = {self.tolerance!r}"]
        return "\n".join(lines) + "\n"


def known_terms(tables: Mapping, rig: Rig, where: str) -> tuple[KnownTerm, ...]:
    """The terms of the [[term]] tables of a rig file.

    Parameters
    ----------
    tables : mapping
        All tables of the file.
    where : str
        The file, for messages.

    Raises
    ------
    TermError
        If a table cannot be used, a term is there twice, or it is none that a rig file can state.
    """
    listed = tables.get("term", [])
    if not isinstance(listed, list):
        raise TermError(f"{where}: term must be a list, each one written [[term]]")
    found: list[KnownTerm] = []
    for position, entries in enumerate(listed, 1):
        place = f"{where}: term {position}"
        try:
            term = term_from_table(entries, position)
            _require_known_kind(term, rig, f"term {position} ({term.effect})")
        except RseaError as problem:
            raise TermError(f"{where}: {problem}") from problem
        if any(other.term.effect == term.effect for other in found):
            raise TermError(f"{place}: {term.effect} is there twice: keep one")
        bounds = term.parameters()
        known = KnownTerm(term=term, stated=tuple(k for k in entries if k in bounds))
        if TOLERANCE in entries:
            known = replace(known, tolerance=float(entries[TOLERANCE]))
        found.append(known)
    return tuple(found)


def is_stateable(kind: type[Term]) -> bool:
    """Whether a rig file can state a term: it acts in the machine by its own numbers alone."""
    own = all(getattr(kind, name) is getattr(Term, name) for name in ("on_spring", "on_plant"))
    of_numbers = all("bounds" in f.metadata for f in fields(kind))
    known = kind.port is not Port.SENSOR and not issubclass(kind, (*OF_RECORDINGS, *OTHERWISE))
    return own and of_numbers and known and kind.replaces is None


def _require_known_kind(term: Term, rig: Rig, place: str) -> None:
    if not is_stateable(type(term)):
        names = [e for e, laws in LAWS.items() if any(map(is_stateable, laws.values()))]
        raise TermError(f"{place}: a rig file can state {', '.join(names)}")
    if term.effect == DriveDelay.effect and rig.servo_delay_s is not None:
        raise TermError(f"{place}: servo_delay_s in [rig] states it too: keep one")
    if term.rig_numbers(rig, 0.0):
        raise TermError(f"{place}: normal_lever_m: a rig file states friction as coulomb_Nm alone")
    part = {Port.ENVIRONMENT: "load"}.get(term.port, term.port.value[0])
    shaft = part == "load" and not rig.has("spring")
    if not shaft and not rig.has(part):
        raise TermError(f'{place}: the rig has no "{part}"')
