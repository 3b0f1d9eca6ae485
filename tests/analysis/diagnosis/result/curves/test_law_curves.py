"""Curves of discovered laws: what is missing against the variable that carries the law."""

import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import NO_EFFECTS
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.tuning import make_tuning
from analysis.diagnosis.result.curves.law_curves import compute_law_signature
from analysis.diagnosis.result.curves.signature_bins import compute_correlation_ratio
from analysis.figures.diagnosis.signature import draw_signature
from equalizer.effects.discovered_law import Channels, get_law_values, make_law_effect
from equalizer.effects.effect import PlacedEffect
from equalizer.laws.law import parse_law
from equalizer.signals.unit_system import LINEAR


@pytest.fixture
def make_curve(diagnosed):
    def of(text, acts_on="force", axis="x", there=True, axes=("x",)):
        law = parse_law(text, acts_on, axis)
        placed = PlacedEffect(make_law_effect(law, Channels(("fx",), ("ax",))), (0,), get_law_values(law))
        recording, model = diagnosed.recorded(1, (placed,) if there else ()), diagnosed.device(1)
        noise = np.array(diagnosed.NOISE)
        measure = FreeSimulation((observe_parts([recording], 1)[0],), noise, noise)
        tuning = make_tuning(model, recording.command.channels)
        without = evaluate_fit(measure, tuning, np.zeros(len(tuning.names)), NO_EFFECTS)
        return compute_law_signature(gather_evidence(measure, tuning, without)[0], placed, axes, LINEAR)

    return of


def relative_distance(of) -> float:
    order = np.argsort(of.law_abscissa)
    law = np.interp(of.measured_abscissa, of.law_abscissa[order], of.law[order])
    return float(np.sqrt(np.mean((of.measured - law) ** 2) / np.mean(law**2)))


@pytest.mark.parametrize(
    ("text", "along"),
    [
        ("-4.0*abs(vx)**1.5*sign(vx)", "velocity of x (m/s)"),
        ("-2e7*x**3", "position of x (m)"),
        ("-0.3*tanh(0.8*fx)", "command of x (N)"),
    ],
)
def test_a_law_of_one_variable_is_drawn_along_it_and_a_quarter_beyond_what_was_visited(make_curve, text, along):
    found = make_curve(text)
    assert (found.abscissa_label, found.ordinate_label, found.axis) == (along, "missing force (N)", "x")
    assert relative_distance(found) < 0.2
    low, high = found.visited_range
    assert low <= found.measured_abscissa.min() and found.measured_abscissa.max() <= high
    assert found.law_abscissa.min() == pytest.approx(low - 0.25 * (high - low))
    assert found.law_abscissa.max() == pytest.approx(high + 0.25 * (high - low))
    shaded = [patch for patch in draw_signature(found).axes[0].patches if patch.get_alpha() == 0.15]
    assert len(shaded) == 2


def test_a_product_of_two_variables_is_drawn_along_its_own_value(make_curve):
    found = make_curve("-4e5*x**2*vx")
    assert (found.abscissa_label, found.visited_range) == ("force of the law (N)", None)
    assert np.polyfit(found.measured_abscissa, found.measured, 1)[0] == pytest.approx(1.0, abs=0.15)


def test_a_law_with_memory_is_not_drawn_beyond_what_was_visited(make_curve):
    found = make_curve("-40.0*lag(vx, 0.001)")
    assert (found.abscissa_label, found.visited_range) == ("velocity of x (m/s)", None)


def test_a_law_that_is_not_there_lies_far_from_the_dots(make_curve):
    assert relative_distance(make_curve("-4.0*abs(vx)**1.5*sign(vx)", there=False)) > 0.9


def test_an_axis_with_a_name_of_its_own_is_called_by_it(make_curve):
    assert make_curve("-2e7*x**3", axes=("motor",)).abscissa_label == "position of motor (m)"


def test_a_law_of_the_command_is_drawn_by_what_it_changes(make_curve):
    found = make_curve("fx - 0.3*tanh(0.8*fx)", acts_on="command")
    assert (found.abscissa_label, found.ordinate_label) == ("command of x (N)", "missing force (N)")
    assert relative_distance(found) < 0.2
    assert np.allclose(found.law, -0.3 * np.tanh(0.8 * found.law_abscissa))


def test_a_law_of_a_response_has_no_curve_of_forces(make_curve):
    assert make_curve("1.1*ax", acts_on="response", axis="ax") is None


def test_the_correlation_ratio_is_the_share_of_variance_that_bin_means_take():
    rng = np.random.default_rng(5)
    x, other = rng.standard_normal((2, 40_000))
    assert compute_correlation_ratio(x, x**3) == pytest.approx(1.0, abs=0.05)
    assert compute_correlation_ratio(x, other) == pytest.approx(0.0, abs=0.01)
    assert compute_correlation_ratio(x, x + other) == pytest.approx(0.5, abs=0.03)


def test_a_pole_beyond_what_was_visited_does_not_flatten_the_curve(make_curve):
    found = make_curve("1e-6/(0.012 - x)**2")
    low, high = draw_signature(found).axes[0].get_ylim()
    assert high - low < 3 * np.ptp(found.measured) + 3 * np.ptp(found.law[found.law_abscissa <= found.visited_range[1]])
