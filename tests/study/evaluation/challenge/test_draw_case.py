"""Cases: repeatable, of the same making as the labelled ones, and honest about what they conceal."""

from dataclasses import replace

import numpy as np
import pytest

from equalizer.signals.recording_checks import check_recording
from study.evaluation.challenge.bench import draw_bench
from study.evaluation.challenge.case_settings import CaseSettings
from study.evaluation.challenge.device import Device, simulate_motion
from study.evaluation.challenge.draw_case import NOISE_STD, draw_case
from study.evaluation.challenge.drive_plan import DrivePlan, draw_plan
from study.evaluation.challenge.nominal_models import RETUNED_TOLERANCE, draw_calibration, retune, shift_diagonals
from study.evaluation.challenge.sensor_kernel import filter_first_order


def first_seconds(plan):
    """Of the multisines at 1.5 N alone, one period each."""
    parts = [s for s in plan.segments if s.role == "fit" and s.amplitude == 1.5]
    command = np.vstack([plan.command[s.start : s.start + 2000] for s in parts])
    return DrivePlan(command, tuple(replace(s, start=2000 * k, stop=2000 * (k + 1)) for k, s in enumerate(parts)))


COARSE = CaseSettings(steps=5)
"""Of a device whose motion is not what is tested."""


@pytest.fixture(scope="module")
def friction_case():
    return draw_case(5, ["coulomb_friction"], strength=0.5, settings=COARSE)


@pytest.mark.slow
def test_a_draw_repeats_from_its_seed(friction_case):
    again = draw_case(5, ["coulomb_friction"], strength=0.5, settings=COARSE)
    np.testing.assert_array_equal(again.recording.response.samples, friction_case.recording.response.samples)
    assert again.truth == friction_case.truth
    np.testing.assert_array_equal(again.model.mass, friction_case.model.mass)


def test_a_case_is_a_sound_recording_with_a_linear_model_and_the_truth(friction_case):
    assert check_recording(friction_case.recording) == ()
    assert len(friction_case.recording) == 105_000
    assert friction_case.model.effects == ()
    (truth,) = friction_case.truth
    assert (truth.effect, truth.place) == ("coulomb_friction", "mechanism")
    assert truth.axis in ("x", "y", "z")
    assert truth.values["level"] == pytest.approx(np.sqrt(0.003 * 0.25))


@pytest.mark.slow
def test_nothing_missing_is_an_empty_truth():
    assert draw_case(6).truth == ()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"effects": ["stiction"]}, "there is no way to conceal 'stiction'"),
        ({"effects": ["cogging"], "strength": 1.5}, "strength is 1.5; it must lie between 0 and 1"),
        ({"effects": ["hand_impedance"], "origin": "retuned"}, "from a calibrated model only"),
    ],
)
def test_what_cannot_be_drawn_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        draw_case(1, **change)


def test_a_calibrated_model_is_off_by_its_tolerances_at_the_driven_axes_alone():
    random = np.random.default_rng(2)
    bench = draw_bench(random)
    offsets = []
    for _ in range(200):
        known, tolerance = draw_calibration(bench, random)
        offsets.append(np.diag(known.mass - bench.mass) / tolerance.mass_kg)
        assert np.triu(known.mass - bench.mass, 1).max() == 0.0
    assert np.std(offsets) == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_retuning_finds_the_bench_when_nothing_hides():
    random = np.random.default_rng(4)
    bench, plan = draw_bench(random), first_seconds(draw_plan(random))
    start = shift_diagonals(bench, np.repeat((0.02, 0.5, 15.0), 3))
    each = [simulate_motion(Device(bench), plan.command[s.start : s.stop])[0] for s in plan.segments]
    response = np.vstack([filter_first_order(part, 1.0 - np.exp(-np.pi)) for part in each])
    found, tolerance = retune(start, response, plan)
    assert tolerance == RETUNED_TOLERANCE
    np.testing.assert_allclose(found.mass, bench.mass, atol=2e-4)
    np.testing.assert_allclose(found.stiffness, bench.stiffness, atol=0.3)


@pytest.mark.parametrize(
    "effect",
    ["extra_mode", *(pytest.param(name, marks=pytest.mark.slow) for name in ("viscous_damping", "hand_impedance"))],
)
def test_a_further_recording_is_of_the_device_with_its_concealed_effect(effect):
    case = draw_case(7, (effect,), strength=1.0, settings=CaseSettings(period=500))
    again = case.record_again(case.recording.command.samples, "multisine", 0.0, 1)
    difference = again.response.samples - case.recording.response.samples
    # Two readings with independent noise; without the effect they would differ by some hundred times the noise.
    assert difference.std(axis=0) / NOISE_STD[:3] == pytest.approx(np.full(3, 2**0.5), rel=0.05)
