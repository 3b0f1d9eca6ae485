"""Whether what was held out differs in kind from what a law was fitted to, by the split that recordings get."""

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.discovery.validation import _compute_held_out_error_share, describe_held_out_kinds
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal

SAMPLES = 1000


def describe_held_out(*segments: tuple[str, float, tuple[int, ...], str]) -> tuple[str, ...]:
    """Of a recording of equal segments: (kind, peak, driven axes, role)."""
    random = np.random.default_rng(1)
    command = np.zeros((SAMPLES * len(segments), 2))
    told = []
    for number, (kind, peak, axes, role) in enumerate(segments):
        start = number * SAMPLES
        command[start : start + SAMPLES, axes] = peak * random.uniform(-1, 1, (SAMPLES, len(axes)))
        told.append(Segment(start, start + SAMPLES, kind, peak, 0, role))
    force = Signal(command, 1000.0, "force", "N", ("fx", "fy"))
    position = Signal(np.cumsum(command, axis=0), 1000.0, "position", "m", ("x", "y"))
    return describe_held_out_kinds([observe_parts([Recording("rig", force, position, segments=tuple(told))], 2)[0]])


def test_ends_of_the_same_segments_are_no_other_kind():
    assert describe_held_out(("multisine", 1.0, (0,), ""), ("multisine", 2.0, (0,), "")) == ()
    assert describe_held_out(("multisine", 1.0, (0,), "")) == ()


def test_rest_tells_nothing():
    assert describe_held_out(("rest", 0.0, (), ""), ("multisine", 1.0, (0,), ""), ("multisine", 2.0, (0,), "")) == ()


def test_louder_joint_and_other_commands_are_reported():
    fitted = ("multisine", 1.0, (0,), "fit"), ("multisine", 1.0, (1,), "fit")
    assert describe_held_out(*fitted, ("multisine", 3.0, (0,), "test")) == ("stronger commands",)
    assert "axes driven together" in describe_held_out(*fitted, ("multisine", 0.9, (0, 1), "test"))
    assert "another kind of command" in describe_held_out(*fitted, ("sweep", 0.9, (0,), "test"))


def test_without_anything_to_fit_nothing_is_reported():
    assert describe_held_out(("sweep", 1.0, (0,), "test")) == ()


def test_the_error_of_a_law_is_said_as_in_the_verdict():
    """As a share of the signal over all channels, of which one is predicted down to its noise without the law."""
    random = np.random.default_rng(3)
    position, retuned = random.normal(size=(SAMPLES, 2)), random.normal(size=(SAMPLES, 2)) * (0.2, 0.001)
    recording = Recording(
        "rig",
        Signal(position, 1000.0, "force", "N", ("fx", "fy")),
        Signal(position, 1000.0, "speed", "m/s", ("x", "y")),
    )
    record = SimpleNamespace(test=np.ones(SAMPLES, dtype=bool), measured=position, recording=recording)
    measure = SimpleNamespace(records=(record,), unit=np.ones(2), noise=np.full(2, 0.001))
    law, model = (
        SimpleNamespace(fitted=SimpleNamespace(residuals=(residuals,)), score=None)
        for residuals in (retuned * (0.01, 1.0), retuned)
    )
    share = _compute_held_out_error_share(SimpleNamespace(full_measure=measure), SimpleNamespace(retuned=model), law)
    assert share == pytest.approx(np.hypot(0.002, 0.001) / 0.2, rel=0.1)
