"""A linear device in its steady state, with invented noise and distortion: what is asked for is exactly there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

RATE_HZ, PERIOD = 1000.0, 1000


@dataclass(frozen=True)
class InventedDevice:
    """Segment after segment: each axis at each level, four periods, rest between them."""

    levels: tuple[float, ...] = (0.5, 1.0, 2.0)
    axes: int = 2
    periods: int = 4
    noise: float = 0.05
    position_noise: float = 5e-6
    step: float = 0.0
    cubic: float = 0.0
    square: float = 0.0
    coulomb: float = 0.0
    swaying: float = 0.0
    full: bool = False
    rest: int = 500

    def command(self, seed: int) -> tuple[np.ndarray, tuple[Segment, ...]]:
        random = np.random.default_rng([seed, 1])
        lines = np.arange(3, 200) if self.full else np.setdiff1d(np.arange(3, 200, 2), np.arange(7, 200, 8))
        parts, segments, at = [], [], 0
        for axis in range(self.axes):
            for level in self.levels:
                spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
                spectrum[lines] = np.exp(2j * np.pi * random.random(len(lines)))
                wave = np.fft.irfft(spectrum, PERIOD)
                one = np.zeros((self.periods * PERIOD + self.rest, self.axes))
                one[: self.periods * PERIOD, axis] = np.tile(wave * level / np.abs(wave).max(), self.periods)
                segments.append(Segment(at, at + self.periods * PERIOD, "multisine", level, PERIOD, "fit"))
                parts.append(one)
                at += len(one)
        return np.vstack(parts), tuple(segments)

    def linear(self, command: np.ndarray, segments: tuple[Segment, ...]) -> tuple[np.ndarray, np.ndarray]:
        """Acceleration and position, (n, axes) each: each axis its own mass, and a tenth of it crosses over."""
        position = np.zeros_like(command)
        omega = 2 * np.pi * np.fft.rfftfreq(PERIOD, 1 / RATE_HZ)
        mix = np.eye(self.axes) + 0.1 * (1 - np.eye(self.axes))
        compliance = 1 / (400.0 + 4.0 * 1j * omega - 0.2 * omega**2)
        acceleration = np.zeros_like(command)
        for segment in segments:
            there = slice(segment.start, segment.stop)
            drive = np.fft.rfft(command[segment.start : segment.start + PERIOD], axis=0) @ mix
            moved = drive * compliance[:, None]
            repeats = (segment.stop - segment.start) // PERIOD
            position[there] = np.tile(np.fft.irfft(moved, PERIOD, axis=0), (repeats, 1))
            acceleration[there] = np.tile(np.fft.irfft(-(omega**2)[:, None] * moved, PERIOD, axis=0), (repeats, 1))
        return acceleration, position

    def recorded(self, seed: int = 1) -> Recording:
        random = np.random.default_rng([seed, 2])
        command, segments = self.command(seed)
        acceleration, position = self.linear(command, segments)
        response = acceleration + self.cubic * acceleration**3 + self.square * acceleration**2
        # As friction would, where the mass is all that counts.
        response -= self.coulomb * np.sign(np.gradient(position, axis=0))
        response *= 1 + self.swaying * np.sin(2 * np.pi * 0.73 * np.arange(len(command)) / RATE_HZ)[:, None]
        response = response + self.noise * random.standard_normal(response.shape)
        position = position + self.position_noise * random.standard_normal(position.shape)
        if self.step:
            position = self.step * np.round(position / self.step)
        names = "xyz"[: self.axes]
        return Recording(
            "invented",
            Signal(command, RATE_HZ, "force", "N", tuple(f"f{n}" for n in names)),
            Signal(response, RATE_HZ, "acceleration", "m/s^2", tuple(f"a{n}" for n in names)),
            Signal(position, RATE_HZ, "position", "m", tuple(names)),
            segments=segments,
        )


@pytest.fixture
def device() -> Callable[..., InventedDevice]:
    return InventedDevice


@pytest.fixture(scope="session")
def make_context(diagnosed) -> Callable[..., Any]:
    """What the engine's parts share, over the recording of a small simulated device; see `tests/diagnosed.py`. Imported
    late: it compiles."""
    from analysis.diagnosis.errors.choose_measure import make_measure
    from analysis.diagnosis.errors.tuning import make_tuning
    from analysis.diagnosis.search.search_context import SearchContext

    def context(effects=(), given=None, axes=1, seed=4):
        recording = diagnosed.recorded(axes, effects, seed)
        model = diagnosed.device(axes) if given is None else given
        measure = make_measure([recording], model).measure
        return SearchContext(measure.shorten(), measure, make_tuning(model, recording.command.channels), map)

    return context


@pytest.fixture(scope="session")
def make_candidate() -> Callable[..., Any]:
    """A candidate with invented errors, in units of the noise; names: effects of the catalogue, the last is the new
    one."""
    from analysis.diagnosis.errors.fit_score import FitScore
    from analysis.diagnosis.errors.hypothesis import NO_EFFECTS, Claim, combine_hypotheses, make_claim_hypothesis
    from analysis.diagnosis.errors.output_error import Fitted
    from analysis.diagnosis.search.search_context import FittedCandidate
    from equalizer.effects.catalogue import EFFECTS

    def candidate(seen, *names, test=None, sites=(0,)):
        whole = NO_EFFECTS
        for name in names:
            effect = EFFECTS[name]
            values = {p.name: min(max(1.0, p.lower), p.upper) for p in effect.parameters}
            whole = combine_hypotheses(whole, make_claim_hypothesis(Claim(effect, "one", sites), [values]))
        errors = np.atleast_1d(np.asarray(seen, dtype=float))
        sealed = errors if test is None else np.atleast_1d(np.asarray(test, dtype=float))
        return FittedCandidate(Fitted(whole, np.zeros(0), (), 0.0), FitScore(errors, errors, sealed))

    return candidate
