"""The actuator as a gymnasium environment, for those who learn controllers.

    import gymnasium, rsea_core.gym_environment
    env = gymnasium.make("rsea/TorqueTracking-v0")

An action is the share of the command's range, held for one sample. An observation is what a
controller on the bench has: the reference and its rate, the torque by both encoders, the error,
the load's angle, both speeds by difference, and the last action, each divided by what is large
for it. The reward is minus the squared torque error in units of `error_scale_Nm`, less
`effort_weight` times the squared change of the action. The plant is the fixed-step engine of
`replay`, with every term that the model has; an episode draws the phase of its sine from the seed.

Source: the interface of gymnasium 1.x (Towers et al. 2024); `check_env` of gymnasium passes.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from rsea_core.effects.sensor_reading import controller_sensors, sensed
from rsea_core.engines.fixed_step.replay import CHANNELS, Replay
from rsea_core.errors import InputError
from rsea_core.machine.inputs import Load
from rsea_core.machine.quantities import count_angle_rad
from rsea_core.machine.rig import Rig
from rsea_core.machine.spring_table import spring_torque_Nm
from rsea_core.model.actuator_model import ActuatorModel

MOTOR, ANGLE = CHANNELS.index("motor_angle_rad"), CHANNELS.index("load_angle_rad")
TORQUE = CHANNELS.index("torque_Nm")
SPEEDS = [CHANNELS.index(f"{part}_velocity_rad_per_s") for part in ("motor", "load")]
N_OBSERVED = 8
FAR = 10.0  # bounds of an observation, in its own large values


class TorqueTracking(gymnasium.Env):
    """Follow a sine of torque.

    Parameters
    ----------
    model : ActuatorModel or None
        None: the rig preset "rsea-bench" without terms.
    load : Load
    amplitude_Nm, frequency_Hz : float
    duration_s, sample_time_s : float
    error_scale_Nm, effort_weight : float

    Raises
    ------
    InputError
        If a time, frequency or scale is not above 0.
    RseaError
        If the model cannot be run with this load.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  gymnasium's own form

    def __init__(
        self,
        model: ActuatorModel | None = None,
        load: Load | None = None,
        *,
        amplitude_Nm: float = 5.0,
        frequency_Hz: float = 1.0,
        duration_s: float = 4.0,
        sample_time_s: float = 1e-3,
        error_scale_Nm: float = 0.1,
        effort_weight: float = 0.01,
    ):
        for name, value in (
            ("frequency_Hz", frequency_Hz),
            ("duration_s", duration_s),
            ("sample_time_s", sample_time_s),
            ("error_scale_Nm", error_scale_Nm),
        ):
            if not value > 0.0:
                raise InputError(f"{name} = {value} must be above 0")
        self.model = model or ActuatorModel(Rig.preset("rsea-bench"))
        self.load = load or Load(kind="locked")
        self.amplitude_Nm, self.frequency_Hz = amplitude_Nm, frequency_Hz
        self.samples = round(duration_s / sample_time_s)
        self.sample_time_s = sample_time_s
        self.error_scale_Nm, self.effort_weight = error_scale_Nm, effort_weight
        rest = self._replay(0.0, 0.0)
        self._numbers = rest.numbers(self.model)
        self._rest = rest.start_state(self._numbers)
        self._spring = self.model.spring_table(self.load)
        rig = self.model.rig
        self._counts = (
            count_angle_rad(rig.motor_encoder_counts_per_rev or np.inf),
            count_angle_rad(rig.load_encoder_counts_per_rev or np.inf),
        )
        rows = self.samples + 1
        self._sensors = controller_sensors(self.model.terms, rows)
        self._times = np.arange(rows) * sample_time_s
        self._true, self._rates = np.zeros((2, rows)), np.zeros((2, rows))
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = spaces.Box(-FAR, FAR, (N_OBSERVED,), np.float32)

    def reset(self, *, seed: int | None = None, options: dict | None = None):
        """Start at rest; the seed draws the reference's phase."""
        super().reset(seed=seed)
        self._phase = float(self.np_random.uniform(0.0, 2.0 * np.pi))
        self._sample, self._state, self._last = 0, self._rest.copy(), 0.0
        start = self._state[1] * self.model.rig.gear_ratio, self._state[3]
        self._read = self._encoders(start, (0.0, 0.0))
        return self._observe(self._read), {}

    def step(self, action):
        """Hold the action for one sample."""
        share = float(np.clip(action[0], -1.0, 1.0))
        start = self._sample * self.sample_time_s
        rows, states = self._replay(start, share).run(
            self._numbers, start=self._state, with_states=True
        )
        self._sample, self._state = self._sample + 1, states[-1]
        before, self._read = self._read, self._encoders(rows[-1, [MOTOR, ANGLE]], rows[-1, SPEEDS])
        error = float(self._reference()[0] - rows[-1, TORQUE])
        reward = -((error / self.error_scale_Nm) ** 2)
        reward -= self.effort_weight * (share - self._last) ** 2
        self._last = share
        finished = self._sample >= self.samples
        info = {"torque_Nm": float(rows[-1, TORQUE]), "error_Nm": error}
        return self._observe(before), float(reward), False, finished, info

    def _replay(self, start_s: float, share: float) -> Replay:
        return Replay(
            time_s=np.array([start_s, start_s + self.sample_time_s]),
            command_name="duty",
            command=np.full(2, share),
            load=self.load,
        )

    def _encoders(self, angles, speeds) -> tuple[float, float]:
        """Motor and load angle as the model's sensors show them, in whole counts."""
        row, found = self._sample, []
        self._true[:, row], self._rates[:, row] = angles, speeds
        for j, count in enumerate(self._counts):
            angle = self._true[j, row]
            if self._sensors.noise.size:
                angle = self._sensors.noise[row, j] + sensed(
                    self._times, self._true[j], self._rates[j], True, row,
                    self._sensors.numbers[j], self._sensors.errors[j], 1.0,
                )  # fmt: skip
            counted = np.isfinite(count) and count > 0.0
            found.append(np.floor(angle / count) * count if counted else angle)
        return tuple(found)

    def _reference(self) -> tuple[float, float]:
        w = 2.0 * np.pi * self.frequency_Hz
        angle = w * self._sample * self.sample_time_s + self._phase
        return self.amplitude_Nm * np.sin(angle), self.amplitude_Nm * w * np.cos(angle)

    def _observe(self, before: tuple[float, float]) -> np.ndarray:
        wanted, rate = self._reference()
        motor, load = self._read
        gear, T = self.model.rig.gear_ratio, self.sample_time_s
        torque = float(spring_torque_Nm(self._spring, motor / gear - load))
        large = max(abs(self.amplitude_Nm), 1e-9)
        seen = (
            wanted / large,
            rate / (large * 2.0 * np.pi * self.frequency_Hz),
            torque / large,
            (wanted - torque) / self.error_scale_Nm,
            load / np.pi,
            (motor - before[0]) / gear / T,
            (load - before[1]) / T,
            self._last,
        )
        return np.clip(np.array(seen), -FAR, FAR).astype(np.float32)


if "rsea/TorqueTracking-v0" not in gymnasium.registry:
    gymnasium.register(id="rsea/TorqueTracking-v0", entry_point=TorqueTracking)
