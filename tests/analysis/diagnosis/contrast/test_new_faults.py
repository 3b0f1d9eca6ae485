"""A fault that is absent from the clean recordings is named, with its place and its number."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.diagnosis.contrast.actuator_faults import make_actuator_faults
from analysis.diagnosis.contrast.choose_fault import choose_fault
from analysis.diagnosis.contrast.fault import Lags
from analysis.diagnosis.contrast.rank_faults import rank_faults
from analysis.diagnosis.contrast.recording_part import split_into_parts
from analysis.diagnosis.limits import CONTRAST_BLOCKS, MISFIT_SHARE
from equalizer.signals.signal import FloatArray


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "level", "number", "place"),
    [
        ("added_mass", 0.3, "mass", "mechanism"),
        ("viscous_damping", 2.0, "damping", "mechanism"),
        ("coulomb_friction", 0.6, "level", "mechanism"),
        ("force_gain", 0.75, "gain", "actuator"),
        ("sensor_gain", 1.3, "gain", "sensor"),
    ],
)
def test_what_came_since_is_named_with_its_place_and_number(rig, change, level, number, place):
    found = rig.make_contrast(change, level).decision
    assert found is not None and found.named is not None
    assert (found.named.fault.effect, found.named.fault.place) == (change, place)
    assert found.named.values[number] == pytest.approx(level, rel=0.15)


@pytest.mark.slow
def test_a_law_that_holds_the_named_one_takes_nothing_from_its_probability(rig):
    found = rig.make_contrast("coulomb_friction", 0.6).decision
    assert found is not None and found.named is not None
    assert found.named.fault.effect == "coulomb_friction"
    assert "asymmetric_friction" not in found.equivalents
    assert found.probability > 0.9


@pytest.mark.slow
def test_the_error_is_that_of_the_faulty_recording_however_many_clean_ones_there_are(rig):
    """Scaled by its own error, what is left of a set is at least as much as a description of its own leaves: also where
    there is no time to undo a fault."""
    for clean in ([rig.record_rig(1)], [rig.record_rig(seed) for seed in (1, 3, 4, 5)]):
        found = rank_faults([rig.record_rig(2, "viscous_damping", 2.0)], clean, frozenset(), lambda: False)
        assert found is not None
        assert found.faulty_sample_count == pytest.approx(found.sample_count / (1 + len(clean)), rel=0.01)
        assert 1.0 <= found.block_squares[:CONTRAST_BLOCKS].sum() / found.faulty_sample_count < 2.0


def read_through_gap(gap: float):
    """A reading that is driven through a gap."""

    def made(y: FloatArray) -> FloatArray:
        found, read = np.empty_like(y), y[0]
        for k, here in enumerate(y):
            read = min(max(read, here - gap / 2), here + gap / 2)
            found[k] = read
        return found

    return made


@pytest.mark.slow
def test_play_before_a_sensor_is_named_with_its_gap(rig):
    found = rig.decide_fault(rig.change_reading(2, read_through_gap(0.008)))
    assert found.named is not None and found.named.fault.effect == "sensor_play"
    assert found.named.values["gap"] == pytest.approx(0.008, rel=0.2)


@pytest.mark.slow
def test_a_drift_that_began_before_the_recording_is_no_offset(rig):
    found = rig.decide_fault(rig.change_reading(2, lambda y: y + 0.04 * np.linspace(0.4, 1.0, len(y))))
    assert found.named is not None and found.named.fault.effect == "sensor_drift"


@pytest.mark.slow
def test_an_offset_is_no_drift(rig):
    found = rig.decide_fault(rig.change_reading(2, lambda y: y + 0.05))
    assert found.named is not None
    names = {found.named.fault.effect, *found.equivalents}
    assert {"sensor_offset", "force_offset"} <= names and not {"sensor_drift", "clock_drift"} & names


def test_a_drive_that_follows_slowly_is_named(rig):
    plain = rig.record_rig(2)
    force, limit = plain.command.samples[:, 0].copy(), 40.0 / rig.RATE_HZ
    held = int(rig.RATE_HZ / 2)
    asked = np.repeat(force[::held], held)
    given = np.empty(rig.COUNT)
    reached = asked[0]
    for k, wanted in enumerate(asked):
        reached += np.clip(wanted - reached, -limit, limit)
        given[k] = reached
    part = split_into_parts([replace(plain, command=replace(plain.command, samples=asked[:, None]))])
    (fault,) = [
        each for each in make_actuator_faults(0, "fx", part, True, Lags(1, (), 0.0, ())) if each.effect == "slew_limit"
    ]
    left = [np.std(variant.undo[0](part[0]).command[:, 0] - given) for variant in fault.variants]
    best = fault.variants[int(np.argmin(left))]
    assert best.parameters_of(np.ones(1))["rate"] == pytest.approx(40.0, rel=0.5)
    assert min(left) < 0.3 * np.std(asked - given)


@pytest.mark.slow
def test_a_fault_that_upsets_the_balance_of_forces_is_undone_in_it(rig):
    """With it, 43 % of that recording's forces are left over: more than a balance may leave that is to be used."""
    plain = rig.record_rig(2)
    asked = plain.command.samples + 8.0 * np.sign(plain.command.samples)
    found = rank_faults(
        [replace(plain, command=replace(plain.command, samples=asked))], [rig.record_rig(1)], frozenset(), rig.time_left
    )
    assert found is not None and found.by_force and found.faulty_share > MISFIT_SHARE
    assert found.faults[0].fault.effect == "force_deadband"
    assert found.faults[0].values["width"] == pytest.approx(8.0, rel=0.1)


@pytest.mark.slow
def test_a_mass_of_a_device_of_a_few_nanograms_is_named_too(rig):
    """1 in SI units is far beyond such a device: products of size 1 are of no magnitude that tells anything."""

    def of_nano(whole):
        return replace(whole, command=replace(whole.command, samples=1e-11 * whole.command.samples))

    found = rank_faults(
        [of_nano(rig.record_rig(2, "added_mass", 0.3))], [of_nano(rig.record_rig(1))], frozenset(), lambda: True
    )
    assert found is not None
    named = choose_fault(found, 1).named
    assert named is not None and named.fault.effect == "added_mass"
    assert named.values["mass"] == pytest.approx(0.3e-11, rel=0.15)
