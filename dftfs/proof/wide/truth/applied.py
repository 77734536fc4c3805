"""One effect at one size, and a session on the machine that has it."""

from dataclasses import dataclass, field, replace

from dftfs.proof.wide.truth.simulate import Session


@dataclass(frozen=True, kw_only=True)
class Applied:
    """One effect at one size. ``faults``: column to changes of its sensor."""

    name: str
    subsystem: str
    parameters: dict[str, float] = field(default_factory=dict)
    extra: dict = field(default_factory=dict)
    body: dict = field(default_factory=dict)
    faults: dict[str, dict] = field(default_factory=dict)
    delay_s: float = 0.0
    pulse: tuple[float, float, float] | None = None
    pushed: int = 0
    description: str = ""


def with_effects(session: Session, applied: tuple[Applied, ...]) -> Session:
    """The session on the machine that has these effects."""
    for one in applied:
        sensors = dict(session.sensors)
        for column, change in one.faults.items():
            sensors[column] = replace(sensors[column], **change)
        planned = tuple(
            replace(
                p,
                delay_s=p.delay_s + one.delay_s,
                pulse=one.pulse if one.pulse and k == one.pushed else p.pulse,
            )
            for k, p in enumerate(session.planned)
        )
        session = replace(
            session,
            extra=session.extra._replace(**one.extra),
            body=session.body._replace(**one.body),
            planned=planned,
            sensors=sensors,
        )
    return session
