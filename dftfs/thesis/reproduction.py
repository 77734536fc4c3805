"""Every number that the thesis prints of its spring: printed, recomputed, verdict, erratum.

The rows are data (``data/thesis.toml``); the verdict is computed: what comes out within its
tolerance is reproduced, what does not is called what the data says of such a number. Nothing is
tuned to reach a printed one.
"""

import tomllib
from collections import Counter
from dataclasses import dataclass
from functools import cache
from importlib import resources

from dftfs.analysis.jobs.store import ContentStore
from dftfs.material import lookup
from dftfs.material_family import families
from dftfs.thesis.recipes import Springs, bound, find

REPRODUCED, KEPT = "reproduced", "bound kept"
_PSI_PER_GPa = 1 / 6.894757  # 10^6 psi
_ROUNDING = 0.05  # Table 2.2 is printed in two digits
_G_TOLERANCE = 0.05  # errata S3 names what is further off


@dataclass(frozen=True, kw_only=True)
class Row:
    """One printed number. ``deviation`` is recomputed over printed, less one."""

    table: str
    what: str
    line: int | None
    printed: float | None
    recomputed: float | None
    unit: str
    verdict: str
    errata: str
    note: str

    @property
    def deviation(self) -> float | None:
        """Recomputed over printed, less one; None where either is missing."""
        if self.printed in (None, 0) or self.recomputed is None:
            return None
        return self.recomputed / self.printed - 1


@cache
def printed_data() -> dict:
    """The thesis' numbers as committed."""
    text = resources.files("dftfs").joinpath("data", "thesis.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def reproduce(*, model: str = "2d", store: ContentStore | None = None) -> tuple[Row, ...]:
    """All rows, in the order of the tables.

    Parameters
    ----------
    model : str
        ``rod``, ``2d`` or ``3d``: what springs are solved by.

    Raises
    ------
    DesignError
        If the model is unknown.
    SolveError
        If a spring cannot be solved.
    """
    data = printed_data()
    springs = Springs(model=model, store=store, table_2_3=data["table_2_3"])
    rows = [*_table_2_2(data["metals"]), *_columns_of_table_2_3(springs)]
    rows += [_row(entry, springs) for entry in data["rows"]]
    order = list(dict.fromkeys(["2.2", "2.3", *(row.table for row in rows)]))
    return tuple(sorted(rows, key=lambda row: order.index(row.table)))


def _row(entry: dict, springs: Springs) -> Row:
    printed = entry.get("printed")
    found = bound(entry["recipe"], springs, entry.get("with", {}))(printed)
    return _judged(
        table=entry["table"],
        what=entry["what"],
        line=entry["L"],
        printed=printed,
        recomputed=found,
        unit=entry["unit"],
        tolerance=entry.get("tolerance_percent", 0.0) / 100,
        compare=entry.get("compare", "equal"),
        otherwise=entry["otherwise"],
        errata=entry.get("errata", ""),
        note=entry.get("note", ""),
    )


def _judged(
    *,
    table: str,
    what: str,
    line: int,
    printed: float | None,
    recomputed: float | None,
    unit: str,
    otherwise: str,
    tolerance: float = 0.0,
    compare: str = "equal",
    errata: str = "",
    note: str = "",
) -> Row:
    near = False
    if printed is not None and recomputed is not None:
        off = recomputed - printed
        slack = max(tolerance, 1e-9) * abs(printed)
        near = {"equal": abs(off) <= slack, "at least": off >= 0, "at most": off <= 0}[compare]
    return Row(
        table=table,
        what=what,
        line=line,
        printed=printed,
        recomputed=recomputed,
        unit=unit,
        verdict=otherwise if not near else REPRODUCED if compare == "equal" else KEPT,
        errata=errata if not near else "",
        note=note,
    )


def _table_2_2(metals: list[dict]) -> list[Row]:
    """The rows of all metals."""
    return [row for metal in metals for row in _metal(metal)]


def _metal(metal: dict) -> list[Row]:
    """E against its family, the psi columns against the GPa ones, G against E and nu."""
    name, line = metal["name"], metal["L"]
    E, E_psi, G, G_psi, nu = metal["printed"]
    right = lookup(f"{name}-generic")
    source = right.source("youngs_modulus_Pa")
    polymer = name in families() and right.creeps
    common = {"table": "2.2", "line": line}
    return [
        _judged(
            **common,
            what=f"{name}, E, against {source.split(',')[0]}",
            printed=E,
            recomputed=right.youngs_modulus_Pa / 1e9,
            unit="GPa",
            tolerance=_ROUNDING,
            otherwise="misprint",
            errata="S2",
        ),
        _judged(
            **common,
            what=f"{name}, E in 10^6 psi, from its GPa",
            printed=E_psi,
            recomputed=E * _PSI_PER_GPa,
            unit="10^6 psi",
            tolerance=_ROUNDING,
            otherwise="inconsistent",
            errata="S2" if polymer else "",
        ),
        _judged(
            **common,
            what=f"{name}, G, as E / 2(1 + nu) of the printed E and nu",
            printed=G,
            recomputed=E / (2 * (1 + nu)),
            unit="GPa",
            tolerance=_G_TOLERANCE,
            otherwise="inconsistent",
            errata="S3",
        ),
        _judged(
            **common,
            what=f"{name}, G in 10^6 psi, from its GPa",
            printed=G_psi,
            recomputed=G * _PSI_PER_GPa,
            unit="10^6 psi",
            tolerance=_ROUNDING,
            otherwise="inconsistent",
        ),
        _judged(
            **common,
            what=f"{name}, nu",
            printed=nu,
            recomputed=right.poisson_ratio,
            unit="1",
            tolerance=_ROUNDING,
            otherwise="misprint",
            errata="S2",
        ),
    ]


def _columns_of_table_2_3(springs: Springs) -> list[Row]:
    t, rows = springs.table_2_3, []
    for k, (column, metal) in enumerate(zip(t["columns"], t["metals"])):
        right = next(m["printed"][0] for m in printed_data()["metals"] if m["name"] == metal)
        rows += [
            _judged(
                table="2.3",
                what=f"{column}: E, against the thesis' own Table 2.2",
                line=464,
                printed=t["youngs_modulus_GPa"][k],
                recomputed=float(right),
                unit="GPa",
                tolerance=_ROUNDING,
                otherwise="misprint",
                errata="S1",
                note="" if metal == "aluminium" else "76 and 83 are shear moduli of Table 2.2",
            ),
            _judged(
                table="2.3",
                what=f"{column}: k_s by eq. 2.1 as printed (one strip, L 115.13 mm)",
                line=465,
                printed=t["stiffness_Nm_per_rad"][k],
                recomputed=find("eq_2_1")(springs, None, column=k),
                unit="Nm/rad",
                tolerance=0.03,
                otherwise="inconsistent",
                errata="S10",
            ),
            _judged(
                table="2.3",
                what=f"{column}: largest deflection, tau / k_s of the same column",
                line=472,
                printed=t["deflection_rad"][k],
                recomputed=find("torque_over_stiffness")(springs, None, column=k),
                unit="rad",
                tolerance=0.03,
                otherwise="inconsistent",
                errata="S11",
            ),
        ]
    return rows


def summary(rows: tuple[Row, ...]) -> dict[str, int]:
    """How many rows have which verdict, the most frequent first."""
    return dict(Counter(row.verdict for row in rows).most_common())


def markdown(rows: tuple[Row, ...], model: str) -> str:
    """The rows as a document."""
    counts = ", ".join(f"{count} {verdict}" for verdict, count in summary(rows).items())
    lines = [
        "# The thesis' numbers, printed and recomputed",
        "",
        f"Written by `dftfs thesis --write` (springs by the {model} model). Of {len(rows)} numbers:"
        f" {counts}.",
        "",
        "L is the line of the thesis' text; S-numbers are its errata. A number that no reading"
        " reproduces is reported as not reproducible: no modulus, length or number of turns was"
        " adjusted to reach one. n = 1.9 turns and fillets of 0.5 mm of AL1 are this project's"
        " reading, because the thesis states neither. C- and R-numbers are the errata of the"
        " controllers; their simulations use conditions that this project assumed; each row"
        " states them.",
    ]
    for table in dict.fromkeys(row.table for row in rows):
        lines += ["", f"## {'Table ' if table[0].isdigit() else ''}{table}", ""]
        lines += ["| L | number | printed | recomputed | | verdict | erratum |"]
        lines += ["| --- | --- | --- | --- | --- | --- | --- |"]
        lines += [_line(row) for row in rows if row.table == table]
    return "\n".join(lines) + "\n"


def _line(row: Row) -> str:
    off = "" if row.deviation is None else f"{100 * row.deviation:+.1f} %"
    note = f" ({row.note})" if row.note else ""
    cells = (
        f"L{row.line}",
        row.what + note,
        number(row.printed, row.unit),
        number(row.recomputed, row.unit),
        off,
        row.verdict,
        row.errata,
    )
    return "| " + " | ".join(cells) + " |"


def number(value: float | None, unit: str) -> str:
    """A number with its unit for a table, nothing where there is none."""
    if value is None:
        return "-"
    return f"{value:.5g}" + ("" if unit == "1" else f" {unit}")
