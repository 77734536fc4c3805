"""One solve for all designs that differ only by factors of torque and stress.

In the finite-strain law that is solved, stress is E times a function of strain and nu. With the
rim's rotation prescribed, equilibrium therefore does not know E: displacements, contact and the
shape of the curve are the same for every modulus, torque and stress are proportional to it. In
plane stress and in the rod the width w2 is a factor of every force in the same way:

    torque, tangent, energy ~ E w2          stress ~ E          angle, gap, place of contact ~ 1

(The contact's penalty is a multiple of E, so this holds in contact as well.)

So designs with equal planar geometry and equal nu share one solve (rod, 2D); in 3D the width is
geometry and only E is a factor. This is exact, not an approximation:
`tests/dftfs/analysis/sweep/test_sweep.py` holds scaled curves to directly solved ones within the
solver's round-off.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass

import numpy as np

from dftfs.analysis.jobs.store import code_version, content_key
from dftfs.analysis.torsion.result import SIGN, UNWINDING, WINDING
from dftfs.design import SpringDesign
from dftfs.errors import DesignError, DftfsError
from dftfs.material import Material
from dftfs.spring.parameters import SpiralParameters

MODELS = ("rod", "2d", "3d")
_MODULUS_Pa = 1e11
_WIDTH_m = 1e-2


@dataclass(frozen=True, kw_only=True)
class SharedProblem:
    """What a curve depends on but for its factors.

    Parameters
    ----------
    model : str
        ``rod``, ``2d`` or ``3d``.
    spiral : SpiralParameters
    poisson_ratio : float
    width_m : float
        The design's in 3D; elsewhere the unit of width.
    states : int
        States per direction up to the first contact.
    beyond : float
        Where a direction ends over the deflection of its first contact (the rod's end there).
    """

    model: str
    spiral: SpiralParameters
    poisson_ratio: float
    width_m: float
    states: int
    beyond: float

    @classmethod
    def of(
        cls, design: SpringDesign, model: str, states: int, beyond: float = 1.0
    ) -> "SharedProblem":
        """The shared part of a design.

        Raises
        ------
        DesignError
            If the model is unknown, no states are asked for, or ``beyond`` is below 1.
        """
        if model not in MODELS:
            raise DesignError(f"model = {model!r} is unknown; known are {', '.join(MODELS)}")
        if states < 1:
            raise DesignError(f"states = {states} per direction must be 1 or more")
        if not beyond >= 1:
            raise DesignError(f"beyond = {beyond} must be 1 or more times the first contact")
        return cls(
            model=model,
            beyond=1.0 if model == "rod" else beyond,
            spiral=design.spiral,
            poisson_ratio=design.material.poisson_ratio,
            width_m=design.width_m if model == "3d" else _WIDTH_m,
            states=states,
        )

    def content(self) -> dict:
        """Plain data from which `solve_shared` works, here or on another machine."""
        return {**asdict(self), "code": code_version()}

    @property
    def key(self) -> str:
        """Hash of inputs, settings and code."""
        return content_key(self.content())

    def factors(self, design: SpringDesign) -> tuple[float, float]:
        """What torques and what stresses of the shared curve are multiplied by for a design."""
        stress = design.material.youngs_modulus_Pa / _MODULUS_Pa
        return stress * design.width_m / self.width_m, stress


def solve_shared(content: Mapping) -> dict:
    """Solve a `SharedProblem.content`; the answer is plain data, also where it is a failure.

    Returns
    -------
    dict
        ``curve`` (see `_curve`), or ``failure`` (one line) where the geometry, the mesh or the
        solver refused: both are facts of the content and may be kept.
    """
    spiral = SpiralParameters(**content["spiral"])
    design = SpringDesign(
        name="shared",
        spiral=spiral,
        width_m=content["width_m"],
        material=Material(
            name="unit",
            youngs_modulus_Pa=_MODULUS_Pa,
            poisson_ratio=content["poisson_ratio"],
            density_kg_per_m3=1000.0,
            yield_strength_Pa=None,
            ultimate_strength_Pa=None,
        ),
    )
    solve = _rod if content["model"] == "rod" else _finite_elements
    try:
        return {"curve": solve(design, content)}
    except DftfsError as error:
        return {"failure": " ".join(str(error).split())}


def _finite_elements(design: SpringDesign, content: Mapping) -> dict:
    from dftfs.analysis.torsion.problem import TorsionProblem
    from dftfs.analysis.torsion.solve import solve_torsion

    model, states, beyond = content["model"], content["states"], content["beyond"]
    first = {"states_per_direction": states, "beyond": beyond} if model == "2d" else {}
    result = solve_torsion(TorsionProblem(design=design, dimension=2), **first)
    if model == "3d":
        near = {name: abs(snap.deflection_rad) for name, snap in result.snapshots.items()}
        result = solve_torsion(
            TorsionProblem(design=design, dimension=3),
            states_per_direction=states,
            expected_onset_rad=near,
            beyond=beyond,
        )
    return _curve(
        result.stiffness_Nm_per_rad,
        result.deflection_rad,
        result.torque_Nm,
        result.peak_von_mises_Pa,
        result.contact_onset,
        model=result.model,
        elements=result.mesh.elements,
    )


def _rod(design: SpringDesign, content: Mapping) -> dict:
    from dftfs.spring.notch import peak_stress
    from dftfs.spring.rod import rod_curve
    from dftfs.spring.rod_contact import contact_onset

    states = content["states"]
    elastic = (design.width_m, design.material.youngs_modulus_Pa, design.material.poisson_ratio)
    touch = contact_onset(design.outline, *elastic)
    onset = {WINDING: touch.winding, UNWINDING: touch.unwinding}
    ends = {d: abs(o.deflection_rad) if o else touch.limit_rad for d, o in onset.items()}
    angles = [np.linspace(0, sign * ends[d], states + 1)[1:] for d, sign in SIGN.items()]
    deflections = np.concatenate([np.sort(angles[1]), [0.0], angles[0]])
    rod = rod_curve(design.outline, *elastic, deflections)
    return _curve(
        rod.stiffness_Nm_per_rad,
        deflections,
        rod.torque_Nm,
        peak_stress(rod),
        onset,
        model="rod",
        elements=len(rod.arm.rod.nodes_m) // 2,
    )


def _curve(stiffness, deflection, torque, stress, onset, *, model: str, elements: int) -> dict:
    """Plain data of a curve, per unit of E and w2 (see `SharedProblem.factors`)."""
    return {
        "model": model,
        "elements": int(elements),
        "stiffness_Nm_per_rad": float(stiffness),
        "deflection_rad": [float(v) for v in deflection],
        "torque_Nm": [float(v) for v in torque],
        "peak_stress_Pa": [float(v) for v in stress],
        "contact_onset": {
            name: None
            if touch is None
            else {
                "deflection_rad": touch.deflection_rad,
                "torque_Nm": touch.torque_Nm,
                "stiffening": getattr(touch, "stiffening", None),
            }
            for name, touch in onset.items()
        },
    }
