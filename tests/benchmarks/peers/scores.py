"""What a model is worth against the truth, the same way for every method."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import plants
from exchange import Data, Model

HELD_OUT_S = 10.0
LINES_PER_HZ = 20


@dataclass(frozen=True)
class Score:
    cpu_s: float
    states: int
    radius: float
    """Largest pole, at the model's own rate; of a continuous model, what its slowest pole is after 1 ms."""
    rms: tuple[float, ...]
    """Error of the frequency response over its size, all lines of a band together; one for each band asked for."""
    worst_line: float
    """In the first band, of the line's own size."""
    held_out: float
    """Error over size of the true accelerations in a multisine that was not used; NaN if the model is not stable."""

    @property
    def stable(self) -> bool:
        return self.radius < 1.0


def score(model: Model, bands_hz: tuple[tuple[float, float], ...] = ((5.0, 35.0),)) -> Score:
    errors = [_line_errors(response_of(model, lines), lines) for lines in map(_lines, bands_hz)]
    radius = _radius(model)
    return Score(
        cpu_s=model.cpu_s,
        states=len(model.A),
        radius=radius,
        rms=tuple(float(np.sqrt((error**2).sum() / (size**2).sum())) for error, size in errors),
        worst_line=float((errors[0][0] / errors[0][1]).max()),
        held_out=_held_out(model) if radius < 1.0 else float("nan"),
    )


def score_of_estimate(data: Data) -> Score:
    """The estimate itself taken for a model, on its own lines."""
    inside = (data.frequency_hz >= data.band_hz[0]) & (data.frequency_hz <= data.band_hz[1])
    error, size = _line_errors(data.estimate[inside], data.frequency_hz[inside])
    rms = float(np.sqrt((error**2).sum() / (size**2).sum()))
    return Score(data.estimate_cpu_s, 0, float("nan"), (rms,), float((error / size).max()), float("nan"))


def response_of(model: Model, frequency_hz: np.ndarray) -> np.ndarray:
    s = 2j * np.pi * frequency_hz
    points = np.exp(s / model.rate_hz) if model.rate_hz else s
    descriptor = np.eye(len(model.A)) if model.E is None else model.E
    states = np.linalg.solve(points[:, None, None] * descriptor - model.A, model.B.astype(complex)[None])
    return model.C @ states + model.D


def _lines(band_hz: tuple[float, float]) -> np.ndarray:
    low, high = band_hz
    return np.linspace(low, high, round((high - low) * LINES_PER_HZ) + 1)


def _line_errors(response: np.ndarray, frequency_hz: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    truth = plants.omega_like().response(frequency_hz)
    return np.linalg.norm(response - truth, axis=(1, 2)), np.linalg.norm(truth, axis=(1, 2))


def _radius(model: Model) -> float:
    dynamics = model.A if model.E is None else np.linalg.solve(model.E, model.A)
    poles = np.linalg.eigvals(dynamics)
    return float(np.abs(poles).max() if model.rate_hz else np.exp(poles.real.max() / plants.RATE_HZ))


@cache
def _held_out_truth() -> tuple[np.ndarray, np.ndarray]:
    """Commands of one period, and the true accelerations of its second repetition."""
    command = plants.multisine(5.0, 35.0, HELD_OUT_S)
    return command, plants.omega_like().play(np.tile(command, (2, 1)))[len(command) :]


def _held_out(model: Model) -> float:
    command, truth = _held_out_truth()
    if model.rate_hz:
        # Nothing is above 35 Hz, so that every n-th sample says all.
        step = round(plants.RATE_HZ / model.rate_hz)
        played, truth = _simulated(model, np.tile(command[::step], (2, 1)))[len(command[::step]) :], truth[::step]
    else:
        played = _steady(model, command)
    return float(np.linalg.norm(played - truth) / np.linalg.norm(truth))


def _simulated(model: Model, command: np.ndarray) -> np.ndarray:
    x, driven = np.zeros(len(model.A)), command @ model.B.T
    states = np.empty((len(command), len(x)))
    for k, drive in enumerate(driven):
        states[k] = x
        x = model.A @ x + drive
    return states @ model.C.T + command @ model.D.T


def _steady(model: Model, command: np.ndarray) -> np.ndarray:
    """A continuous model is not simulated from rest, but heard when all has died out that does."""
    frequency = np.fft.rfftfreq(len(command), 1 / plants.RATE_HZ)
    spectrum = np.fft.rfft(command, axis=0)
    spectrum[1:] = np.einsum("fpm,fm->fp", response_of(model, frequency[1:]), spectrum[1:])
    spectrum[0] = 0.0
    return np.fft.irfft(spectrum, len(command), axis=0)
