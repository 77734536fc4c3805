"""JSON schema of `diagnosis.json`: the contract between the diagnosis and other programs."""

from dftfs.cli.schema_tables import (
    FLAG,
    NUMBER,
    TEXT,
    closed,
    list_of,
    nullable,
    one_of,
    table_of,
)

VERDICTS = ("no-mismatch", "parameters-only", "missing-physics", "unexplained", "insufficient-data")
_REAL = nullable(NUMBER)


def diagnosis() -> dict:
    """The schema of `diagnosis.json`."""
    value = closed(("value", "std", "unit", "at_bound"), ("value", "std", "unit"),
                   value={"type": ["number", "string", "null"]}, std=_REAL, unit=TEXT,
                   at_bound=FLAG)  # fmt: skip
    other = closed(("name", "delta_score", "se", "screened"), ("name", "delta_score"), name=TEXT,
                   delta_score=_REAL, se=_REAL, screened=FLAG)  # fmt: skip
    effect = closed(
        ("name", "subsystem", "confidence", "law", "parameters", "class", "alternatives"),
        ("name", "subsystem", "confidence", "parameters"), name=TEXT, subsystem=TEXT, law=TEXT,
        confidence={"type": "number", "minimum": 0, "maximum": 1}, parameters=table_of(value),
        alternatives=list_of(other), **{"class": list_of(TEXT)},
    )  # fmt: skip
    moved = closed(("from", "to", "std", "identifiable"), ("from", "to", "std", "identifiable"),
                   to=_REAL, std=_REAL, identifiable=FLAG, **{"from": _REAL})  # fmt: skip
    keys = ("where", "signal", "subsystem", "share_of_mismatch")
    location = closed(keys, keys, where=TEXT, signal=TEXT, subsystem=TEXT,
                      share_of_mismatch=_REAL)  # fmt: skip
    errors = [f"{kind}_{run}" for kind in ("rmse", "nrmse")
              for run in ("before", "parameters_only", "after")]  # fmt: skip
    texts = ("file", "role", "signal", "unit")
    row = closed((*texts, "noise_floor", *errors), texts, noise_floor=_REAL,
                 **dict.fromkeys(texts, TEXT), **dict.fromkeys(errors, _REAL))  # fmt: skip
    fit = closed(("recordings", "innovation_power"), ("recordings",), recordings=list_of(row),
                 innovation_power={"type": "object"})  # fmt: skip
    experiment = closed(
        ("sentence", "load", "extra_mass_kg", "sensors", "file", "rivals", "predicted_separation"),
        ("sentence",), sentence=TEXT, load=TEXT, file=TEXT, sensors=list_of(TEXT),
        extra_mass_kg=_REAL, predicted_separation=_REAL,
    )  # fmt: skip
    keys = ("schema", "verdict", "summary", "location", "effects", "parameters_corrected",
            "remainder", "next_experiment", "fit", "findings")  # fmt: skip
    return closed(
        (*keys, "spring"), keys, spring={}, schema={"const": 1}, verdict=one_of(*VERDICTS),
        summary=TEXT, location=nullable(location), effects=list_of(effect), fit=fit,
        findings=list_of(TEXT), parameters_corrected=table_of(moved),
        remainder=nullable({"type": "object"}),
        next_experiment=nullable(experiment),
    )  # fmt: skip
