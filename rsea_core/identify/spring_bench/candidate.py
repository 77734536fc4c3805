"""One explanation of a spring's loops, with its error and parameters."""

from dataclasses import dataclass, field

from rsea_core.identify.spring_bench.regression import Fit


@dataclass(frozen=True, kw_only=True)
class SpringCandidate:
    """One explanation of the loops.

    Attributes
    ----------
    name : str
    error : float
        Root mean square torque error on quarters left out, over the torque's deviation.
    in_sample : float
    scale, scale_std : float
        Factor on the design's curve (its elastic flank, where something slips).
    parameters : mapping of str to float
    fit : Fit or None
        None for the design itself.
    """

    name: str
    error: float
    in_sample: float
    scale: float
    scale_std: float
    parameters: dict[str, float]
    fit: Fit | None = field(default=None, compare=False, repr=False)

    @property
    def pieces(self) -> tuple[str, ...]:
        """Its explanations beyond a scale."""
        return () if self.fit is None else self.fit.pieces
