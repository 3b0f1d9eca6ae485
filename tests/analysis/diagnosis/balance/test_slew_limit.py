"""A servo that follows its target at a limited speed."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.balance.laws.command_laws import make_slew_laws
from analysis.diagnosis.limits import SLEW_REACHED_SHARE

RATE_HZ, SPEED = 50.0, 1.5


@pytest.fixture(scope="module")
def record_follower(record_samples):
    """Of a speed: a recording of steps and sines of a target in metres, and the position that follows."""

    def recording(speed, late=0, n=6000):
        rng = np.random.default_rng(5)
        times_s = np.arange(n) / RATE_HZ
        target = np.repeat(rng.uniform(-0.6, 0.6, n // 60), 60) + 0.2 * np.sin(2 * np.pi * 0.4 * times_s)
        target -= target[0]
        heard = np.concatenate([np.zeros(late), target[: n - late]])
        place, seen = 0.0, np.zeros((n, 1))
        for k in range(n):
            seen[k] = place
            for _ in range(10):
                place += np.clip((heard[k] - place) / 0.08, -speed, speed) / (10 * RATE_HZ)
        made = record_samples(target[:, None], seen + 2e-4 * rng.standard_normal((n, 1)), RATE_HZ)
        return replace(made, command=replace(made.command, quantity="position", unit="m"))

    return recording


@pytest.mark.slow
@pytest.mark.parametrize("offset_m", [-10.0, 0.0, 1.5])
def test_the_limit_is_named_with_its_speed(offset_m, record_follower, find_balance):
    """Around any place: a servo of 0 to 180 degrees is centred at 90."""
    given = record_follower(SPEED)
    command, response = (replace(each, samples=each.samples + offset_m) for each in (given.command, given.response))
    (balance,) = find_balance(replace(given, command=command, response=response))

    assert balance.named[0].law.effect == "slew_limit"
    assert balance.named[0].values["rate"] == pytest.approx(SPEED, rel=0.2)


@pytest.mark.slow
def test_a_late_command_is_in_the_first_model_beside_the_limit(record_follower, find_balance):
    """Else the limit would be taken for a slower one, which is late, too."""
    from analysis.diagnosis.first_model.model_from_balance import build_plain_model

    late = 4
    given = record_follower(SPEED, late, 3000)
    model = build_plain_model(find_balance(given), given, "first")

    assert model is not None
    assert model.actuator.delay_s == pytest.approx(late / RATE_HZ, abs=1.2 / RATE_HZ)


@pytest.mark.slow
def test_a_servo_without_a_limit_gets_no_name(record_follower, find_balance):
    (balance,) = find_balance(record_follower(1e3))

    assert not balance.named


@pytest.mark.slow
def test_of_a_force_no_limit_is_asked(record_follower, find_balance):
    given = record_follower(SPEED)
    (balance,) = find_balance(replace(given, command=replace(given.command, quantity="force", unit="N")))

    assert not any(law.law.effect == "slew_limit" for law in (*balance.laws, *balance.further_laws))


def test_rates_that_never_catch_up_are_not_tried():
    command = np.sin(2 * np.pi * 5 * np.arange(5000) / 500)
    rates = [law.values["rate"] for law in make_slew_laws([command], 500.0)]

    assert rates
    for law in make_slew_laws([command], 500.0):
        reached = np.abs(law.compute_columns(command, command)[:, 0] - command) < law.values["rate"] / 500.0
        assert reached.mean() > SLEW_REACHED_SHARE
