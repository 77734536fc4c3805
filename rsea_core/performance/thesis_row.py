"""A number that the thesis prints of its controllers or machine, beside what comes out."""

from dataclasses import dataclass

REPRODUCED, ORDER, MEASURED = "reproduced", "order reproduced", "measured"
INCONSISTENT, MISPRINT = "inconsistent", "misprint"
IMPOSSIBLE, NOT_REPRODUCIBLE = "impossible", "not reproducible"


@dataclass(frozen=True, kw_only=True)
class ThesisRow:
    """One printed number of a control table.

    Attributes
    ----------
    table, what : str
    line : int
        Of thesis.txt.
    printed, recomputed : float or None
    unit, verdict, errata, note : str
    """

    table: str
    what: str
    line: int
    printed: float | None
    recomputed: float | None
    unit: str
    verdict: str
    errata: str = ""
    note: str = ""

    @property
    def deviation(self) -> float | None:
        """Recomputed over printed, less one; None where either is missing."""
        if self.printed in (None, 0) or self.recomputed is None:
            return None
        return self.recomputed / self.printed - 1.0


def row(tolerance: float, otherwise: str, **values) -> ThesisRow:
    """A row of ThesisRow's values: reproduced within a relative tolerance, else as stated."""
    printed, found = values["printed"], values["recomputed"]
    near = abs(found - printed) <= tolerance * abs(printed)
    if near:
        values["errata"] = ""
    return ThesisRow(verdict=REPRODUCED if near else otherwise, **values)
