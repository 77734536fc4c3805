"""Where the energy of a simulation went."""

from dataclasses import dataclass

from numpy.typing import NDArray

from rsea_core.numeric.brief_repr import BriefRepr


@dataclass(frozen=True, kw_only=True, repr=False)
class EnergyLedger(BriefRepr):
    """Where the energy went, by row, all (n,) arrays in J.

    What entered since the start: `supplied_J` (at the winding's terminals, or at the motor
    shaft where a motor torque drives), `load_work_J` (by a load torque or an imposed motion),
    `constant_mismatch_J` (created by k_t and k_e that differ). What was lost: `joule_J`,
    `drive_viscous_J`, `load_viscous_J`, `contact_loss_J`, `gear_friction_J`, `load_friction_J`,
    `drag_J`, `spring_loss_J` (hysteresis, relaxation, damping of the spring), `link_loss_J`,
    `impact_loss_J` (of the gear's play). What is stored: `magnetic_J`, `kinetic_J`,
    `elastic_J`, `gravity_J` (zero hanging), `contact_elastic_J`, `terms_J` (parallel spring,
    unbalance, cogging; what hysteresis, relaxation, presliding and a link keep). A held load's
    own inertia, friction and gravity belong to what holds it and are not counted.
    """

    supplied_J: NDArray
    load_work_J: NDArray
    constant_mismatch_J: NDArray
    joule_J: NDArray
    drive_viscous_J: NDArray
    load_viscous_J: NDArray
    contact_loss_J: NDArray
    gear_friction_J: NDArray
    load_friction_J: NDArray
    drag_J: NDArray
    spring_loss_J: NDArray
    link_loss_J: NDArray
    impact_loss_J: NDArray
    magnetic_J: NDArray
    kinetic_J: NDArray
    elastic_J: NDArray
    gravity_J: NDArray
    contact_elastic_J: NDArray
    terms_J: NDArray

    def stored_J(self) -> NDArray:
        """Everything stored, (n,) array."""
        mechanical = self.kinetic_J + self.elastic_J + self.gravity_J
        return self.magnetic_J + mechanical + self.contact_elastic_J + self.terms_J

    def lost_J(self) -> NDArray:
        """Everything turned into heat since the start, (n,) array."""
        smooth = self.drive_viscous_J + self.load_viscous_J + self.contact_loss_J + self.drag_J
        joint = self.spring_loss_J + self.link_loss_J + self.impact_loss_J
        return self.joule_J + smooth + joint + self.gear_friction_J + self.load_friction_J

    def imbalance_J(self) -> NDArray:
        """Entered less lost less growth of what is stored: zero in exact arithmetic."""
        entered = self.supplied_J + self.load_work_J + self.constant_mismatch_J
        stored = self.stored_J()
        return entered - self.lost_J() - (stored - stored[0])
