"""Intervals hold the truth as often as they say, where errors are neither white nor of the assumed strength.

On an invented measure whose prediction is a straight line in all parameters.
"""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.data.observed import Observed
from analysis.diagnosis.errors.hypothesis import Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import build_jacobian, evaluate_fit, fit
from analysis.diagnosis.errors.standard_errors import (
    compute_full_sensitivity,
    compute_segment_errors,
    compute_standard_errors,
    finish_fit,
)
from analysis.diagnosis.errors.tuning import Tuning
from equalizer.effects.catalogue import EFFECTS
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from tests.slow_instances import slow_rows

RATE_HZ, SAMPLES, DRAWS = 200.0, 4000, 120
FORCE_N, STIFFER = 0.3, 0.8
"""The truth: of the effect, and of the model in standard deviations."""


@dataclass(frozen=True)
class StraightLine:
    """Channel 0 answers to the effect's number and to the model's, each along a row of its own."""

    records: tuple[Observed, ...]
    response_rows: np.ndarray
    noise: np.ndarray
    unit: np.ndarray
    name: str = "straight line"

    def residuals(self, model, effects):
        force = effects[0].values["force"]
        predicted = self.response_rows[0] * force + self.response_rows[1] * (model.stiffness[0, 0] - 100.0)
        return (self.records[0].measured - predicted[:, None],)


ONE = [[1.0]]
MODEL = MechanicalModel("line", "position", ONE, ONE, [[100.0]], ONE, ONE)
TUNING = Tuning(
    MODEL, ("stiffness x",), np.ones(1), ("N/m",), lambda at: replace(MODEL, stiffness=np.array([[100.0 + at[0]]]))
)
PUSHED = make_claim_hypothesis(Claim(EFFECTS["constant_force"], "one", (0,)), [{"force": 0.1}])


def response_rows(seed):
    """Slow, like what a mechanism answers."""
    random = np.random.default_rng([seed, 1])
    return lfilter([1.0], [1.0, -0.95], random.standard_normal((2, SAMPLES)), axis=1)


def make_measure(seed, colour, strength):
    """What the line answers with the truth, and coloured errors on it."""
    white = np.random.default_rng([seed, 2]).standard_normal(SAMPLES)
    errors = strength * lfilter([np.sqrt(1 - colour**2)], [1.0, -colour], white)
    n = np.ones(SAMPLES, dtype=bool)
    known = response_rows(seed)
    # The calibration is one draw, too, from what it says of itself.
    own = np.random.default_rng([seed, 3]).standard_normal()
    samples = (known[0] * FORCE_N + known[1] * own + errors)[:, None]
    signal = Signal(samples, RATE_HZ, "position", "m", ("x",))
    recording = Recording("line", Signal(np.zeros_like(samples), RATE_HZ, "force", "N", ("fx",)), signal)
    record = Observed(recording, np.zeros_like(samples), samples, n, ~n, ~n)
    return StraightLine((record,), known, np.ones(1), np.ones(1)), own


def all_sensitivities(measure, found):
    return compute_full_sensitivity(measure, TUNING, found.deviations, found.hypothesis)


def fitted_and_errors(seed, colour, strength):
    measure, own = make_measure(seed, colour, strength)
    start = evaluate_fit(measure, TUNING, np.zeros(1), PUSHED)
    known = build_jacobian(measure, TUNING, np.zeros(1), PUSHED)
    found = fit(measure, TUNING, start, known, 4)
    return found, compute_standard_errors(measure, found, all_sensitivities(measure, found)), own


@pytest.mark.parametrize(("colour", "strength"), [(0.9, 6.0), *slow_rows((0.0, 1.0), (0.9, 1.0))])
def test_ninety_five_of_a_hundred_intervals_hold_the_truth(colour, strength):
    held = 0
    for seed in range(DRAWS):
        found, errors, _ = fitted_and_errors(seed, colour, strength)
        of, at = found.hypothesis.parameters[0], found.hypothesis.point[0]
        held += of.to_value(at - 1.96 * errors[1]) <= FORCE_N <= of.to_value(at + 1.96 * errors[1])
    assert 0.88 <= held / DRAWS <= 0.99


def test_intervals_grow_with_the_errors_and_with_their_memory():
    width = {case: fitted_and_errors(3, *case)[1][1] for case in [(0.0, 1.0), (0.9, 1.0), (0.0, 4.0)]}
    assert width[0.9, 1.0] > 1.5 * width[0.0, 1.0]
    assert width[0.0, 4.0] == pytest.approx(4 * width[0.0, 1.0], rel=0.05)


def test_what_the_data_say_of_the_model_outweighs_its_calibration():
    found, errors, own = fitted_and_errors(3, 0.0, 1.0)
    assert found.deviations[0] == pytest.approx(own, abs=4 * errors[0])
    assert errors[0] < 0.1


def test_the_same_record_gives_the_same_interval():
    assert np.array_equal(fitted_and_errors(5, 0.9, 1.0)[1], fitted_and_errors(5, 0.9, 1.0)[1])


SEGMENTS, VARIES = 8, 0.15


def measure_of_segments(seed, varies, count=SEGMENTS):
    """White errors, and a force that varies from segment to segment by a share, as that of an inexact law does."""
    measure, _ = make_measure(seed, 0.0, 1.0)
    (record,), length = measure.records, SAMPLES // count
    random = np.random.default_rng([seed, 4])
    share = np.repeat(varies * random.standard_normal(count), length)
    samples = record.measured + (FORCE_N * measure.response_rows[0, : len(share)] * share)[:, None]
    segments = tuple(Segment(k * length, (k + 1) * length, "multisine", 1.0, 0) for k in range(count))
    record = replace(record, measured=samples, recording=replace(record.recording, segments=segments))
    varied = replace(measure, records=(record,))
    known = build_jacobian(varied, TUNING, np.zeros(1), PUSHED)
    found = fit(varied, TUNING, evaluate_fit(varied, TUNING, np.zeros(1), PUSHED), known, 4)
    noise, between = (
        errors(varied, found, all_sensitivities(varied, found))
        for errors in (compute_standard_errors, compute_segment_errors)
    )
    of, at = found.hypothesis.parameters[0], found.hypothesis.point[0]
    return [
        of.to_value(at - 1.96 * error) <= FORCE_N <= of.to_value(at + 1.96 * error)
        for error in (noise[1], np.hypot(noise[1], between[1]))
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("varies", "noise_holds"), [(VARIES, (0.0, 0.75)), (0.0, (0.88, 1.0))])
def test_segments_show_what_varies_between_them(varies, noise_holds):
    held = np.mean([measure_of_segments(seed, varies) for seed in range(DRAWS)], axis=0)
    assert noise_holds[0] <= held[0] <= noise_holds[1]
    assert held[1] >= 0.88


def test_the_jackknife_is_that_of_fits_without_each_segment():
    """The model is a straight line, so that one step is exact: each fit is repeated without a segment."""
    measure, _ = make_measure(3, 0.0, 1.0)
    (record,), length = measure.records, SAMPLES // SEGMENTS
    segments = tuple(Segment(k * length, (k + 1) * length, "multisine", 1.0, 0) for k in range(SEGMENTS))
    record = replace(record, recording=replace(record.recording, segments=segments))
    measure = replace(measure, records=(record,))
    known = build_jacobian(measure, TUNING, np.zeros(1), PUSHED)
    whole = fit(measure, TUNING, evaluate_fit(measure, TUNING, np.zeros(1), PUSHED), known, 8)
    forces = []
    for segment in segments:
        kept = record.fit.copy()
        kept[segment.start : segment.stop] = False
        fewer = replace(measure, records=(replace(record, fit=kept),))
        there = build_jacobian(fewer, TUNING, np.zeros(1), PUSHED)
        start = evaluate_fit(fewer, TUNING, whole.deviations, whole.hypothesis)
        forces.append(fit(fewer, TUNING, start, there, 8).hypothesis.point[0])
    expected = np.sqrt((SEGMENTS - 1) / SEGMENTS * np.sum((np.array(forces) - np.mean(forces)) ** 2))
    assert compute_segment_errors(measure, whole, all_sensitivities(measure, whole))[1] == pytest.approx(
        expected, rel=0.02
    )


def test_one_segment_has_no_jackknife():
    measure, _ = make_measure(3, 0.0, 1.0)
    known = build_jacobian(measure, TUNING, np.zeros(1), PUSHED)
    found = fit(measure, TUNING, evaluate_fit(measure, TUNING, np.zeros(1), PUSHED), known, 4)
    assert compute_segment_errors(measure, found, all_sensitivities(measure, found)) is None


PERIOD = 500
"""Samples; eight of them are played."""


def measure_of_periods(seed, period=PERIOD, lacking=1.0):
    """White errors and, in each period again, what the model cannot reproduce."""
    measure, _ = make_measure(seed, 0.0, 1.0)
    (record,) = measure.records
    row = np.tile(
        lfilter([1.0], [1.0, -0.95], np.random.default_rng([seed, 5]).standard_normal(period)), SAMPLES // period
    )
    again = lfilter([1.0], [1.0, -0.9], np.random.default_rng([seed, 6]).standard_normal(period))
    lacks = lacking * np.tile(again, SAMPLES // period)
    rows_of = np.stack([row, measure.response_rows[1]])
    samples = record.measured + ((rows_of[0] - measure.response_rows[0]) * FORCE_N + lacks)[:, None]
    segments = (Segment(0, SAMPLES, "multisine", 1.0, period),)
    recording = replace(
        record.recording, segments=segments, response=replace(record.recording.response, samples=samples)
    )
    repeated = replace(
        measure, records=(replace(record, measured=samples, recording=recording),), response_rows=rows_of
    )
    known = build_jacobian(repeated, TUNING, np.zeros(1), PUSHED)
    found = fit(repeated, TUNING, evaluate_fit(repeated, TUNING, np.zeros(1), PUSHED), known, 4)
    error = compute_standard_errors(repeated, found, all_sensitivities(repeated, found))[1]
    of, at = found.hypothesis.parameters[0], found.hypothesis.point[0]
    return of.to_value(at - 1.96 * error) <= FORCE_N <= of.to_value(at + 1.96 * error)


@pytest.mark.slow
def test_what_repeats_with_the_drive_is_not_counted_as_often_as_it_repeats():
    """Each period alone would give half the errors' width again; few clusters hold a little less than they say."""
    assert 0.8 <= np.mean([measure_of_periods(seed) for seed in range(DRAWS)]) <= 0.99


@pytest.mark.slow
@pytest.mark.parametrize("period", [100, 200, 500])
def test_periods_of_few_stretches_do_not_make_the_intervals_narrow(period):
    """Scores sum to zero at the minimum: one or two clusters would tell next to nothing of the noise."""
    assert np.mean([measure_of_periods(seed, period, 0.0) for seed in range(DRAWS)]) >= 0.88


@dataclass(frozen=True)
class Jumping(StraightLine):
    """Channel 0 answers to the jump of a dead band alone, which cannot be below zero."""

    def residuals(self, model, effects):
        return (self.records[0].measured - (self.response_rows[0] * effects[0].values["jump"])[:, None],)


def test_a_number_at_its_bound_has_no_error_there_and_leaves_it_where_the_data_ask_for_it():
    measure, _ = make_measure(3, 0.0, 1.0)
    (record,) = measure.records
    samples = (measure.response_rows[0] * FORCE_N)[:, None] + np.random.default_rng(8).standard_normal((SAMPLES, 1))
    jumping = Jumping((replace(record, measured=samples),), *measure_parts(measure))
    plain = make_claim_hypothesis(Claim(EFFECTS["force_deadband"], "one", (0,)), [{"width": 0.1, "jump": 0.0}])
    begun = evaluate_fit(jumping, TUNING, np.zeros(1), plain)
    # Nothing depends on the width, so that the data do not determine it.
    assert compute_standard_errors(jumping, begun, all_sensitivities(jumping, begun))[1:].tolist() == [np.inf, 0.0]
    found, known = finish_fit(jumping, TUNING, begun, lambda at: all_sensitivities(jumping, at), lambda: True)
    jump, error = (
        found.hypothesis.list_placed_effects()[0].values["jump"],
        compute_standard_errors(jumping, found, known)[-1],
    )
    assert error > 0.0
    assert jump == pytest.approx(FORCE_N, abs=0.03)


@dataclass(frozen=True)
class TwoMasses(StraightLine):
    """A lightly damped resonance whose mass is the model's own and the effect's together; the data give their sum."""

    quality: float = 20.0

    def residuals(self, model, effects):
        mass = 1.0 + effects[0].values["mass"] + 0.1 * (model.stiffness[0, 0] - 100.0)
        frequency = np.fft.rfftfreq(SAMPLES, 1 / RATE_HZ) / 20.0
        answer = 1.0 / (1.0 - mass * frequency**2 + 1j * frequency / self.quality)
        played = np.fft.irfft(np.fft.rfft(self.response_rows[0]) * answer, SAMPLES)
        return (self.records[0].measured - 10.0 * played[:, None],)


@pytest.mark.parametrize("quality", [1.4, 10.0, 20.0])
def test_two_numbers_that_act_alike_are_parted_by_the_calibration_alone(quality):
    """Begun far off along the valley, where the sum is right and the model's number off by three standard deviations.
    Longer steps would count the resonance's curvature as information: a sixth of the error at the sharpest."""
    measure, _ = make_measure(3, 0.0, 1.0)
    (record,) = measure.records
    silent = TwoMasses((replace(record, measured=np.zeros((SAMPLES, 1))),), *measure_parts(measure), quality=quality)
    added = make_claim_hypothesis(Claim(EFFECTS["added_mass"], "one", (0,)), [{"mass": 0.4}])
    (played,) = silent.residuals(MODEL, added.list_placed_effects())
    samples = np.random.default_rng(7).standard_normal((SAMPLES, 1)) - played
    alike = replace(silent, records=(replace(record, measured=samples),))
    far = replace(added, point=np.array([added.parameters[0].to_coordinate(0.1)]))
    begun = evaluate_fit(alike, TUNING, np.array([3.0]), far)

    def at(fitted):
        return compute_full_sensitivity(alike, TUNING, fitted.deviations, fitted.hypothesis)

    found, known = finish_fit(alike, TUNING, begun, at, lambda: True)
    assert (begun.cost - found.cost) * SAMPLES > 8
    assert found.deviations[0] == pytest.approx(0.0, abs=0.15)
    own, error = compute_standard_errors(alike, found, known)
    mass = found.hypothesis.list_placed_effects()[0].values["mass"]
    assert mass == pytest.approx(0.4, rel=0.06)
    assert (own, mass * error) == (pytest.approx(1.0, rel=0.1), pytest.approx(0.1, rel=0.1))
    assert finish_fit(alike, TUNING, found, at, lambda: True)[0].cost > found.cost - 0.1 / SAMPLES


def measure_parts(measure):
    return measure.response_rows, measure.noise, measure.unit
