"""Life of every place of a spring under a spectrum of torque, at a stated survival."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from dftfs.analysis.strength.fatigue import (
    LoadBlock,
    SNLine,
    damage,
    goodman_amplitude_Pa,
    sn_line,
    swt_amplitude_Pa,
)
from dftfs.analysis.strength.fkm import (
    SURVIVAL,
    FatigueStrength,
    fatigue_strength,
    gradients_per_mm,
    support_over_specimen,
    surface_factor,
    survival_factor,
)
from dftfs.analysis.strength.yield_and_set import STRUCTURAL
from dftfs.analysis.torsion.regions import ARM
from dftfs.analysis.torsion.result import StiffnessResult
from dftfs.design import SpringDesign
from dftfs.errors import DesignError
from dftfs.material import Material


@dataclass(frozen=True, kw_only=True)
class HaighPoint:
    """A block's mean stress and amplitude at a place (Pa), and how often it occurs."""

    mean_Pa: float
    amplitude_Pa: float
    cycles: float


@dataclass(frozen=True, kw_only=True)
class FatigueLife:
    """Miner's damage of one place under a spectrum, by two rules, at a survival; 1 is failure.

    ``factor`` is what surface, notch support and survival leave of the material's fatigue
    strength, ``allowed_Pa`` the fully reversed amplitude left at the spectrum's cycles,
    ``largest_Pa`` the largest stress of the spectrum, ``points`` those of the Haigh diagram (of the
    edge that Goodman's rule damages most) under the line from ``endurance_Pa`` at no mean stress
    to the ultimate strength.
    """

    region: str
    goodman_damage: float
    swt_damage: float
    factor: float
    allowed_Pa: float
    largest_Pa: float
    endurance_Pa: float
    points: tuple[HaighPoint, ...]
    note: str
    strength: FatigueStrength


def rated_line(
    material: Material,
    *,
    gradient_per_mm: float,
    surface: str,
    survival: float = SURVIVAL,
) -> tuple[SNLine, float]:
    """The S-N line of a place, and the factor on the material's fatigue strength in it.

    Raises
    ------
    DesignError
        If the material has no strength to rate, the surface is unknown, or the survival is out of
        range.
    """
    strength = fatigue_strength(material)
    ultimate = material.ultimate_strength_Pa
    if ultimate is None:
        raise DesignError(f"{material.name} has no ultimate strength: no life can be stated")
    factor = surface_factor(surface, ultimate, material.family) * survival_factor(survival)
    factor *= support_over_specimen(gradient_per_mm, material)
    line = sn_line(
        ultimate_Pa=ultimate,
        fatigue_Pa=strength.strength_Pa,
        fatigue_cycles=strength.cycles,
        stress_ratio=strength.stress_ratio,
        factor=factor,
    )
    return line, factor


def fatigue_lives(
    design: SpringDesign,
    result: StiffnessResult,
    spectrum: Sequence[LoadBlock],
    surface: str,
    survival: float = SURVIVAL,
) -> tuple[FatigueLife, ...]:
    """Damage of notch, slit and arm under blocks of torque.

    At a place the stress turns its sign with the torque. Some edge of a region is in tension in
    either direction: both signs are tried and the worse is kept. Goodman's rule takes von Mises
    stress, that of Smith, Watson & Topper the principal stress for which it was written.

    Raises
    ------
    DesignError
        If the material has no fatigue strength, or the surface is unknown.
    """
    material, p = design.material, design.spiral
    strip, fillet = gradients_per_mm(p.thickness_range_m[1], p.fillet_radius_m)
    return tuple(
        _life(
            region,
            material,
            result,
            spectrum,
            rated_line(
                material,
                gradient_per_mm=strip if region == ARM else fillet,
                surface=surface,
                survival=survival,
            ),
        )
        for region in STRUCTURAL
    )


def _life(
    region: str,
    material: Material,
    result: StiffnessResult,
    spectrum: Sequence[LoadBlock],
    rated: tuple[SNLine, float],
) -> FatigueLife:
    line, factor = rated
    strength, ultimate = fatigue_strength(material), material.ultimate_strength_Pa or 0.0
    cycles = [block.cycles for block in spectrum]
    worst: tuple[float, list] = (-1.0, [])
    swt = 0.0
    for sign in (+1, -1):
        ends, tensile = (
            [
                sorted(
                    sign
                    * np.sign(torque)
                    * result.stress_at_torque_Pa(torque, region, principal=principal)
                    for torque in (block.low_Nm, block.high_Nm)
                )
                for block in spectrum
            ]
            for principal in (False, True)
        )
        amplitudes = [goodman_amplitude_Pa(*end, ultimate) for end in ends]
        worst = max(worst, (float(damage(amplitudes, cycles, line)), ends), key=lambda w: w[0])
        swt = max(swt, float(damage([swt_amplitude_Pa(*end) for end in tensile], cycles, line)))
    return FatigueLife(
        region=region,
        goodman_damage=worst[0],
        swt_damage=swt,
        factor=factor,
        allowed_Pa=line.amplitude_Pa(sum(cycles)),
        largest_Pa=float(max(abs(value) for end in worst[1] for value in end)),
        endurance_Pa=line.amplitude_Pa(strength.cycles),
        points=tuple(
            HaighPoint(
                mean_Pa=float((low + high) / 2), amplitude_Pa=float((high - low) / 2), cycles=n
            )
            for (low, high), n in zip(worst[1], cycles)
        ),
        note=strength.note,
        strength=strength,
    )
