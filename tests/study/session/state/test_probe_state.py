"""Probes of a session: which are refused, and how their acceleration is weighted."""

import numpy as np
import pytest

from protocols.definition.probes import ProbeSettings
from study.session.facts.sitting_events import ProbePlayed
from study.session.state.presentation_check import LogContradictionError
from study.session.state.probe_state import LARGEST_WEIGHT_HZ, ProbeState, begin_probe
from study.session.state.vibration_dose import compute_hand_arm_weight

UTC = "2026-01-01T00:00:00.000+00:00"
PROBES = ProbeSettings(levels_n=(0.2, 0.4))


def test_no_frequency_has_a_larger_weight_than_the_one_by_which_probes_count():
    largest = max(compute_hand_arm_weight(f) for f in np.geomspace(1.0, 1000.0, 5000))
    assert compute_hand_arm_weight(LARGEST_WEIGHT_HZ) == pytest.approx(largest, rel=1e-4)


@pytest.mark.parametrize(
    ("settings", "level_n", "number", "why"),
    [
        (ProbeSettings(), 0.2, 0, "the protocol has no probes"),
        (PROBES, 1.2, 0, "the protocol allows 1 N at most"),
        (PROBES, 0.2, 3, "probe 3, but probe 0 is the next"),
    ],
)
def test_a_probe_that_the_protocol_does_not_allow_is_refused_with_the_reason(settings, level_n, number, why):
    with pytest.raises(LogContradictionError, match=why):
        begin_probe(ProbeState(), ProbePlayed(UTC, number, "hand", level_n), settings)
