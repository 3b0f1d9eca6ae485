import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.equalizer import IdentityEqualizer
from protocols.definition.apparatus import TestDirections
from study.session.stimulus.limits import make_study_limits
from study.session.stimulus.stimulus import compute_direction_vector, count_loop_samples, make_held_stimulus

RATE_HZ = 1000.0


@given(st.sampled_from(["xy", "yz", "zx"]), st.floats(-180, 180))
def test_the_directions_are_orthogonal_unit_vectors_mirrored_about_the_line(plane, symmetry_deg):
    directions = TestDirections(plane=plane, symmetry_deg=symmetry_deg)
    one, two = compute_direction_vector(directions, 1), compute_direction_vector(directions, 2)
    line = one + two
    assert one @ two == pytest.approx(0.0, abs=1e-12)
    assert [one @ one, two @ two] == pytest.approx([1.0, 1.0])
    assert one @ line == pytest.approx(two @ line)


def test_by_default_they_lean_left_and_right_of_upright_in_the_frontal_plane():
    directions = TestDirections()
    assert compute_direction_vector(directions, 1) == pytest.approx(np.array([0.0, -1.0, 1.0]) / np.sqrt(2))
    assert compute_direction_vector(directions, 2) == pytest.approx(np.array([0.0, 1.0, 1.0]) / np.sqrt(2))


def test_there_is_no_third_direction():
    with pytest.raises(ValueError, match="directions 1 and 2, not 3"):
        compute_direction_vector(TestDirections(), 3)


@given(st.integers(5, 5000).map(lambda tenths: tenths / 10))
def test_a_loop_holds_whole_periods(frequency_hz):
    periods = count_loop_samples(frequency_hz, RATE_HZ) * frequency_hz / RATE_HZ
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert periods >= 1 - 1e-9


def test_the_loop_is_a_sinusoid_along_the_direction_with_the_polarity_in_its_sign(small_protocol):
    vector = compute_direction_vector(small_protocol.directions, 2)
    plus, minus = (
        make_held_stimulus(small_protocol.stimulus, vector, 25.0, level, IdentityEqualizer(), RATE_HZ).loop.samples
        for level in (2.0, -2.0)
    )
    assert plus == pytest.approx(-minus)
    assert np.abs(plus @ vector).max() == pytest.approx(2.0)
    assert np.abs(plus - np.outer(plus @ vector, vector)).max() < 1e-12


def test_a_stimulus_in_acceleration_goes_through_the_equalizer(small_protocol):
    class HalfKilogram:
        name = "a mass of half a kilogram"
        reference_quantity = "acceleration"

        def compute_loop_commands(self, wanted: Signal) -> Signal:
            assert wanted.unit == "m/s^2"
            return Signal(0.5 * wanted.samples, wanted.sample_rate_hz, "force", "N", ("fx", "fy", "fz"))

        def compute_onset_commands(self, wanted: Signal, envelope) -> None:
            return None

    vector = compute_direction_vector(small_protocol.directions, 1)
    held = make_held_stimulus(small_protocol.stimulus, vector, 25.0, 4.0, HalfKilogram(), RATE_HZ)
    assert np.abs(held.loop.samples @ vector).max() == pytest.approx(2.0)


def test_without_an_equalizer_only_a_force_can_be_played():
    wanted = Signal(np.zeros((4, 3)), RATE_HZ, "acceleration", "m/s^2", ("ax", "ay", "az"))
    with pytest.raises(ValueError, match="only a force can be played, not acceleration"):
        IdentityEqualizer().compute_loop_commands(wanted)


def test_the_slew_limit_is_just_above_the_steepest_stimulus(small_protocol):
    """The fastest frequency at the cap while it fades: the limit lets it pass, and a quarter more not."""
    limits = make_study_limits(small_protocol)
    t = np.arange(0, 0.1, 1 / RATE_HZ)
    envelope = 0.5 - 0.5 * np.cos(np.pi * t / 0.1)
    steepest = max(
        np.abs(np.diff(envelope * 3.0 * np.sin(2 * np.pi * 35.0 * t + phase))).max() * RATE_HZ
        for phase in np.linspace(0, np.pi, 13)
    )
    steady = np.abs(np.diff(3.0 * np.sin(2 * np.pi * 35.0 * np.arange(0, 1, 1 / RATE_HZ)))).max() * RATE_HZ
    assert max(steepest, steady) < limits.slew_n_per_s < 1.25 * (steady + 100.0)


@pytest.mark.parametrize("rate_hz", [1000.0 / 3, 999.97, 1024.0, 2000.0 / 7])
def test_at_a_rate_that_is_not_in_whole_tenths_the_loop_begins_again_without_a_jump(small_protocol, rate_hz):
    vector = np.array([1.0, 0.0, 0.0])
    stimulus = make_held_stimulus(small_protocol.stimulus, vector, 45.0, 1.0, IdentityEqualizer(), rate_hz)
    wave = stimulus.loop.samples[:, 0]
    line = np.abs(np.fft.rfft(wave))
    assert line.max() == pytest.approx(len(wave) / 2)
    assert np.sort(line)[-2] < 1e-6 * line.max()
    assert np.argmax(line) * rate_hz / len(wave) == pytest.approx(45.0, abs=0.05)
