"""Recordings whose truth is known: one mass on a spring, driven by noise or a multisine."""

import numpy as np
import pytest
from scipy import signal as sg

from equalizer.signals.recording import Recording
from equalizer.signals.signal import Signal

RATE_HZ = 1000.0


@pytest.fixture(scope="session")
def make_noise():
    """Band-limited, rms 1."""

    def make(n=20_000, seed=1, high_hz=80.0):
        raw = np.random.default_rng(seed).standard_normal(n)
        shaped = sg.sosfiltfilt(sg.butter(4, high_hz, fs=RATE_HZ, output="sos"), raw)
        return shaped / shaped.std()

    return make


@pytest.fixture(scope="session")
def simulate_motion():
    """Position, speed and acceleration under a force: 0.2 kg, 2 N s/m, 800 N/m, simulated ten times as fine."""

    def make(force):
        system = sg.StateSpace([[0, 1], [-800 / 0.2, -2 / 0.2]], [[0], [1 / 0.2]], np.eye(2), np.zeros((2, 1)))
        fine = np.interp(np.arange(10 * len(force) - 9) / 10, np.arange(len(force)), force)
        _, states, _ = sg.lsim(system, fine, np.arange(len(fine)) / (10 * RATE_HZ))
        place, speed = states[::10, 0], states[::10, 1]
        return place, speed, (force - 2 * speed - 800 * place) / 0.2

    return make


@pytest.fixture(scope="session")
def make_recording():
    def make(command, response, **others):
        """response: samples, or (samples, quantity, unit)."""

        def signal(name, given, quantity, unit):
            samples, *said = given if isinstance(given, tuple) else (given,)
            quantity, unit = said or (quantity, unit)
            columns = np.asarray(samples, dtype=float)
            columns = columns[:, None] if columns.ndim == 1 else columns
            names = tuple(f"{name}{k + 1}" for k in range(columns.shape[1]))
            return Signal(columns, others.get("rate_hz", RATE_HZ), quantity, unit, names)

        return Recording(
            "rig",
            signal("f", command, "force", "N"),
            signal("a", response, "acceleration", "m/s^2"),
            position=signal("x", others["position"], "position", "m") if "position" in others else None,
            excitation=signal("f", others["excitation"], "force", "N") if "excitation" in others else None,
            time_s=others.get("time_s"),
            segments=others.get("segments", ()),
            meta=others.get("meta", {}),
        )

    return make


@pytest.fixture(scope="session")
def clean_recording(make_noise, simulate_motion, make_recording):
    """A recording with nothing to complain of."""
    force = make_noise()
    place, _, acceleration = simulate_motion(force)
    rng = np.random.default_rng(9)
    return make_recording(
        force,
        acceleration + 0.01 * acceleration.std() * rng.standard_normal(len(force)),
        position=place + 1e-4 * place.std() * rng.standard_normal(len(force)),
    )
