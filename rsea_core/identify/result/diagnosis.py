"""The result of a diagnosis."""

from dataclasses import dataclass, replace

from rsea_core.identify.result.conclusion import Conclusion
from rsea_core.identify.result.corrected_model import FoundModel
from rsea_core.numeric.brief_repr import BriefRepr
from rsea_core.recordings.finding import Finding


@dataclass(frozen=True, kw_only=True, repr=False)
class Diagnosis(BriefRepr):
    """A diagnosis as the file contract has it, and the model found.

    Attributes
    ----------
    document : dict
        `diagnosis.json`.
    model : FoundModel
    conclusion : Conclusion
        What it was made from, for reports.
    findings : tuple of Finding
        Those of the document, as data.
    """

    document: dict
    model: FoundModel
    conclusion: Conclusion
    findings: tuple[Finding, ...] = ()

    def having(self, finding: Finding) -> "Diagnosis":
        """The same with a further finding."""
        document = self.document | {"findings": [*self.document["findings"], finding.sentence()]}
        return replace(self, document=document, findings=(*self.findings, finding))
