"""A finding: something worth knowing about the files of a case, as data; its sentence comes last.

Logic reads `kind`, `file` and `column`. The sentence is for people and is made where it is written
out, never searched.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum


class Kind(StrEnum):
    """What a finding is about; findings of one kind and column differ in their numbers only."""

    RIG_VALUES = "values of the rig file that cannot be true together"
    RIG_NOTE = "something legal but notable in the rig file"
    READER = "what the reader of a file decided"
    RESAMPLED = "uneven sample times"
    TRUNCATED = "rows that took no part"
    SILENT = "no reading moves"
    TOO_SHORT = "too few rows"
    CLIPPED = "flat at its extreme"
    CLOCK = "time or counts per turn that cannot be right"
    SUPPLY = "a measured supply in another unit"
    SENSOR_DEAD = "a reading that never moves"
    CONSTANT_RUN = "a reading that keeps one value while another moves"
    NOISE_STOPS = "a noisy reading that repeats one value"
    SIGN = "a reading of the other sign"
    AGAINST = "a command that takes work out of the motion"
    UNIT = "a reading in another unit or on the other side of the gear"
    WRAP = "an angle that wraps at a full turn"
    JUMP = "a step that no inertia allows"
    SPIKE = "a row that no inertia allows"
    RESOLUTION = "readings coarser or noisier than the rig file says"
    ZERO = "angles whose zeros are apart"
    OPEN_BRIDGE = "a current while the bridge is open"
    NO_COMMAND = "a command that was not logged"
    INITIAL_MOTION = "a recording that begins in motion"
    DERIVED_TORQUE = "a torque computed from the deflection"
    DUPLICATE = "two files with the same readings"
    SLIDING = "a spring's torque loop that shows slip"
    OTHER_SPRING = "a held-out recording of another spring than the fitted ones"
    SEVERAL_SPRINGS = "fitted recordings that are not of one spring"
    MODEL_LIMIT = "what model.toml cannot hold"
    METHOD = "how far the result can be trusted"


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Something worth knowing about a case.

    Attributes
    ----------
    kind : Kind
    text : str
        What is reported, without the file and without a full stop or question mark.
    file : str or None
        The recording that it is about; None: the rig file, or several recordings.
    column : str or None
        The column that it is about.
    is_question : bool
        Whether the sentence asks the reader.
    """

    kind: Kind
    text: str
    file: str | None = None
    column: str | None = None
    is_question: bool = False

    def sentence(self) -> str:
        """The finding for a person, file first."""
        head = "" if self.file is None else f"{self.file}: "
        return f"{head}{self.text}{'?' if self.is_question else ''}"


def sentences(findings: Iterable[Finding]) -> tuple[str, ...]:
    """The sentence of each finding."""
    return tuple(f.sentence() for f in findings)


def grouped_sentences(findings: Iterable[Finding]) -> tuple[str, ...]:
    """Sentences, those of one kind and column in several recordings as one line, at the end.

    What every recording has (a clock that jitters) must not hide what one has.
    """
    alike: dict[tuple, list[Finding]] = {}
    for k, finding in enumerate(findings):
        own = () if finding.file is not None else (k,)
        alike.setdefault((finding.kind, finding.column, *own), []).append(finding)
    single = [group[0].sentence() for group in alike.values() if len(group) == 1]
    several = [
        f"{group[0].sentence()} (and similarly in {len(group) - 1} more)"
        for group in alike.values()
        if len(group) > 1
    ]
    return (*single, *several)
