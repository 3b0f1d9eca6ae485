"""No candidate has parameters beyond what was recorded, and no hum is a harmonic of the tone that drives."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.errors.hypothesis import Claim, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import gather_evidence
from analysis.diagnosis.search.explain import retune_alone
from analysis.diagnosis.search.starting_hypotheses import is_newest_within_data
from equalizer.effects.catalogue import EFFECTS


@pytest.fixture(scope="module")
def evidence(diagnosed, make_context):
    context = make_context(diagnosed.RUBBING)
    return gather_evidence(context.measure, context.tuning, retune_alone(context))[0]


def make_hypothesis(name, **values):
    return make_claim_hypothesis(Claim(EFFECTS[name], "one", (0,)), [values])


def test_a_ripple_repeats_within_the_travel(evidence):
    travel = float(np.ptp(evidence.axis_position[evidence.used > 0]))
    assert is_newest_within_data(make_hypothesis("cogging", amplitude=0.1, pitch=0.5 * travel, phase=0.0), evidence)
    assert not is_newest_within_data(make_hypothesis("cogging", amplitude=0.1, pitch=1.5 * travel, phase=0.0), evidence)


def test_a_limit_lies_within_the_commands(evidence):
    most = float(np.abs(evidence.command[evidence.used > 0]).max())
    assert is_newest_within_data(make_hypothesis("force_saturation", limit=0.9 * most), evidence)
    assert not is_newest_within_data(make_hypothesis("force_saturation", limit=1.1 * most), evidence)


def test_other_numbers_are_let_through(evidence):
    assert is_newest_within_data(make_hypothesis("coulomb_friction", level=1e3), evidence)


@pytest.mark.parametrize(("driven_hz", "hums"), [(7.3, True), (25.0, False), (10.0, False)])
def test_a_hum_is_no_harmonic_of_a_drive_of_one_tone(evidence, driven_hz, hums):
    time_s = np.arange(len(evidence.command)) / evidence.sample_rate_hz
    hum = 30 * evidence.noise * np.sin(2 * np.pi * 50.0 * time_s)[:, None]
    quiet = evidence.noise * np.random.default_rng(1).standard_normal(evidence.response.shape)
    given = replace(
        evidence, command=np.sin(2 * np.pi * driven_hz * time_s)[:, None],
        predicted=np.zeros_like(evidence.response), response=hum + quiet, used=np.ones(len(time_s)),
    )  # fmt: skip
    assert bool(EFFECTS["mains_hum"].starts(given, 0)) is hums
