"""The search as a whole, over a few effects of a small simulated device: what must not change its answer, and what
must. On two axes, friction at the first one."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.limits import ADDED_GAIN, INTERVAL_SHARE
from analysis.diagnosis.search import explain
from analysis.diagnosis.search.explain import _find_effect_pair
from analysis.diagnosis.search.parsimony import is_worthwhile
from analysis.diagnosis.search.verdict import ONLY_REFINES
from equalizer.effects.catalogue import CATALOGUE, EFFECTS
from equalizer.effects.effect import PlacedEffect
from equalizer.signals.signal import Signal

AMONG = ("coulomb_friction", "hardening_stiffness", "force_gain", "constant_force")


def diagnose_recording(recording, model, among=AMONG):
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in among)
    return diagnose([recording], model, DiagnosisSettings(without=others), map, lambda what, share: None)


def named_effects(friction_findings):
    return [(effect.effect, effect.axis) for effect in friction_findings.diagnosis.effects]


def friction_level(friction_findings):
    return friction_findings.diagnosis.effects[0].parameters["level"].value


@pytest.fixture(scope="module")
def friction_recording(diagnosed):
    """One axis, rubbing."""
    return diagnosed.recorded(1)


@pytest.fixture(scope="module")
def friction_findings(friction_recording, diagnosed):
    return diagnose_recording(friction_recording, diagnosed.device(1))


@pytest.mark.slow
def test_friction_is_found_to_its_interval_and_the_noise(friction_findings, diagnosed):
    assert friction_findings.diagnosis.verdict == "explained"
    assert named_effects(friction_findings) == [("coulomb_friction", "x")]
    assert friction_level(friction_findings) == pytest.approx(diagnosed.FRICTION_N, rel=5e-3)
    test = friction_findings.diagnosis.fit.test
    assert test.after == pytest.approx(test.noise, rel=0.08)


def test_an_interval_holds_the_truth_and_claims_no_more_than_a_law_is_exact_to(friction_findings, diagnosed):
    estimate = friction_findings.diagnosis.effects[0].parameters["level"]
    low, high = estimate.ci95
    assert low < diagnosed.FRICTION_N < high
    assert 2 * INTERVAL_SHARE * estimate.value <= high - low < 0.1 * estimate.value


@pytest.mark.slow
def test_the_same_recording_gives_the_same_answer(friction_findings, friction_recording, diagnosed):
    again = diagnose_recording(friction_recording, diagnosed.device(1))
    assert again.diagnosis == friction_findings.diagnosis


@pytest.mark.slow
def test_another_seed_gives_the_same_name(diagnosed):
    other = diagnose_recording(diagnosed.recorded(1, seed=9), diagnosed.device(1))
    assert named_effects(other) == [("coulomb_friction", "x")]
    assert friction_level(other) == pytest.approx(diagnosed.FRICTION_N, rel=5e-3)


def test_a_device_without_anything_missing_has_no_mismatch(diagnosed):
    found = diagnose_recording(diagnosed.recorded(1, ()), diagnosed.device(1))
    assert found.diagnosis.verdict == "no_mismatch"
    assert found.diagnosis.effects == ()


def test_no_strength_is_no_name(diagnosed):
    nothing = (PlacedEffect(EFFECTS["coulomb_friction"], (0,), {"level": 0.0}),)
    assert named_effects(diagnose_recording(diagnosed.recorded(1, nothing), diagnosed.device(1))) == []


@pytest.mark.slow
def test_an_effect_that_is_not_asked_for_changes_nothing(friction_findings, friction_recording, diagnosed):
    more = diagnose_recording(friction_recording, diagnosed.device(1), (*AMONG, "sensor_drift"))
    assert named_effects(more) == named_effects(friction_findings)
    assert friction_level(more) == pytest.approx(friction_level(friction_findings), rel=1e-3)


@pytest.mark.slow
def test_without_the_true_name_no_other_explains(friction_recording, diagnosed):
    other = diagnose_recording(friction_recording, diagnosed.device(1), AMONG[1:])
    assert other.diagnosis.verdict in ("unexplained", "partly_explained")


@pytest.mark.slow
def test_a_mirrored_axis_rubs_alike(friction_recording, diagnosed, friction_findings):
    mirrored = replace(
        friction_recording,
        command=scale_signal(friction_recording.command, -1.0),
        response=scale_signal(friction_recording.response, -1.0),
        position=scale_signal(friction_recording.position, -1.0),
    )
    other = diagnose_recording(mirrored, diagnosed.device(1))
    assert named_effects(other) == named_effects(friction_findings)
    assert friction_level(other) == pytest.approx(friction_level(friction_findings), rel=1e-4)


@pytest.mark.slow
def test_a_constant_force_is_mirrored_with_its_axis(diagnosed):
    pull = (PlacedEffect(EFFECTS["constant_force"], (0,), {"force": 0.3}),)
    pulled = diagnosed.recorded(1, pull)
    mirrored = replace(
        pulled,
        command=scale_signal(pulled.command, -1.0),
        response=scale_signal(pulled.response, -1.0),
        position=scale_signal(pulled.position, -1.0),
    )
    forces = []
    for each in (pulled, mirrored):
        other = diagnose_recording(each, diagnosed.device(1))
        assert named_effects(other) == [("constant_force", "x")]
        forces.append(other.named[0].values["force"])
    assert forces == pytest.approx([0.3, -0.3], rel=0.01)


def scale_signal(signal: Signal, factor: float) -> Signal:
    return replace(signal, samples=factor * signal.samples)


@pytest.mark.slow
def test_where_axes_change_places_the_answer_does(diagnosed):
    among = ("coulomb_friction", "hardening_stiffness")
    two = diagnosed.recorded(2)
    swapped = replace(two, **{name: swap_axes(getattr(two, name)) for name in ("command", "response", "position")})
    one, other = (diagnose_recording(each, diagnosed.device(2), among) for each in (two, swapped))
    assert named_effects(one) == [("coulomb_friction", "x")]
    assert named_effects(other) == [("coulomb_friction", "y")]
    assert friction_level(other) == pytest.approx(friction_level(one), rel=1e-3)


def swap_axes(signal: Signal) -> Signal:
    return replace(signal, samples=np.ascontiguousarray(signal.samples[:, ::-1]))


@pytest.mark.slow
def test_commands_in_another_order_explain_nothing(friction_recording, diagnosed):
    shuffled = np.random.default_rng(1).permutation(friction_recording.command.samples)
    lost = replace(friction_recording, command=replace(friction_recording.command, samples=shuffled))
    other = diagnose_recording(lost, diagnosed.device(1))
    assert other.diagnosis.verdict == "unexplained"
    assert named_effects(other) == []


@pytest.mark.slow
def test_a_refined_law_is_not_named_for_the_plain_one_that_was_to_be_left_out(friction_recording, diagnosed):
    found = diagnose_recording(friction_recording, diagnosed.device(1), ("asymmetric_friction", "hardening_stiffness"))
    assert (found.diagnosis.verdict, named_effects(found)) == ("unexplained", [])
    assert ONLY_REFINES in found.remarks


@pytest.mark.slow
def test_a_refined_law_is_named_where_its_refinement_shows(diagnosed):
    uneven = PlacedEffect(EFFECTS["asymmetric_friction"], (0,), {"level_positive": 0.3, "level_negative": 0.1})
    found = diagnose_recording(diagnosed.recorded(1, (uneven,)), diagnosed.device(1), ("asymmetric_friction",))
    assert named_effects(found) == [("asymmetric_friction", "x")]


@pytest.mark.parametrize(("left", "worth"), [(1.13, False), (1.02, True)])
def test_an_effect_that_leaves_the_one_bad_channel_as_bad_is_not_added(make_candidate, left, worth):
    """Three channels whose noise was taken for larger than it is make up for the worst one."""
    base = make_candidate([1.16, 0.9, 0.9, 0.95])
    better = make_candidate([left, 0.9, 0.9, 0.94], "quadratic_damping")
    assert base.score.mean_log_error - better.score.mean_log_error > ADDED_GAIN
    assert is_worthwhile(base, better) is worth


@pytest.mark.parametrize(("left", "added"), [(3.0, True), (38.0, False)])
def test_two_effects_that_hide_each_other_are_added_together(make_candidate, monkeypatch, left, added):
    """Alone each leaves 42 of 50 times the noise, less than a share worth adding."""
    base, first = make_candidate([50.0]), make_candidate([42.0], "cogging")
    again, other = make_candidate([42.5], "cogging"), make_candidate([43.0], "quadratic_damping")
    both = make_candidate([left], "cogging", "force_deadband")
    tried = []

    def find_next(context, catalogue, held, step):
        tried.append(held.hypothesis.claims[-1].effect.name)
        return (both,) if tried[-1] == "cogging" else (make_candidate([41.0], "quadratic_damping", "cogging"),)

    monkeypatch.setattr(explain, "find_next_effect", find_next)
    context = SimpleNamespace(excluded=frozenset())
    rounds = _find_effect_pair(context, (), base, (first, again, other), None)
    assert rounds == (((first, again, other), (both,)) if added else ())
    assert tried == (["cogging"] if added else ["cogging", "quadratic_damping"])
    assert not _find_effect_pair(context, (), base, (make_candidate([5.0], "cogging"),), None)
    near = make_candidate([1.9])
    assert not _find_effect_pair(context, (), near, (make_candidate([1.8], "cogging"),), None)
    assert not _find_effect_pair(SimpleNamespace(excluded={"force_deadband"}), (), base, (first,), None)
