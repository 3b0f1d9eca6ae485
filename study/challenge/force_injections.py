"""Faults of mechanism and actuator, put into a recording of a real device by way of its recorded command.

The motion stays as it was measured. A mechanism that also needs the force F(x, v, a) along it would have been given
that much more, and a drive that makes g(u') of a command u' would have been given the u' with g(u') = u: either is
what a controller does that holds the motion, and exact whatever else the device does.

Written for the challenge alone: nothing of it is shared with the effects that a diagnosis compares.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import welch

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

DERIVATIVE = {
    "position": 0, "displacement": 0, "angle": 0, "velocity": 1, "speed": 1, "acceleration": 2, "voltage": 0,
    "angular velocity": 1, "angular speed": 1, "angular acceleration": 2,
}  # fmt: skip
WIDEST, LOUD = 0.15, 30.0
"""A motion is differentiated up to this share of the sample rate, and as far as its power is so often its noise's."""
SHARP = 0.05
"""Of the rms speed, within which dry friction turns round."""


@dataclass(frozen=True, slots=True, eq=False)
class Moved:
    """One axis of a recording; all (n,)."""

    q: FloatArray
    v: FloatArray
    a: FloatArray
    command: FloatArray
    rate_hz: float

    @property
    def seconds(self) -> float:
        return len(self.q) / self.rate_hz

    @property
    def share_of_time(self) -> FloatArray:
        """From 0 to 1."""
        return np.linspace(0.0, 1.0, len(self.q))


Numbers = Mapping[str, float]


@dataclass(frozen=True, slots=True)
class ForceInjection:
    effect: str
    """As the vocabulary calls it, or a new name written like it."""
    draw: Callable[[Moved, float, np.random.Generator], dict[str, float]]
    """Numbers from the strength, 0 (weakest) to 1."""
    command: Callable[[Moved, Numbers], FloatArray]
    """(n,): what had to be commanded."""
    actuator: bool = False
    """It sits in the drive: where a motion is imposed, there is none."""
    turns: bool = True
    """It has a meaning where a shaft goes round and round."""


def _rms(samples: FloatArray) -> float:
    return float(np.sqrt(np.mean((samples - samples.mean()) ** 2)))


def _level(moved: Moved, strength: float) -> float:
    """Rms of a force: from a fiftieth of the command's to all of it."""
    return _rms(moved.command) * float(0.02 * 50.0**strength)


def _weighed(name: str, shape: Callable[[Moved], FloatArray]) -> ForceInjection:
    """A force of one number that multiplies a shape."""

    def draw(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
        return {"size": _level(moved, strength) / max(_rms(shape(moved)), 1e-300)}

    return ForceInjection(name, draw, lambda moved, of: moved.command + of["size"] * shape(moved))


def _sign(moved: Moved) -> FloatArray:
    return np.asarray(np.tanh(moved.v / max(SHARP * float(np.sqrt(np.mean(moved.v**2))), 1e-300)))


def _centred(moved: Moved) -> FloatArray:
    return np.asarray(moved.q - 0.5 * (moved.q.min() + moved.q.max()))


def _draw_cogging(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    pitch = float(np.ptp(moved.q)) * float(random.uniform(0.03, 0.3))
    return {"amplitude": 1.4 * _level(moved, strength), "pitch": pitch, "turn": float(random.random())}


def _cogging(moved: Moved, of: Numbers) -> FloatArray:
    return moved.command + of["amplitude"] * np.sin(2 * np.pi * (moved.q / of["pitch"] + of["turn"]))


def _beyond(moved: Moved, position: float) -> FloatArray:
    far = _centred(moved)
    return np.asarray(np.sign(far) * np.maximum(np.abs(far) - position, 0.0))


def _draw_stop(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    position = float(random.uniform(0.4, 0.9)) * float(np.abs(_centred(moved)).max())
    stiffness = _level(moved, strength) / max(_rms(_beyond(moved, position)), 1e-300)
    return {"position": position, "stiffness": stiffness}


def _draw_one_sided(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    level, share = 1.2 * _level(moved, strength), float(random.uniform(0.2, 0.6))
    return {"level_positive": level * (1 + share), "level_negative": level * (1 - share)}


def _one_sided(moved: Moved, of: Numbers) -> FloatArray:
    sign = _sign(moved)
    return moved.command + np.where(sign > 0, of["level_positive"], of["level_negative"]) * sign


def _later(samples: FloatArray, by: float) -> FloatArray:
    at = np.arange(len(samples), dtype=np.float64)
    return np.asarray(np.interp(at - by, at, samples))


def _cubed(moved: Moved, of: Numbers) -> FloatArray:
    """The command whose own and cubed share are the force: Newton's steps from the force itself."""
    found = moved.command.copy()
    for _ in range(60):
        found -= (found + of["cubic"] * found**3 - moved.command) / (1 + 3 * of["cubic"] * found**2)
    return found


def _draw_limit(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    limit = float(np.quantile(np.abs(moved.command), 0.98))
    return {"limit": limit, "more": float(0.05 * 20.0**strength)}


def _beyond_limit(moved: Moved, of: Numbers) -> FloatArray:
    """More was commanded wherever the force was at its largest."""
    over = np.abs(moved.command) >= 0.97 * of["limit"]
    return np.asarray(np.where(over, moved.command * (1 + of["more"]), moved.command))


def _gain(moved: Moved, strength: float, random: np.random.Generator) -> dict[str, float]:
    return {"gain": float(1 + random.choice((-0.5, 1.0)) * 0.02 * 40.0**strength)}


FORCE_INJECTIONS: tuple[ForceInjection, ...] = (
    _weighed("added_mass", lambda moved: moved.a),
    _weighed("viscous_damping", lambda moved: moved.v),
    _weighed("quadratic_damping", lambda moved: moved.v * np.abs(moved.v)),
    _weighed("coulomb_friction", _sign),
    ForceInjection("asymmetric_friction", _draw_one_sided, _one_sided),
    _weighed("added_stiffness", _centred),
    _weighed("hardening_stiffness", lambda moved: _centred(moved) ** 3),
    ForceInjection("cogging", _draw_cogging, _cogging),
    ForceInjection(
        "end_stop", _draw_stop, lambda moved, of: moved.command + of["stiffness"] * _beyond(moved, of["position"])
    ),
    ForceInjection("force_gain", _gain, lambda moved, of: moved.command / of["gain"], actuator=True),
    ForceInjection(
        "force_offset",
        lambda moved, s, r: {"offset": float(r.choice((-1.0, 1.0))) * _level(moved, s)},
        lambda moved, of: moved.command - of["offset"],
        actuator=True,
    ),
    ForceInjection(
        "transport_delay",
        lambda moved, s, r: {"delay": max(0.3 * 0.02 * 50.0**s / _middle_turn(moved.command, moved.rate_hz), 1e-9)},
        lambda moved, of: _later(moved.command, -of["delay"] * moved.rate_hz),
        actuator=True,
    ),
    ForceInjection(
        "amplifier_lag",
        lambda moved, s, r: {"time_constant": 0.3 * 0.02 * 50.0**s / _middle_turn(moved.command, moved.rate_hz)},
        lambda moved, of: moved.command + of["time_constant"] * np.gradient(moved.command) * moved.rate_hz,
        actuator=True,
    ),
    ForceInjection("force_saturation", _draw_limit, _beyond_limit, actuator=True),
    ForceInjection(
        "force_deadband",
        lambda moved, s, r: {"width": 0.5 * _level(moved, s)},
        lambda moved, of: moved.command + of["width"] * np.sign(moved.command),
        actuator=True,
    ),
    ForceInjection(
        "actuator_cubic",
        lambda moved, s, r: {"cubic": 0.02 * 30.0**s / float(np.abs(moved.command).max()) ** 2},
        _cubed,
        actuator=True,
    ),
    ForceInjection(
        "force_gain_drift",
        lambda moved, s, r: {"change": float(r.choice((-0.5, 1.0))) * 0.05 * 20.0**s},
        lambda moved, of: moved.command / (1 + of["change"] * moved.share_of_time),
        actuator=True,
    ),
)


def _middle_turn(samples: FloatArray, rate_hz: float) -> float:
    """rad/s, below which half of the rate of change's power lies."""
    power = np.abs(np.fft.rfft(samples - samples.mean())) ** 2
    middle = int(np.searchsorted(np.cumsum(power), power.sum() / 2))
    return 2 * np.pi * max(middle, 1) * rate_hz / len(samples)


def _end_hz(samples: FloatArray, rate_hz: float) -> float:
    frequency, power = welch(samples, rate_hz, nperseg=min(len(samples), 2048))
    loud = np.flatnonzero(power > LOUD * np.median(power[3 * len(power) // 4 :]))
    last = float(frequency[loud[-1]]) if len(loud) else 0.0
    return float(np.clip(last, 20 * rate_hz / len(samples), WIDEST * rate_hz))


def moved_axis(recording: Recording, axis: int) -> Moved | None:
    """None where the axis has no motion of its own."""
    signals = [each for each in (recording.position, recording.response) if each is not None]
    width = recording.command.samples.shape[1]
    for signal in sorted(signals, key=lambda each: DERIVATIVE.get(each.quantities[0], 9)):
        orders = {DERIVATIVE.get(quantity, 9) for quantity in signal.quantities}
        if (signal.samples.shape[1] == width or width == 1) and max(orders) < 9:
            order = DERIVATIVE[signal.quantities[axis]]
            return _moved(signal.samples[:, axis], order, recording, axis)
    return None


def _moved(samples: FloatArray, order: int, recording: Recording, axis: int) -> Moved:
    """Line by line of the spectrum, mirrored at both ends; what was not measured lies on a straight line."""
    rate_hz, places = recording.sample_rate_hz, np.arange(len(samples))
    known = np.isfinite(samples)
    filled = np.interp(places, places[known], samples[known])
    line = np.interp(places, [0, len(filled) - 1], [filled[0], filled[-1]])
    whole = np.concatenate([filled - line, -(filled - line)[-2:0:-1]])
    frequency = np.fft.rfftfreq(len(whole), 1 / rate_hz)
    spectrum = np.fft.rfft(whole)
    cut = _end_hz(filled - line, rate_hz)
    slope = (filled[-1] - filled[0]) / max(len(filled) - 1, 1) * rate_hz
    found = []
    for wanted in range(3):
        times = wanted - order
        turn = 2j * np.pi * np.maximum(frequency, 1e-12)
        gain = turn**times / (1 + (frequency / cut) ** 8)
        if times < 0:
            gain = np.where(frequency < 4 * rate_hz / len(filled), 0.0, gain)
        course = np.fft.irfft(gain * spectrum, len(whole))[: len(filled)]
        found.append(course + (line if times == 0 else slope if times == 1 else 0.0))
    return Moved(found[0], found[1], found[2], recording.command.samples[:, axis], rate_hz)
