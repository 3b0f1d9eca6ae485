import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.definition.apparatus import SafetySettings
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import MultisineSegment, SineSegment, SweepSegment
from study.errors import WrongUseError
from study.session.stimulus.limits import SPRING_SLEW_N_PER_S, make_recording_limits
from study.session.stimulus.recording_pieces import make_pieces

RATE_HZ = 1000.0
SAFETY = SafetySettings(stimulus_cap_n=2.0, total_cap_n=3.0)


def protocol(*segments, **changes) -> RecordingProtocol:
    return RecordingProtocol(
        name="p", kind="recording", title="t", segments=segments, safety=SAFETY, rest_s=0.5, **changes
    )


def test_each_frequency_is_a_piece_whose_counted_part_is_steady_whole_loops():
    plan = make_pieces(
        protocol(SineSegment("sine", (5.0, 15.0), 1.0, "direction_1", duration_s=1.1, settle_s=0.4)), RATE_HZ
    )
    assert [piece.frequency_hz for piece in plan] == [5.0, 15.0]
    for piece in plan:
        counted = piece.segment.stop - piece.segment.start
        assert counted % piece.segment.period == 0
        wave = piece.commands.samples[piece.segment.start : piece.segment.stop] @ np.array(piece.unit_vector)
        assert np.abs(wave[: piece.segment.period]) == pytest.approx(np.abs(wave[-piece.segment.period :]), abs=1e-9)
        assert np.abs(wave).max() == pytest.approx(1.0, rel=1e-2)


def test_every_piece_begins_and_ends_with_a_rest():
    plan = make_pieces(protocol(SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0, periods=3)), RATE_HZ)
    samples = plan[0].commands.samples
    assert np.all(samples[:500] == 0)
    assert np.all(samples[-500:] == 0)
    assert np.all(samples[:, [0, 2]] == 0)
    assert plan[0].segment.period == 2000
    assert plan[0].segment.stop - plan[0].segment.start == 6000


def test_the_last_sweep_periods_are_alike():
    plan = make_pieces(protocol(SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0, periods=3)), RATE_HZ)
    wave = plan[0].commands.samples[500:-500, 1]
    assert wave[2000:4000] == pytest.approx(wave[4000:6000])


UNPLAYABLE = {
    "below half the rate, not 500 Hz": SineSegment("sine", (25.0, 500.0), 1.0, "x", duration_s=0.1),
    "holds less than a cycle": SweepSegment("sweep", 1.0, 500.0, 1.0, "x", duration_s=0.0124542),
    "has no line from 499.5 to 500 Hz": MultisineSegment("multisine", 499.5, 500.0, 1.0, "x", 1.0, odd_only=False),
    "has no odd line from 390 to 410 Hz": MultisineSegment("multisine", 390.0, 410.0, 1.0, "x", 0.0025),
}


@pytest.mark.parametrize("why", UNPLAYABLE)
def test_a_segment_without_a_force_at_this_rate_is_refused_by_its_number(why):
    playable = SineSegment("sine", (25.0,), 1.0, "x", duration_s=0.2)
    with pytest.raises(WrongUseError, match=rf"segments\[2\] of 'p' at 1000 samples.*{why}.*Nothing moved"):
        make_pieces(protocol(playable, UNPLAYABLE[why]), RATE_HZ)


def test_a_sinusoid_whose_period_would_not_be_one_is_refused():
    with pytest.raises(ValueError, match="whole tenths of a hertz, so that whole periods can be looped"):
        SineSegment("sine", (5.03,), 1.0, "x", duration_s=1.0)


def test_repeats_play_the_list_again():
    segment = SineSegment("sine", (25.0,), 1.0, "x", duration_s=0.2)
    assert len(make_pieces(protocol(segment, segment, repeats=3), RATE_HZ)) == 6


def test_sweeps_have_a_slew_limit_of_their_own():
    sweep = SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0)
    plan = make_pieces(protocol(sweep), RATE_HZ)
    steepest = np.abs(np.diff(plan[0].commands.samples, axis=0)).max() * RATE_HZ
    assert steepest < make_recording_limits(protocol(sweep)).slew_n_per_s


def multisine(**changes) -> MultisineSegment:
    settings = {"amplitude_n": 1.5, "along": "all", "duration_s": 2.0, "periods": 3, "seed": 4, "role": "test"}
    return MultisineSegment("multisine", 5.0, 35.0, **(settings | changes))


def test_every_period_of_a_multisine_is_the_same_to_the_last_bit():
    (piece,) = make_pieces(protocol(multisine()), RATE_HZ)
    counted = piece.commands.samples[piece.segment.start : piece.segment.stop].reshape(3, 2000, 3)
    assert np.array_equal(counted[0], counted[1])
    assert np.array_equal(counted[0], counted[2])
    assert np.linalg.norm(counted[0], axis=1).max() == pytest.approx(1.5, rel=1e-12)


def test_the_fade_of_a_sweep_ends_within_its_first_period():
    (piece,) = make_pieces(protocol(SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0, periods=3)), RATE_HZ)
    counted = piece.commands.samples[piece.segment.start : piece.segment.stop, 1].reshape(3, 2000)
    assert np.array_equal(counted[1], counted[2])
    assert np.array_equal(counted[0, 100:], counted[1, 100:])
    assert not np.array_equal(counted[0, :100], counted[1, :100])


def test_a_multisine_fades_in_and_out_outside_its_periods():
    (piece,) = make_pieces(protocol(multisine(), fade_s=0.2), RATE_HZ)
    samples, start, stop = piece.commands.samples, piece.segment.start, piece.segment.stop
    assert (start, len(samples) - stop) == (700, 700)
    assert np.all(samples[:501] == 0)
    assert np.all(np.abs(samples[-501:]) < 1e-12)
    within = np.linalg.norm(np.diff(samples[start:stop], axis=0), axis=1).max()
    assert np.linalg.norm(np.diff(samples, axis=0), axis=1).max() < within + 1.5 * np.pi / 400


def test_each_realisation_is_a_piece_that_says_its_role_and_band():
    plan = make_pieces(protocol(multisine(realisations=2, along="direction_2"), repeats=2), RATE_HZ)
    assert [piece.realisation for piece in plan] == [1, 2, 1, 2]
    assert {(piece.segment.role, piece.segment.kind, piece.band_hz) for piece in plan} == {
        ("test", "multisine", (5.0, 35.0))
    }
    for piece in plan:
        across = np.cross(piece.commands.samples, piece.unit_vector)
        assert np.abs(across).max() < 1e-12


def test_roles_are_carried_from_sines_and_sweeps_too():
    plan = make_pieces(
        protocol(
            SineSegment("sine", (25.0,), 1.0, "x", duration_s=0.2, role="fit"),
            SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0, role="test"),
        ),
        RATE_HZ,
    )
    assert [(piece.number, piece.segment.role) for piece in plan] == [(1, "fit"), (2, "test")]


def test_a_piece_at_another_amplitude_is_the_same_excitation():
    (piece,) = make_pieces(protocol(multisine()), RATE_HZ)
    lower = piece.scale_to(0.75)
    assert lower.segment.amplitude == 0.75
    assert np.array_equal(lower.commands.samples, piece.commands.samples * 0.5)


@given(
    from_hz=st.floats(0.5, 400.0), width=st.floats(0.01, 1.0), seed=st.integers(0, 1000), fade_s=st.floats(0.01, 0.5)
)
@settings(max_examples=25, deadline=None)
def test_no_multisine_is_steeper_than_the_limits_made_for_it(from_hz, width, seed, fade_s):
    """Also of one line or two, whose samples may miss the wave's peaks."""
    to_hz = min(500.0, from_hz * (1 + width) + 0.6)
    segment = MultisineSegment("multisine", from_hz, to_hz, 2.0, "all", 2.0, seed=seed, odd_only=False)
    source = protocol(segment, fade_s=fade_s)
    (piece,) = make_pieces(source, RATE_HZ)
    steepest = np.linalg.norm(np.diff(piece.commands.samples, axis=0), axis=1).max() * RATE_HZ
    assert steepest < make_recording_limits(source).slew_n_per_s - SPRING_SLEW_N_PER_S


def test_a_fade_that_is_no_tick_of_the_device_is_refused():
    """The slew limit that follows from it would limit nothing."""
    with pytest.raises(WrongUseError, match=r"the fade of 0.004 s is no more than half a tick.*Nothing moved"):
        make_pieces(protocol(SineSegment("sine", (5.0,), 1.0, "x", duration_s=1.0), fade_s=0.004), 100.0)
