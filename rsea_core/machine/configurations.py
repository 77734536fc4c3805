"""Where the spring sits: FSEA, RFSEA and TFSEA from one constraint and one mass matrix.

    theta_l = a theta_m + b theta_s                 theta_s: the spring's deflection
    M q'' + C q' + (0, K theta_s) = (1, 0) tau_m + (a, b) tau_l,      q = (theta_m, theta_s)
    M = J_m r r' + J_s e e' + J_l l l',   r = (1, c), e = (0, 1), l = (a, b)

FSEA (spring between gear and load): a = 1/N, b = -1. RFSEA (spring between ground and the motor
and gear's housing): a = 1/N, b = 1. TFSEA (planetary gear: motor on the sun, load on the
carrier, spring on the ring): a = 1/N, b = (N - 1)/N. c is 1 where the rotor rides on the part
that moves with theta_s, and 0 (M as in the literature) elsewhere.

Every transfer function is one quotient of polynomials from M, C, K after a projection: nothing
held (q), output locked (b theta_s = -a theta_m) or motor held (theta_s alone). tau_l helps
positive motion of the load; the sensed output torque is tau_s = -K theta_s / b, which is
positive when it pushes the load positively and equals what the load feels at rest.

Source: the constraint and the three criteria, Lee, Kwak, Kwak & Oh, Generalization of series
elastic actuator configurations, Actuators 6 (2017) 26, on which section 1.2 of the thesis rests.
The figures with its formulas are lost, so the criteria below state their own definitions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rsea_core.errors import RigError
from rsea_core.files.toml_tables import nearest
from rsea_core.machine.quantities import impedance_to_motor
from rsea_core.machine.rig import Rig
from rsea_core.numeric.arrays import read_only
from rsea_core.numeric.transfer_function import TransferFunction

KINDS = ("FSEA", "RFSEA", "TFSEA")


@dataclass(frozen=True, kw_only=True)
class Configuration:
    """An elastic actuator as a differential of motor, spring and load.

    Attributes
    ----------
    name : str
    motor_share, spring_share : float
        a and b of the constraint, not zero.
    stiffness_Nm_per_rad : float
        K, of the spring in its own angle.
    motor_inertia_kgm2, motor_viscous_Nms_per_rad : float
        In theta_m.
    spring_inertia_kgm2, spring_viscous_Nms_per_rad : float
        J_s and B_s of what moves with theta_s (housing, ring gear).
    load_inertia_kgm2, load_viscous_Nms_per_rad : float
    rotor_carry : float
        c: 1 where the rotor rides on the part that moves with theta_s.

    Raises
    ------
    RigError
        If a share is zero, motor inertia or stiffness are not positive, or any other value is
        negative or not finite.
    """

    name: str
    motor_share: float
    spring_share: float
    stiffness_Nm_per_rad: float
    motor_inertia_kgm2: float
    motor_viscous_Nms_per_rad: float = 0.0
    spring_inertia_kgm2: float = 0.0
    spring_viscous_Nms_per_rad: float = 0.0
    load_inertia_kgm2: float = 0.0
    load_viscous_Nms_per_rad: float = 0.0
    rotor_carry: float = 0.0

    def __post_init__(self):
        for name, value in vars(self).items():
            if name == "name":
                continue
            where = f"configuration {self.name}: {name} = {value}"
            if not np.isfinite(value):
                raise RigError(f"{where} must be finite")
            if name in ("motor_share", "spring_share"):
                if value == 0.0:
                    raise RigError(f"{where} must not be 0")
            elif name in ("stiffness_Nm_per_rad", "motor_inertia_kgm2"):
                if not value > 0.0:
                    raise RigError(f"{where} must be above 0")
            elif value < 0.0:
                raise RigError(f"{where} must not be below 0")

    @classmethod
    def of_rig(
        cls, kind: str, rig: Rig, *, spring_inertia_kgm2: float = 0.0, rotor_carry: float = 0.0
    ) -> "Configuration":
        """The rig's parts arranged as "FSEA" (what the bench is), "RFSEA" or "TFSEA".

        The output inertia and damping of the rig, its worm wheel, turn with theta_m / N and are
        counted with the motor. A worm gear allows FSEA; the other two are comparisons.

        Parameters
        ----------
        spring_inertia_kgm2 : float
            J_s of the housing or ring gear, which the rig does not know.

        Raises
        ------
        RigError
            If the kind is unknown, or the rig has no gear or spring or lacks their values.
        """
        if kind not in KINDS:
            raise RigError(f"configuration {kind!r} is unknown; {nearest(kind, KINDS)}")
        if not (rig.has("gear") and rig.has("spring")):
            raise RigError(f"rig {rig.name!r}: the configuration {kind} needs a gear and a spring")
        rig.need(
            f"the configuration {kind}",
            "gear_ratio",
            "motor_inertia_kgm2",
            "spring_stiffness_Nm_per_rad",
        )
        N = rig.gear_ratio
        wheel_inertia = impedance_to_motor(rig.output_inertia_kgm2 or 0.0, N)
        wheel_viscous = impedance_to_motor(rig.output_viscous_Nms_per_rad or 0.0, N)
        return cls(
            name=kind,
            motor_share=1.0 / N,
            spring_share={"FSEA": -1.0, "RFSEA": 1.0, "TFSEA": (N - 1.0) / N}[kind],
            stiffness_Nm_per_rad=rig.spring_stiffness_Nm_per_rad,
            motor_inertia_kgm2=rig.motor_inertia_kgm2 + wheel_inertia,
            motor_viscous_Nms_per_rad=(rig.motor_viscous_Nms_per_rad or 0.0) + wheel_viscous,
            spring_inertia_kgm2=spring_inertia_kgm2,
            load_inertia_kgm2=rig.load_inertia_kgm2 or 0.0,
            load_viscous_Nms_per_rad=rig.load_viscous_Nms_per_rad or 0.0,
            rotor_carry=rotor_carry,
        )

    def mass_matrix(self) -> NDArray:
        """M [kg m^2] in q = (theta_m, theta_s), (2, 2)."""
        return self._matrices(with_load=True)[0]

    def _matrices(self, *, with_load: bool) -> NDArray:
        """M, C, K as a (3, 2, 2) array."""
        r = np.array([1.0, self.rotor_carry])
        m, s, load = np.array([1.0, 0.0]), np.array([0.0, 1.0]), self._load_direction()
        share = 1.0 if with_load else 0.0
        mass = (
            self.motor_inertia_kgm2 * np.outer(r, r)
            + self.spring_inertia_kgm2 * np.outer(s, s)
            + share * self.load_inertia_kgm2 * np.outer(load, load)
        )
        # the rotor's bearings sit in what carries it: their friction sees theta_m alone
        damping = (
            self.motor_viscous_Nms_per_rad * np.outer(m, m)
            + self.spring_viscous_Nms_per_rad * np.outer(s, s)
            + share * self.load_viscous_Nms_per_rad * np.outer(load, load)
        )
        return read_only(np.stack((mass, damping, self.stiffness_Nm_per_rad * np.outer(s, s))))

    def _load_direction(self) -> NDArray:
        return np.array([self.motor_share, self.spring_share])

    def _sensed(self) -> NDArray:
        """Row that gives tau_s of q."""
        return np.array([0.0, -self.stiffness_Nm_per_rad / self.spring_share])


MOTOR = np.array([1.0, 0.0])
NOTHING_HELD = np.eye(2)
MOTOR_HELD = np.array([[0.0], [1.0]])


def _output_locked(c: Configuration) -> NDArray:
    return np.array([[1.0], [-c.motor_share / c.spring_share]])


def _solve(matrices: NDArray, basis: NDArray, drive: NDArray, output: NDArray):
    """Polynomials of output' q over the drive's amplitude, q = basis p moving freely."""
    D = np.einsum("ki,nkl,lj->ijn", basis, matrices, basis)
    e, o = basis.T @ drive, basis.T @ output
    if D.shape[0] == 1:
        return o[0] * e[0] * np.ones(1), D[0, 0]
    determinant = np.polysub(np.polymul(D[0, 0], D[1, 1]), np.polymul(D[0, 1], D[1, 0]))
    numerator = (
        o[0] * e[0] * D[1, 1]
        - o[0] * e[1] * D[0, 1]
        - o[1] * e[0] * D[1, 0]
        + o[1] * e[1] * D[0, 0]
    )
    return numerator, determinant


def spring_torque_locked(c: Configuration) -> TransferFunction:
    """tau_s / tau_m with the output locked: N K / (J s^2 + B s + K) for the FSEA.

    Its gain at rest is 1/a = N for every configuration (the thesis' 2.31 has 1: errata D8).
    """
    n, d = _solve(c._matrices(with_load=False), _output_locked(c), MOTOR, c._sensed())
    return TransferFunction(numerator=n, denominator=d, input_unit="Nm", output_unit="Nm")


def transmissibility(c: Configuration) -> TransferFunction:
    """Torque that a locked load receives over tau_m: how much of the motor gets through.

    The FSEA's equals `spring_torque_locked`, because nothing that moves lies between spring and
    load. Where J_s lies beyond the spring, the load also receives what accelerates it: the
    spring does not sense that part, and a pair of zeros appears, at sqrt(K / J_s) for c = 0.
    """
    matrices, basis = c._matrices(with_load=False), _output_locked(c)
    _, moving = _solve(matrices, basis, MOTOR, MOTOR)
    row = np.einsum("nj,j->n", matrices[:, 0, :], basis[:, 0])  # motor's own equation
    return TransferFunction(
        numerator=np.polysub(moving, row) / c.motor_share,
        denominator=moving,
        input_unit="Nm",
        output_unit="Nm",
    )


def load_impedance(c: Configuration) -> TransferFunction:
    """Torque that moves the output over its angle, tau_m = 0 and the load taken off.

    For the FSEA K (J s^2 + B s) / (J s^2 + B s + K) with J, B at the output: the thesis' 2.33
    with its sign set right (errata D10). Divided by s it is positive real: a passive port.
    """
    load = c._load_direction()
    compliance, determinant = _solve(c._matrices(with_load=False), NOTHING_HELD, load, load)
    return TransferFunction(
        numerator=determinant, denominator=compliance, input_unit="rad", output_unit="Nm"
    )


def force_sensitivity(c: Configuration, *, motor_held: bool = True) -> TransferFunction:
    """Sensed torque tau_s over an external torque on the load: how well contact is felt.

    With the motor held (a self-locking worm) the gain at rest is -1 for every configuration:
    the spring carries what pushes the load, and more of it above the resonance is lost. With
    the motor free the spring only carries what it takes to accelerate the motor.
    """
    basis = MOTOR_HELD if motor_held else NOTHING_HELD
    n, d = _solve(c._matrices(with_load=True), basis, c._load_direction(), c._sensed())
    return TransferFunction(numerator=n, denominator=d, input_unit="Nm", output_unit="Nm")


def compliance(c: Configuration, *, motor_held: bool = True) -> TransferFunction:
    """Load angle over an external torque on the load: how far a contact pushes it.

    b^2 / K at rest with the motor held; a free motor gives way without end.
    """
    basis, load = MOTOR_HELD if motor_held else NOTHING_HELD, c._load_direction()
    n, d = _solve(c._matrices(with_load=True), basis, load, load)
    return TransferFunction(numerator=n, denominator=d, input_unit="Nm", output_unit="rad")


def load_angle_per_motor_torque(c: Configuration) -> TransferFunction:
    """Load angle over tau_m, free load; a / ((J_m + a^2 J_l) s^2) for a stiff spring."""
    n, d = _solve(c._matrices(with_load=True), NOTHING_HELD, MOTOR, c._load_direction())
    return TransferFunction(numerator=n, denominator=d, input_unit="Nm", output_unit="rad")


def spring_torque_free(c: Configuration) -> TransferFunction:
    """tau_s / tau_m with a free load."""
    n, d = _solve(c._matrices(with_load=True), NOTHING_HELD, MOTOR, c._sensed())
    return TransferFunction(numerator=n, denominator=d, input_unit="Nm", output_unit="Nm")
