"""Recordings of the same device, and faults that these data cannot distinguish: no fault is named."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.choose_fault import choose_fault
from analysis.diagnosis.contrast.rank_faults import rank_faults
from equalizer.signals.recording import Recording


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_another_recording_of_the_same_device_names_nothing(rig, seed):
    found = rig.make_contrast(seed=seed).decision
    assert found is not None and found.named is None


@pytest.mark.slow
def test_a_fault_that_may_sit_on_either_of_two_axes_is_not_named(rig):
    found = rig.make_contrast("added_mass", 0.3).comparison
    assert found is not None
    best = choose_fault(found, 1).named
    assert best is not None
    twin = replace(best, fault=replace(best.fault, axis="fy", site=1))
    answer = choose_fault(replace(found, faults=(best, twin)), 1)
    assert answer.named is None
    assert "fy" in answer.unnamed[0][1]


@pytest.mark.slow
def test_an_effect_that_is_not_to_be_considered_is_not_named(rig):
    found = rig.make_contrast("added_mass", 0.3, ("added_mass",)).decision
    assert found is not None
    assert found.named is None or found.named.fault.effect != "added_mass"


@pytest.mark.slow
def test_a_body_alone_cannot_tell_a_mass_from_a_gain(rig):
    """The force is proportional to the acceleration: more mass, less force, and a sensor that reads less are one."""
    random = np.random.default_rng(5)

    def body(seed: int, mass: float) -> Recording:
        _, _, a = rig.make_motion(seed)
        plain = rig.record_rig(seed)
        force = mass * a + 0.02 * a.std() * random.normal(size=rig.COUNT)
        return replace(plain, command=replace(plain.command, samples=force[:, None]))

    found = rank_faults([body(2, 1.6)], [body(1, 1.2)], frozenset(), rig.time_left)
    assert found is not None
    answer = choose_fault(found, 1)
    names = {law.fault.effect for law, _ in answer.unnamed} if answer.named is None else set(answer.equivalents)
    assert {"force_gain", "sensor_gain"} <= names | {"" if answer.named is None else answer.named.fault.effect}


def test_recordings_of_rest_and_of_motion_are_not_compared(rig):
    """What a device does at rest is foretold by no recording of its motion."""
    resting = rig.change_reading(2, lambda y: 0.01 * y)
    assert rank_faults([resting], [rig.record_rig(1)], frozenset(), rig.time_left) is None
    assert rank_faults([rig.record_rig(1)], [resting], frozenset(), rig.time_left) is None


def test_what_is_cut_short_ends_with_what_it_has(rig):
    found = rank_faults([rig.record_rig(2, "added_mass", 0.3)], [rig.record_rig(1)], frozenset(), lambda: False)
    assert found is not None and not found.complete
    assert choose_fault(found, 1).named is None


def test_a_balance_that_cannot_be_solved_leaves_the_other_base_to_compare_by(rig, monkeypatch):
    def unsolvable(*of: object) -> None:
        raise np.linalg.LinAlgError("singular matrix")

    monkeypatch.setattr("analysis.diagnosis.contrast.bases.build_force_base", unsolvable)
    monkeypatch.setattr("analysis.diagnosis.contrast.bases.choose_decimation_step", lambda parts: 1)
    found = rank_faults([rig.record_rig(2)], [rig.record_rig(1)], frozenset(), lambda: False)
    assert found is not None and not found.by_force
