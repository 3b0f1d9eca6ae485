"""What a law remembers, against the same computed by SciPy and NumPy."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid
from scipy.signal import lsim, lti

from equalizer.effects.simulation.command_path import compute_delayed_mean, compute_lagged_mean
from equalizer.laws.evaluate import evaluate, evaluate_held
from equalizer.laws.law import parse_law

RATE_HZ = 1000.0
TIME_S = np.arange(3000) / RATE_HZ
SIGNAL = 0.3 + np.sin(2 * np.pi * 3 * TIME_S) + 0.2 * np.cos(2 * np.pi * 41 * TIME_S)


def along(text: str) -> np.ndarray:
    return evaluate(parse_law(text, "force", "x"), {"x": SIGNAL, "vx": 2 * SIGNAL}, RATE_HZ)


@pytest.mark.parametrize("tau_s", [1e-5, 0.004, 0.3, 100.0])
def test_a_lag_is_that_of_a_linear_system(tau_s: float):
    _, expected, _ = lsim(lti([1.0], [tau_s, 1.0]), SIGNAL, TIME_S, X0=[SIGNAL[0] * tau_s])
    assert along(f"lag(x, {tau_s!r})") == pytest.approx(expected, abs=1e-9)


def test_an_integral_is_that_of_trapezoids():
    assert along("integral(x)") == pytest.approx(cumulative_trapezoid(SIGNAL, TIME_S, initial=0.0), abs=1e-12)


def test_a_play_follows_within_its_width():
    follows, kept = SIGNAL[0], []
    for value in SIGNAL:
        follows = min(max(follows, value - 0.25), value + 0.25)
        kept.append(follows)
    assert along("play(x, 0.25)") == pytest.approx(kept, abs=1e-15)


@pytest.mark.parametrize(("delay_s", "off"), [(0.0003, 1e-12), (0.05, 1e-12), (0.2505, 1e-12), (1.0, 0.02)])
def test_a_delay_is_the_signal_of_before(delay_s: float, off: float):
    """More than 256 samples late, it is remembered more coarsely."""
    expected = np.interp(TIME_S - delay_s, TIME_S, SIGNAL)
    assert along(f"delay(x, {delay_s!r})") == pytest.approx(expected, abs=off)


def test_operators_take_each_other():
    assert along("lag(delay(x, 0.05), 0.01) + 2*play(lag(vx, 0.02), 0.1)") == pytest.approx(
        evaluate(parse_law("lag(y, 0.01)", "force", "x"), {"y": along("delay(x, 0.05)")}, RATE_HZ)
        + 2 * evaluate(parse_law("play(y, 0.1)", "force", "x"), {"y": along("lag(vx, 0.02)")}, RATE_HZ)
    )


def test_held_signals_are_delayed_and_lagged_as_commands_are():
    """From zero before the first; a jump within a step is a ramp."""
    steps = np.sign(np.sin(2 * np.pi * 7 * TIME_S + 1))
    for text, expected, off in (
        ("delay(fx, 0.05)", compute_delayed_mean(steps, 1 / RATE_HZ, 0.05), 1e-12),
        ("lag(fx, 0.05)", compute_lagged_mean(steps, 1 / RATE_HZ, 0.05), 1e-4),
    ):
        held = evaluate_held(parse_law(text, "command", "x"), {"fx": steps}, RATE_HZ)
        assert held.mean(axis=0) == pytest.approx(expected, abs=off)
