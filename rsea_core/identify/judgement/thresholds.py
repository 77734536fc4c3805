"""The thresholds that decide a verdict, with what they were set on and what guards them.

`docs/thresholds-of-diagnosis.md` is this table (`python -m
rsea_core.identify.judgement.thresholds`). A commit "which names no cases" is where the value was
set; the results that it was set on were not written down.
"""

from dataclasses import dataclass
from importlib import import_module

SELECTION, JUDGEMENT = "selection.criteria", "judgement.criteria"
PORTS = "locate.unknown_input_test"
UNKNOWN = "not recorded"
NO_GUARD = "no case of its own"
PRACTICE = "commit {}: practice cases"  # all that existed then; its session's note says so
UNSTATED = "commit {}, which names no cases"
CONTRACT = "the file contract"
NULLS = "nulls of `dftfs prove` (no false alarm)"
TESTS = "tests/rsea_core/identify/"
LOGLIK, MSNI, SHARE, CHANCE = "log-likelihood", "MSNI", "share", "probability"


@dataclass(frozen=True)
class Threshold:
    """One threshold.

    Attributes
    ----------
    module, name : str
        Where it stands, below `rsea_core.identify`.
    unit : str
    decides : str
    set_on : str
        Commit or set of cases; `UNKNOWN` where it was not written down.
    guards : str
        Cases or tests, kept with the project, that notice a change.
    """

    module: str
    name: str
    unit: str
    decides: str
    set_on: str = UNKNOWN
    guards: str = NO_GUARD

    @property
    def value(self) -> float:
        """As it is in force."""
        return getattr(import_module(f"rsea_core.identify.{self.module}"), self.name)


# fmt: off
THRESHOLDS = (
    # ---- search
    Threshold(SELECTION, "PRICE", LOGLIK, "what each free value of a law costs",
              set_on=PRACTICE.format("e951591")),
    Threshold(SELECTION, "WORTH", LOGLIK, "gain that an effect must bring over parameters alone",
              set_on=PRACTICE.format("e951591")),
    Threshold(SELECTION, "WORTH_FURTHER", LOGLIK, "gain that a further effect must bring",
              set_on=PRACTICE.format("e951591")),
    Threshold(SELECTION, "ROOM", MSNI, "above it a further effect is looked for",
              guards=TESTS + "selection/test_refits.py", set_on=PRACTICE.format("32410d0")),
    Threshold(SELECTION, "TEMPERATURE", LOGLIK, "by which the belief in a rival falls to 1/e",
              guards=TESTS + "selection/test_refits.py; calibration of `dftfs prove`",
              set_on=PRACTICE.format("95cf791")),
    Threshold(SELECTION, "LEAST_MSNI", MSNI, "below it a fit counts as no better",
              set_on=UNSTATED.format("f42eaef"),
              guards=TESTS + "selection/test_starting_points.py"),
    Threshold(SELECTION, "QUIET_MSNI", MSNI, "below it in all recordings nothing is searched for",
              guards=NULLS, set_on=PRACTICE.format("217cc15")),
    Threshold(SELECTION, "QUIET_PRIOR_COST", LOGLIK,
              "and as little as this must the parameters' moves cost",
              set_on=PRACTICE.format("217cc15")),
    Threshold(SELECTION, "NOISE_MSNI", MSNI, "below it in all recordings there is no mismatch",
              guards=NULLS, set_on=PRACTICE.format("217cc15")),
    Threshold(SELECTION, "ROUGH_MSNI", MSNI, "median above it: the law's own error is left",
              set_on="commit 627da41: errors of five times the noise"),
    Threshold(SELECTION, "NOISE_SPREAD", MSNI, "above one, that the noise model may be wrong by",
              set_on=PRACTICE.format("e951591")),
    Threshold(SELECTION, "EXPLAINED", SHARE, "of the excess (rms) that effects must explain",
              set_on=PRACTICE.format("231c1fe")),
    Threshold(SELECTION, "CHANCE", CHANCE,
              "of so far a nominal value by chance (Sidak); less: it is far from its prior",
              set_on="commit 38513a5: a choice"),
    Threshold(SELECTION, "DOUBTFUL_GAIN", LOGLIK, "gains below it are bootstrapped",
              set_on="commit 3aa4710: nulls gained up to 70"),
    Threshold(SELECTION, "FALSE_ALARMS", CHANCE, "of the null's gain that effects must beat",
              guards=NULLS, set_on="commit 4bea25b: a choice"),
    Threshold(SELECTION, "NEAR_NOISE_MSNI", MSNI, "below it an effect needs UNREPEATABLE_GAIN",
              guards=NULLS, set_on="commit 3aa4710: nulls of concealed cases"),
    Threshold(SELECTION, "UNREPEATABLE_GAIN", LOGLIK, "gain near the noise that is an effect's",
              "commit 3aa4710: nulls gained up to 70", NULLS),
    Threshold(SELECTION, "LEFT_MOST", SHARE, "of the excess that a further effect leaves (mean)",
              set_on=PRACTICE.format("e951591")),
    Threshold(SELECTION, "LEFT_SOMEWHERE", SHARE, "or leave in one recording",
              set_on=PRACTICE.format("e951591")),
    Threshold(SELECTION, "UNREACHABLE", SHARE,
              "left by a rough fit: it cannot reach the threshold any more",
              set_on=UNSTATED.format("3bf8858")),
    Threshold(SELECTION, "SHARE_OF_ALL", SHARE, "of the whole mismatch a further effect takes",
              set_on=PRACTICE.format("1c117e0")),
    Threshold(SELECTION, "LEFT_CLEAR", SHARE, "or leaves no more than this of what was left",
              set_on=PRACTICE.format("1c117e0")),
    Threshold(SELECTION, "FREE_RUN_WORSE", SHARE, "by which free runs may not become worse",
              guards=TESTS + "result/test_prediction_causes.py",
              set_on="commit 08afb54: what only the ends of fits change"),
    # ---- the scale of a reading
    Threshold(SELECTION, "SCALE_GAIN", LOGLIK, "gain that names a scale",
              guards=TESTS + "selection/test_common_scale_factor.py",
              set_on=UNSTATED.format("dd424c1")),
    Threshold(SELECTION, "SCALE_PRIOR_SHARE", SHARE, "of the constants' cost that may stay then",
              guards=TESTS + "selection/test_common_scale_factor.py",
              set_on=UNSTATED.format("5965fc5")),
    Threshold(SELECTION, "SCALE_FARTHEST", "tolerances", "that a constant may be off then",
              "commit f04e0a9: one log-likelihood unit",
              TESTS + "selection/test_common_scale_factor.py"),
    Threshold(SELECTION, "SCALE_LOG_ODDS", "log odds", "that name a scale by the constants alone",
              "commit 08afb54: a thousand to one", TESTS + "selection/test_common_scale_factor.py"),
    Threshold(SELECTION, "SCALE_OVER_OTHER_CAUSE", "log odds", "over another winding, magnet, load",
              "commit ebb45c7: ten to one", TESTS + "selection/test_common_scale_factor.py"),
    Threshold(SELECTION, "SCALE_REPORTED", "log odds", "from which a scale is a finding",
              "commit 08afb54: twenty to one", TESTS + "selection/test_common_scale_factor.py"),
    # ---- unknown inputs
    Threshold(PORTS, "PLAIN_TO_SEE", LOGLIK, "gain at another port that makes a fit `unexplained`",
              "commit d113cd0: 60 machines without effect gain at most 91, gearboxes that swing on"
              " their mount 620 and more", TESTS + "locate/test_unknown_input_test.py"),
    Threshold(PORTS, "ALIKE", SHARE, "of the gain within which two ports are not distinguished",
              guards=TESTS + "locate/test_unknown_input.py", set_on=UNSTATED.format("76f1190")),
    Threshold(JUDGEMENT, "IN_CONTACT", SHARE, "of a load's unknown signal during contact: it is the"
              " contact's", set_on=UNSTATED.format("76f1190")),
    Threshold(JUDGEMENT, "OWN_PACE_s", "s", "an unknown spring torque that forgets itself faster is"
              " the gear's", set_on="commit d113cd0: spring clamps that slip"),
    # ---- verdict and confidence
    Threshold(JUDGEMENT, "CLEAR_MSNI", MSNI, "above it a mismatch is clear",
              guards=TESTS + "judgement/test_unmodelled_gravity.py",
              set_on=UNSTATED.format("76f1190")),
    Threshold(JUDGEMENT, "UNCHANGED_SHARE", SHARE, "of a clear mismatch that may not stay",
              guards=TESTS + "locate/test_unknown_input.py", set_on=UNSTATED.format("76f1190")),
    Threshold(JUDGEMENT, "HARDLY_CHANGED", SHARE, "that stays where an effect did next to nothing",
              guards=TESTS + "locate/test_unknown_input.py", set_on=UNSTATED.format("74c224c")),
    Threshold(JUDGEMENT, "PART_OF_MISMATCH", SHARE, "(rms) of the whole that such recordings hold",
              set_on=UNSTATED.format("5835792")),
    Threshold(JUDGEMENT, "BELIEF_MARGIN", SHARE, "below EXPLAINED that is half believed",
              set_on=UNSTATED.format("5835792")),
    Threshold(JUDGEMENT, "BELIEF_STEEPNESS", "1", "of belief over the share explained",
              set_on=UNSTATED.format("5835792")),
    Threshold(JUDGEMENT, "HIGHEST_CONFIDENCE", CHANCE, "the largest confidence given",
              "commit fbd7585: of 255 claims as sure on four concealed sets none was wrong",
              "calibration of `dftfs prove`"),
    Threshold(JUDGEMENT, "FURTHER_CONFIDENCE", CHANCE, "factor for a further effect",
              "commit 7e27e26: 59 of 60 on four sets of concealed cases",
              "calibration of `dftfs prove`"),
    Threshold(JUDGEMENT, "UNDECIDED_CONFIDENCE", CHANCE, "largest with `insufficient-data`",
              "commit 7e27e26: 14 of 14 on the same sets",
              TESTS + "judgement/test_detectability.py"),
    Threshold(JUDGEMENT, "UNCLAIMED_CONFIDENCE", CHANCE, "largest with `unexplained`",
              CONTRACT + ": below 0.5 is no claim"),
    Threshold(JUDGEMENT, "MOST_UNDETECTABLE", SHARE, "of effects that may stay undetectable",
              guards=TESTS + "judgement/test_detectability.py", set_on=UNSTATED.format("f3be12c")),
    Threshold(JUDGEMENT, "DETECTED_GAIN", LOGLIK, "gain at which an effect is not overlooked",
              guards=TESTS + "judgement/test_detectability.py", set_on=UNSTATED.format("f3be12c")),
    Threshold(JUDGEMENT, "UNBALANCE_OFFSET_rad", "rad", "a larger offset is an unbalance",
              CONTRACT, TESTS + "judgement/test_unmodelled_gravity.py"),
    Threshold(JUDGEMENT, "UNBALANCE_TOLERANCES", "tolerances", "of m g d, likewise",
              CONTRACT + " (leaves its tolerance); the factor not recorded",
              TESTS + "judgement/test_unmodelled_gravity.py"),
    Threshold(JUDGEMENT, "SHOWN_STD", "standard deviations",
              "from none of one figure at least, or an effect is not shown",
              guards=TESTS + "judgement/test_reported_values.py",
              set_on="commit a5b19fe: of six such claims on five concealed sets five were false"),
)
# fmt: on


def as_markdown() -> str:
    """The table as the document has it."""
    lines = [
        "# Thresholds of the diagnosis",
        "",
        "Every number that decides a verdict of a moving machine, made from"
        " `rsea_core/identify/judgement/thresholds.py` (`python -m"
        " rsea_core.identify.judgement.thresholds`). MSNI is the mean squared normalised"
        " innovation of a recording, 1 for noise alone; log-likelihood is natural. All are scored"
        " together by `benchmarks/diagnose_practice.py` on the practice cases; the last column"
        " names what guards one of them in particular.",
        "",
        "| name | value | unit | decides | set on | guarded by |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    lines += [
        f"| `{t.module}.{t.name}` | {t.value:.4g} | {t.unit} | {t.decides} | {t.set_on} |"
        f" {t.guards} |"
        for t in THRESHOLDS
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    print(as_markdown(), end="")
