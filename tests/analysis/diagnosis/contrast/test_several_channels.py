"""Two drives of one body, and a logger of two channels: which of them came to differ, and that it is named once."""

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.contrast.choose_fault import choose_fault
from analysis.diagnosis.contrast.rank_faults import rank_faults
from analysis.diagnosis.result.contrast_findings import _name_fault
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, Signal
from equalizer.signals.unit_system import LINEAR

RATE_HZ = 500.0


def record_two_drives(seed: int, gain: float = 1.0) -> Recording:
    """Two drives push one body; the second gives `gain` of what it is commanded."""
    random, count, dt = np.random.default_rng(seed), 3000, 1 / RATE_HZ / 4
    drives = lfilter([0.05], [1.0, -0.95], random.standard_normal((count, 2)), axis=0)
    position, q, v = np.zeros(count), 0.0, 0.0
    for k, push in enumerate(drives @ [1.0, 0.7 * gain]):
        position[k] = q
        for _ in range(4):
            v += dt * (push - 2 * v - 100 * q) / 0.3
            q += dt * v
    position += 1e-4 * position.std() * random.standard_normal(count)
    return Recording(
        "rig",
        Signal(drives, RATE_HZ, "force", "N", ("fx", "fy")),
        Signal(position[:, None], RATE_HZ, "position", "m", ("x",)),
    )


@pytest.mark.slow
@pytest.mark.parametrize("gain", [0.6, pytest.param(1.4, marks=pytest.mark.slow)])
def test_the_gain_of_one_of_two_drives_of_one_body_is_told_the_right_way_round(rig, gain):
    faulty = record_two_drives(3, gain)
    found = rank_faults([faulty], [record_two_drives(4)], frozenset(), rig.time_left)
    assert found is not None and not found.by_force
    answer = choose_fault(found, 1)
    assert answer.named is not None
    named = _name_fault(answer.named, answer, faulty, LINEAR)
    assert (named.effect, named.axis) == ("force_gain", "y")
    assert named.parameters["gain"].value == pytest.approx(gain, rel=0.05)


@pytest.mark.slow
def test_two_drives_of_one_body_in_order_name_nothing(rig):
    found = rank_faults([record_two_drives(5)], [record_two_drives(4)], frozenset(), rig.time_left)
    assert found is not None
    assert choose_fault(found, 1).named is None


def record_late_masses(seed: int, late: FloatArray) -> Recording:
    """Two masses on springs, read late: by how many samples, per sixth of the recording."""
    random = np.random.default_rng(seed)
    push = lfilter([0.1], [1.0, -0.9], random.standard_normal((3000, 2)), axis=0)
    moved = np.column_stack([lfilter([0.0, 0.02], [1.0, -1.9, 0.92 + 0.01 * k], push[:, k]) for k in range(2)])
    moved += 0.002 * moved.std() * random.standard_normal(moved.shape)
    at = np.arange(3000.0) - np.repeat(late, 500)
    read = np.column_stack([np.interp(at, np.arange(3000.0), each) for each in moved.T])
    return Recording(
        "rig",
        Signal(push, RATE_HZ, "force", "N", ("fx", "fy")),
        Signal(read, RATE_HZ, "displacement", "m", ("x", "y")),
    )


@pytest.mark.slow
def test_a_logger_that_reads_all_channels_late_is_named_once(rig):
    found = rank_faults(
        [record_late_masses(2, np.full(6, 2.0))], [record_late_masses(1, np.zeros(6))], frozenset(), rig.time_left
    )
    assert found is not None
    answer = choose_fault(found, 2)
    assert answer.named is not None
    assert (answer.named.fault.effect, answer.named.fault.axis) == ("logger_offset", "")
    assert answer.named.values["offset"] == pytest.approx(2 / RATE_HZ, rel=0.25)


@pytest.mark.slow
def test_a_logger_that_is_late_now_and_then_in_both_sets_is_not_named(rig):
    faulty, clean = (
        record_late_masses(2, np.array([0, 2, 1, 2, 0, 2.0])),
        record_late_masses(1, np.array([0, 0, 2, 0, 1, 0.0])),
    )
    found = rank_faults([faulty], [clean], frozenset(), rig.time_left)
    assert found is not None
    assert choose_fault(found, 2).named is None
