"""A motor that runs one way in each take: what a friction differs by from take to take lies at frequency zero, and no
spring holds a shaft that turns."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.balance.balances import find_balances
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.first_model.fit_without_model import fit_first_linear_model
from analysis.diagnosis.first_model.model_from_balance import build_plain_model, compute_law_power_share
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import Signal

RATE_HZ, SAMPLES = 100.0, 1000
INERTIA, DAMPING, FRICTION = 0.02, 0.03, 1.0


def make_balance(*courses):
    """A balance with one named law, whose force in each take is a course."""
    regression = SimpleNamespace(
        select_columns=lambda laws: list(laws), fit_weights=lambda columns: np.ones(1), base_column_count=0,
        column_ranges=[slice(0, 1)],
        columns=[course[:, None] for course in courses],
        motions=[SimpleNamespace(step=1, rate_hz=RATE_HZ) for _ in courses],
    )  # fmt: skip
    return SimpleNamespace(search=SimpleNamespace(regression=regression), named=[SimpleNamespace(law_index=0)])


@pytest.mark.parametrize(
    ("levels", "share"), [((1.0, -1.0), 1 / (1 + 0.1**2)), ((1.0, 1.0), 0.0)], ids=["both ways", "one way"]
)
def test_only_a_law_that_differs_between_takes_has_power_below_their_band(levels, share):
    ripple = 0.1 * np.where(np.arange(SAMPLES) % 2, 1.0, -1.0)
    assert compute_law_power_share([make_balance(*(level + ripple for level in levels))], 2.0) == pytest.approx(
        share, abs=1e-6
    )


def record_shaft(speed, stiffness=0.0, seed=3):
    """A shaft with dry friction, on a spring or turning freely, whose torque gives it a speed (n,), in rad/s."""
    noise = np.random.default_rng(seed).standard_normal(len(speed))
    angle = np.cumsum(speed) / RATE_HZ
    torque = INERTIA * np.gradient(speed) * RATE_HZ + DAMPING * speed + FRICTION * np.sign(speed) + stiffness * angle
    response = speed + 2e-4 * speed.std() * noise
    return Recording(
        "a shaft",
        Signal(torque[:, None], RATE_HZ, "torque", "N m", ("t",)),
        Signal(response[:, None], RATE_HZ, "velocity", "rad/s", ("w",)),
        hold=Hold.LINEAR,
    )


def make_ramps(rng):
    """Speeds (n,) in rad/s between 2 and 40, one way, up and down."""
    return np.interp(np.arange(2 * SAMPLES), np.arange(0, 2 * SAMPLES + 100, 100), rng.uniform(2.0, 40.0, 21))


def test_no_spring_is_fitted_to_a_shaft_that_turns():
    """Part of the torque follows the angle about its trend, as slow friction may: spectra, which have no mean, show a
    spring there, but one would have stopped the shaft."""
    speed = make_ramps(np.random.default_rng(8))
    drift = np.cumsum(speed - speed.mean()) / RATE_HZ
    turning = record_shaft(speed)
    torque = turning.command.samples + 0.5 * drift[:, None]
    model, _ = fit_first_linear_model(
        [replace(turning, command=replace(turning.command, samples=torque))], lambda share: None
    )
    assert np.linalg.eigvalsh(model.stiffness)[0] == pytest.approx(0.0, abs=1e-9)  # a mode may be on the shaft


def test_a_spring_is_fitted_to_a_shaft_that_swings():
    times_s = np.arange(2 * SAMPLES) / RATE_HZ
    swing = 6.0 * np.sin(2 * np.pi * (0.4 + 0.06 * times_s) * times_s)
    model, _ = fit_first_linear_model([record_shaft(swing, stiffness=2.0)], lambda share: None)
    assert model.stiffness[0, 0] == pytest.approx(2.0, rel=0.3)


def test_beside_friction_the_stiffness_of_a_shaft_that_turns_is_not_re_tuned():
    """A re-tuned stiffness of rounding would be reported as negative."""
    ramps = make_ramps(np.random.default_rng(8))
    takes = [record_shaft(sign * ramps, seed=seed) for seed, sign in enumerate((1.0, -1.0))]
    model = build_plain_model(find_balances(takes, frozenset(), lambda: True), takes[0], "first")
    assert model is not None and model.mass[0, 0] == pytest.approx(INERTIA, rel=0.05)
    tuning = make_tuning(model, ("t",))
    assert not tuning.tune(np.full(len(tuning.names), -1.0)).stiffness.any()
