"""Candidates that a sizing has judged, each once, and how they rank."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from dftfs.analysis.sizing.rod_candidate import Candidate, assess
from dftfs.analysis.sizing.task import SizingTask

Assess = Callable[[Sequence[tuple[int, ...]]], Iterable[Candidate]]
Merit = Callable[[Candidate], float]


@dataclass
class Archive:
    """Candidates by their index; each is judged once. ``merit`` ranks them, the smallest first."""

    task: SizingTask
    assess: Assess
    merit: Merit
    known: dict[tuple[int, ...], Candidate] = field(default_factory=dict)

    @classmethod
    def of(cls, task: SizingTask, judge: Assess | None, merit: Merit | None = None) -> "Archive":
        """An empty one that ranks by the task's objective unless told otherwise."""
        return cls(
            task=task,
            assess=judge or (lambda many: (assess(task, i) for i in many)),
            merit=merit or (lambda candidate: candidate.merit(task.objective)),
        )

    def judge(self, indices: Iterable[tuple[int, ...]]) -> list[Candidate]:
        """Candidates by their numbers, in their order; new ones are assessed."""
        wanted = list(indices)
        new = [index for index in dict.fromkeys(wanted) if index not in self.known]
        for candidate in self.assess(new) if new else ():
            self.known[candidate.index] = candidate
        return [self.known[index] for index in wanted]

    @property
    def best(self) -> Candidate:
        """The first by merit; ties by index, so that the order is one."""
        return min(self.known.values(), key=lambda c: (self.merit(c), c.index))

    @property
    def feasible(self) -> list[Candidate]:
        """All feasible ones, the best first."""
        found = [candidate for candidate in self.known.values() if candidate.feasible]
        return sorted(found, key=lambda c: (self.merit(c), c.index))
