"""The actuator: the rig's nominal equations and the terms put into them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

import rsea_core.effects.layout as e
import rsea_core.machine.plant as mp
import rsea_core.machine.quantities as q
import rsea_core.model.describe as equations
from rsea_core.effects.base import Parameter, Port, Term
from rsea_core.effects.registry import LAWS, TERMS, SeriesBacklash, SpringContact
from rsea_core.effects.slots import USER_PLACES, place_of
from rsea_core.errors import InputError, RigError, TermError
from rsea_core.machine.inputs import COMMANDS, POSITION_COMMAND, Load
from rsea_core.machine.rig import NOT_NEGATIVE, POSITIVE, QUANTITIES, Rig
from rsea_core.machine.spring_table import SpringTable, linear_table

GRAVITY_m_per_s2 = 9.80665  # standard gravity, CGPM 1901

DRIVES = {
    None: mp.NO_DRIVE,
    "duty": mp.DUTY,
    "voltage_V": mp.VOLTAGE,
    "current_command_A": mp.CURRENT,
    "motor_torque_Nm": mp.MOTOR_TORQUE,
    POSITION_COMMAND: mp.POSITION,
}
NEEDED_BY_DRIVE = {
    None: (),
    "duty": (
        "supply_voltage_V",
        "terminal_resistance_ohm",
        "torque_constant_Nm_per_A",
        "back_emf_constant_Vs_per_rad",
    ),
    "voltage_V": (
        "terminal_resistance_ohm",
        "torque_constant_Nm_per_A",
        "back_emf_constant_Vs_per_rad",
    ),
    "current_command_A": ("torque_constant_Nm_per_A",),
    "motor_torque_Nm": (),
    POSITION_COMMAND: ("servo_proportional_Nm_per_rad",),
}
FELT_GRAVITY = ("pendulum", "contact")  # loads that feel the rig's gravity
SHARED = ("internal_states", "wheel_dry", "load_dry")  # numbers that several terms may set
PART_OF_PORT = {
    Port.DRIVE: "drive",
    Port.GEAR: "gear",
    Port.SPRING: "spring",
    Port.LOAD: "load",
    Port.ENVIRONMENT: "load",
}


_LAST = (SpringContact, SeriesBacklash)  # to change a spring's law


def _turn(term: Term) -> int:
    return _LAST.index(type(term)) if type(term) in _LAST else -1


def _feels_gravity(rig: Rig, load: Load) -> bool:
    """Whether gravity acts: at a stop only if the rig states a mass or its distance."""
    stated = rig.load_mass_kg is not None or rig.load_distance_m is not None
    return load.kind in FELT_GRAVITY and (load.kind != "contact" or stated)


KINEMATIC = {"wheel_error"}  # numbers that move a rigid load against its wheel


@dataclass(frozen=True)
class ActuatorModel:
    """A rig and the terms that extend or replace parts of its nominal equations.

    Raises
    ------
    TermError
        If a term is not of the registry, or two terms replace the same nominal law.
    """

    rig: Rig
    terms: tuple[Term, ...] = ()

    def __post_init__(self):
        object.__setattr__(self, "terms", tuple(self.terms))
        replaced, known = [], {law for laws in LAWS.values() for law in laws.values()}
        for term in self.terms:
            if type(term) not in known:
                raise TermError(f"{type(term).__name__} is not one of the terms {list(TERMS)}")
            if term.replaces in replaced:
                raise TermError(f"two terms replace {term.replaces}: keep one {term.effect}")
            if term.replaces is not None:
                replaced.append(term.replaces)
        laws = [(term.effect, term.law, term.subsystem) for term in self.terms]
        for law in laws:
            if laws.count(law) > 1:
                raise TermError(f"{law[0]} ({law[1]}) at {law[2]} is there twice: keep one")

    @cached_property
    def kept(self) -> dict:
        """What is computed of this model alone, kept by whoever computes it for the next use."""
        return {}

    def __getstate__(self) -> dict:
        """Without what is kept: another version of this package may read it."""
        return {"rig": self.rig, "terms": self.terms}

    def with_terms(self, *terms: Term) -> "ActuatorModel":
        """This model with more terms."""
        return replace(self, terms=(*self.terms, *terms))

    def parameters(self) -> Mapping[str, Parameter]:
        """Every value of the model by name: the rig's keys, then effect.parameter of terms."""
        bounds = {POSITIVE: (np.finfo(float).tiny, np.inf), NOT_NEGATIVE: (0.0, np.inf)}
        found = {}
        for key, info in QUANTITIES.items():
            value = getattr(self.rig, key)
            if value is not None:
                found[key] = Parameter(
                    value=value,
                    unit=info["unit"],
                    bounds=bounds.get(info["allowed"], (-np.inf, np.inf)),
                    source=f"rig {self.rig.name}",
                    free=key not in self.rig.anchors,
                    meaning=f"{key} of the rig",
                )
        for term in self.terms:
            found |= {f"{term.key}.{name}": p for name, p in term.parameters().items()}
        return found

    def spring_table(self, load: Load) -> SpringTable:
        """The elastic law between wheel and load; zero where they are one rigid body.

        Raises
        ------
        RigError
            If there is neither a stiffness nor a term in its place.
        """
        if self.structure(load) not in (mp.ELASTIC_FREE, mp.ELASTIC_HELD):
            return linear_table(0.0)
        for term in self.terms:
            if term.replaces == "spring_stiffness_Nm_per_rad":
                table = term.table()
                break
        else:
            self.rig.need("the spring", "spring_stiffness_Nm_per_rad")
            table = linear_table(self.rig.spring_stiffness_Nm_per_rad)
        # coils touch on whatever the spring is until then, play is in series with all of it
        for term in sorted(self.terms, key=_turn):
            table = term.on_spring(table)
        return table

    def effects(self, command_name: str | None, load: Load) -> NDArray:
        """The terms' numbers for the compiled kernel (`layout`), at the gear output.

        A term of the load does not act where the load is held.

        Raises
        ------
        TermError
            If a term cannot act on this machine, or acts on a part that it does not have.
        """
        acting = [term for term in self.terms if self._acts(term, load)]
        structure = self.structure(load)
        rigid = structure in (mp.RIGID_FREE, mp.RIGID_HELD)
        gear = q.GearReflection(self.rig.gear_ratio if self.rig.has("gear") else 1.0)
        gravity = GRAVITY_m_per_s2 if _feels_gravity(self.rig, load) else 0.0
        given = [term.numbers(gear) | term.rig_numbers(self.rig, gravity) for term in acting]
        dry = {name for numbers in given for name in numbers if name.endswith("_dry")}
        found, setter = _numbers_of_servo(self.rig, command_name), {}
        for term, numbers in zip(acting, given, strict=True):
            obstacle = term.needs(command_name, rigid, len(dry))
            if obstacle is None and rigid and load.is_held and numbers.keys() & (dry | KINEMATIC):
                obstacle = "needs a spring where the load is held"
            if obstacle is not None:
                raise TermError(f"{term.effect} on rig {self.rig.name!r}: {obstacle}")
            for name, value in numbers.items():
                other = setter.setdefault(name, term)
                if other is not term and name not in SHARED:
                    raise TermError(f"{other.key} and {term.key} are laws of one thing: keep one")
                found[place_of(name)] = value
                found[e.ANY] = 1.0
                if e.USER <= place_of(name) < e.USER + USER_PLACES:
                    found[e.OUTSIDE] = e.OUTSIDE_HOOKS.address()
        if structure == mp.RIGID_FREE:
            loss = found[e.GEAR_BACKDRIVE_LOSS]
            if found[e.GEAR_BRISTLE] > 1.5:  # a loaded thread's
                loss *= 1.0 + found[e.GEAR_RISE]
            self._require_no_jam(loss)
        return found

    def _require_no_jam(self, backdrive_loss: float) -> None:
        """Back-driven, a self-locking worm brakes its load by more than the load pushes.

        Where the load's inertia does that to the whole machine no motion satisfies the law of
        friction (Painleve's paradox): only a spring in between says what happens.
        """
        load = (self.rig.load_inertia_kgm2 or 0.0) if self.rig.has("load") else 0.0
        whole = self._at_output("inertia_kgm2") + (1.0 - backdrive_loss) * load
        if backdrive_loss > 1.0 and not whole > 0.0:
            raise TermError(
                f"gear-load-friction on rig {self.rig.name!r}: the worm jams under a rigid load of"
                f" {load:g} kg m^2 that it lowers: needs a spring"
            )

    def _acts(self, term: Term, load: Load) -> bool:
        if term.port is Port.SENSOR:
            return False
        part = PART_OF_PORT[term.port]
        shaft = part == "load" and not self.rig.has("spring")  # what turns is the load
        if not shaft and not self.rig.has(part):
            raise TermError(f'{term.effect}: rig {self.rig.name!r} has no "{part}"')
        return not (load.is_held and term.port in (Port.LOAD, Port.ENVIRONMENT))

    def structure(self, load: Load) -> int:
        """How wheel and load are joined (`kernel.ELASTIC_FREE` and the like)."""
        unloaded = not self.rig.has("load") and not load.is_held
        if self.rig.has("spring") and not unloaded:
            return mp.ELASTIC_HELD if load.is_held else mp.ELASTIC_FREE
        return mp.RIGID_HELD if load.is_held else mp.RIGID_FREE

    def require(self, command_name: str | None, load: Load) -> None:
        """Check that the rig holds what this drive and load need.

        Raises
        ------
        InputError
            If the rig has no part for this drive or load to act on.
        RigError
            Naming the values that are missing.
        """
        rig = self.rig
        if command_name is None and rig.has("drive"):
            raise InputError(
                f"rig {rig.name!r} has a drive: give a command ({', '.join(COMMANDS)})"
            )
        if command_name is not None and not rig.has("drive"):
            raise InputError(f"rig {rig.name!r} has no drive: {command_name} has nothing to act on")
        if not rig.has("load") and load.kind not in ("locked", "imposed", "free"):
            raise InputError(f'rig {rig.name!r} has no load: "{load.kind}" is not possible on it')
        rig.need(f"a simulation driven by {command_name}", *NEEDED_BY_DRIVE[command_name])
        elastic = self.structure(load) in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
        turns = self._at_output("inertia_kgm2") > 0.0  # as one body with the load, if rigid
        moves = rig.has("load") and not load.is_held
        known = turns or (moves and rig.load_inertia_kgm2)
        if rig.has("gear") and command_name != POSITION_COMMAND and (elastic or not known):
            rig.need("the wheel's motion", "motor_inertia_kgm2")
        if moves and (elastic or not turns):
            rig.need(f'the load "{load.kind}"', "load_inertia_kgm2")
        if rig.has("load") and _feels_gravity(self.rig, load):
            rig.need(f'gravity on the load "{load.kind}"', "load_mass_kg", "load_distance_m")

    def plant(self, command_name: str | None, load: Load) -> mp.Plant:
        """The numbers that the compiled kernel integrates, on the output side of the gear.

        Raises
        ------
        RigError
            If the rig lacks a value that this drive and load need, or nothing can move.
        """
        self.require(command_name, load)
        rig, structure = self.rig, self.structure(load)
        ratio = rig.gear_ratio if rig.has("gear") else 1.0
        k_t = rig.torque_constant_Nm_per_A or 0.0
        k_e = k_t if rig.back_emf_constant_Vs_per_rad is None else rig.back_emf_constant_Vs_per_rad
        moving = rig.has("load") and not load.is_held
        gravity = moving and _feels_gravity(self.rig, load)
        plant = mp.Plant(
            drive=DRIVES[command_name],
            structure=structure,
            volts_per_command=(rig.supply_voltage_V or 0.0) if command_name == "duty" else 1.0,
            resistance=rig.terminal_resistance_ohm or 0.0,
            inductance=rig.terminal_inductance_H or 0.0,
            torque_per_ampere=q.transducer_to_output(k_t, ratio),
            volts_per_speed=q.transducer_to_output(k_e, ratio),
            torque_per_motor_torque=q.torque_to_output(1.0, ratio),
            current_limit=rig.current_limit_A or np.inf,
            inertia=self._at_output("inertia_kgm2"),
            damping=self._at_output("viscous_Nms_per_rad"),
            load_inertia=(rig.load_inertia_kgm2 or 0.0) if moving else 0.0,
            load_damping=(rig.load_viscous_Nms_per_rad or 0.0) if moving else 0.0,
            gravity=rig.load_mass_kg * GRAVITY_m_per_s2 * rig.load_distance_m if gravity else 0.0,
            gravity_offset=rig.gravity_angle_offset_rad or 0.0,
            load_torque=load.load_torque_Nm or 0.0,
            contact_stiffness=load.contact_stiffness_Nm_per_rad or 0.0,
            contact_damping=load.contact_damping_Nms_per_rad or 0.0,
            contact_angle=np.inf if load.contact_angle_rad is None else load.contact_angle_rad,
            gear_ratio=ratio,
            motor_count=_count(rig.motor_encoder_counts_per_rev),
            load_count=_count(rig.load_encoder_counts_per_rev),
        )
        plant = _with_servo(plant, rig)
        for term in self.terms:
            if self._acts(term, load):
                plant = term.on_plant(plant)
        _require_inertia(rig, plant)
        return plant

    def describe(self, command_name: str | None = "duty", load: Load = Load()) -> str:  # noqa: B008
        """The equations that are solved for this drive and load, with values and sources.

        Raises
        ------
        RigError
            As `plant`.
        """
        plant = self.plant(command_name, load)
        return equations.describe(self.rig, self.terms, plant, command_name, load)

    def _at_output(self, quantity: str) -> float:
        """Inertia or damping of motor and wheel together, at the gear output."""
        rig = self.rig
        if not rig.has("gear"):
            return 0.0
        motor = getattr(rig, f"motor_{quantity}") or 0.0
        return q.impedance_to_output(motor, rig.gear_ratio) + (
            getattr(rig, f"output_{quantity}") or 0.0
        )


def _require_inertia(rig: Rig, plant: mp.Plant) -> None:
    elastic = plant.structure in (mp.ELASTIC_FREE, mp.ELASTIC_HELD)
    if elastic and not rig.has("gear"):
        raise RigError(
            f"rig {rig.name!r}: nothing moves without a gear: evaluate the spring's"
            " curve instead of simulating"
        )
    inertia = plant.inertia
    if plant.structure == mp.RIGID_FREE:
        inertia += plant.load_inertia
    if plant.structure != mp.RIGID_HELD and not inertia > 0.0:
        raise RigError(
            f"rig {rig.name!r}: the moving inertia is zero; give motor_inertia_kgm2,"
            " output_inertia_kgm2 or load_inertia_kgm2"
        )


def _numbers_of_servo(rig: Rig, command_name: str | None) -> NDArray:
    """Effects (N_EFFECTS,) of a servo's stated delay alone, none of other drives."""
    found = np.zeros(e.N_EFFECTS)
    if command_name == POSITION_COMMAND and rig.servo_delay_s:
        found[e.COMMAND_DELAY], found[e.ANY] = rig.servo_delay_s, 1.0
    return found


def _with_servo(plant: mp.Plant, rig: Rig) -> mp.Plant:
    """The plant whose drive is the rig's inner position loop, see `Plant`; others unchanged."""
    if plant.drive != mp.POSITION:
        return plant
    gain, damping = rig.servo_proportional_Nm_per_rad, rig.servo_derivative_Nms_per_rad or 0.0
    return plant._replace(
        volts_per_command=gain, resistance=1.0, inductance=0.0, torque_per_ampere=1.0,
        volts_per_speed=damping, torque_per_motor_torque=1.0,
        current_limit=rig.servo_torque_limit_Nm or np.inf,
        goal_dead_band=rig.servo_dead_band_rad or 0.0,
        goal_rate_s=damping / gain if rig.servo == "angle-and-rate" else 0.0,
    )  # fmt: skip


def _count(counts_per_rev: float | None) -> float:
    return 0.0 if counts_per_rev is None else q.count_angle_rad(counts_per_rev)
