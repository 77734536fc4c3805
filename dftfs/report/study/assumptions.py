"""What the numbers of a study rest on, as plain sentences."""

from dftfs.analysis.study.result import StudyResult

_ALWAYS = (
    "Linear elastic, isotropic material at room temperature: no plasticity, no creep, no"
    " temperature. Where a stress is above the yield strength, it is what an elastic material"
    " would have.",
    "Large displacements and rotations are taken into account; strains follow from them.",
    "Boundary condition “bearing”: the bore is clamped, the rim is a rigid ring that turns about"
    " the fixed axis. Clamping parts, screws and the bearing itself are not modelled.",
    "Beyond first contact the coils press on each other without friction (a smoothed penalty, some"
    " micrometres of penetration): no hysteresis, no wear. The friction loop, where one was asked"
    " for, is a separate computation.",
    "The planar geometry is an interpretation of the thesis, which does not state all of it:"
    " centreline r = c √θ, where the slit between arm and rim ends, the fillets and the tip.",
    "Nominal dimensions: no tolerances, no kerf or taper from cutting, no surface finish.",
    "No residual stresses, from rolling or from cutting, and no preload.",
    "Stresses are static: no fatigue and no stress concentration from a rough edge.",
    "The uncertainty of the stiffness is that of the mesh only. It does not include the scatter of"
    " Young's modulus, thickness or fillets; stiffness grows with about the third power of the"
    " strip's thickness.",
)


def assumptions(study: StudyResult) -> tuple[str, ...]:
    """The list for one study."""
    material = study.design.material
    found = list(_ALWAYS)
    if study.design.n_arms > 1:
        found.append(
            f"The {study.design.n_arms} arms are equal and share the load equally; one sector is"
            " solved (cyclic symmetry)."
        )
    if study.design.spiral.taper is not None:
        found.append(
            "The strip tapers towards the rim; the closed forms use its thickness at the hub."
        )
    if material.creeps:
        found.append(f"{material.name} creeps: its stiffness under a held load falls with time.")
    if material.anisotropic:
        found.append(f"{material.name} is not isotropic: layers or fibres change its stiffness.")
    if material.as_printed:
        found.append(
            f"{material.name} is kept as its publication prints it; its constants were not checked."
        )
    if material.note:
        found.append(f"{material.name}: {material.note}")
    found.append(
        "The actuator's simulation uses the spring's computed curve up to first contact and the"
        " rig's nominal values."
    )
    return tuple(found)
