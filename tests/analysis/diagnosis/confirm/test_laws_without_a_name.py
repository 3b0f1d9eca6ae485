"""Laws of a command that no effect of the catalogue plays: written as a formula, and confirmed by simulation."""

import numpy as np
import pytest

from analysis.diagnosis.diagnose_values import diagnose_values
from equalizer.laws.law import parse_law
from tests.analysis.diagnosis.balance.invented_axis import make_recording

RATE_HZ = 100.0


def record_driven_mass(given, seed, count=6000):
    """Recording of a mass of 0.2 kg with a damping of 0.5 N s/m on a spring of 5 N/m, driven by given(command), in
    random steps of the command."""
    random = np.random.default_rng([seed, 7])
    command = np.repeat(random.uniform(-1.0, 1.0, count // 40), 40)
    position, x, v = np.empty(count), 0.0, 0.0
    for k, push in enumerate(given(command).tolist()):
        position[k] = x
        for _ in range(10):
            v += (push - 0.5 * v - 5.0 * x) / 0.2 / (10 * RATE_HZ)
            x += v / (10 * RATE_HZ)
    read = position + 1e-4 * random.standard_normal(count)
    return make_recording(command[:, None], read[:, None], RATE_HZ)


def valve_curve(u):
    return np.sign(u) * np.maximum(np.abs(u) - 0.1, 0.0) ** 0.4


def effects_by_name(found):
    return {effect.effect: effect for effect in found.diagnosis.effects}


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_curve_of_a_valve_is_named_with_its_formula(seed):
    found = diagnose_values([record_driven_mass(valve_curve, seed)])
    named = effects_by_name(found)
    assert set(named) == {"discovered_law"}
    assert [(curve.effect, curve.abscissa_label) for curve in found.signatures] == [
        ("discovered_law", "command of x (N)")
    ]
    law = named["discovered_law"].law
    assert (law.acts_on, law.variables) == ("command", ("fx",))
    width, power = parse_law(law.expression, "command", "x").numbers[1:]
    assert width == pytest.approx(0.1, abs=0.03)
    assert power == pytest.approx(0.4, abs=0.1)


@pytest.mark.slow
def test_a_drive_in_order_has_no_curve():
    assert "discovered_law" not in effects_by_name(diagnose_values([record_driven_mass(lambda u: u, 1)]))
