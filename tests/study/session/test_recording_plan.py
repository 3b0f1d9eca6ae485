import numpy as np
import pytest

from protocols.apparatus import SafetySettings
from protocols.recording_protocol import RecordingProtocol, SineSegment, SweepSegment
from study.session.limits import limits_of_recording
from study.session.recording_plan import pieces

RATE_HZ = 1000.0
SAFETY = SafetySettings(stimulus_cap_n=2.0, total_cap_n=3.0)


def protocol(*segments, **changes) -> RecordingProtocol:
    return RecordingProtocol(
        name="p", kind="recording", title="t", segments=segments, safety=SAFETY, rest_s=0.5, **changes
    )


def test_each_frequency_is_a_piece_whose_counted_part_is_steady_whole_loops():
    plan = pieces(protocol(SineSegment("sine", (5.0, 15.0), 1.0, "direction_1", duration_s=1.1, settle_s=0.4)), RATE_HZ)
    assert [piece.frequency_hz for piece in plan] == [5.0, 15.0]
    for piece in plan:
        counted = piece.segment.stop - piece.segment.start
        assert counted % piece.segment.period == 0
        wave = piece.commands.samples[piece.segment.start : piece.segment.stop] @ np.array(piece.unit_vector)
        assert np.abs(wave[: piece.segment.period]) == pytest.approx(np.abs(wave[-piece.segment.period :]), abs=1e-9)
        assert np.abs(wave).max() == pytest.approx(1.0, rel=1e-2)


def test_every_piece_begins_and_ends_with_a_rest():
    plan = pieces(protocol(SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0, periods=3)), RATE_HZ)
    samples = plan[0].commands.samples
    assert np.all(samples[:500] == 0)
    assert np.all(samples[-500:] == 0)
    assert np.all(samples[:, [0, 2]] == 0)
    assert plan[0].segment.period == 2000
    assert plan[0].segment.stop - plan[0].segment.start == 6000


def test_the_last_sweep_periods_are_alike():
    plan = pieces(protocol(SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0, periods=3)), RATE_HZ)
    wave = plan[0].commands.samples[500:-500, 1]
    assert wave[2000:4000] == pytest.approx(wave[4000:6000])


def test_repeats_play_the_list_again():
    segment = SineSegment("sine", (25.0,), 1.0, "x", duration_s=0.2)
    assert len(pieces(protocol(segment, segment, repeats=3), RATE_HZ)) == 6


def test_sweeps_have_a_slew_limit_of_their_own():
    sweep = SweepSegment("sweep", 1.0, 400.0, 1.0, "y", duration_s=2.0)
    plan = pieces(protocol(sweep), RATE_HZ)
    steepest = np.abs(np.diff(plan[0].commands.samples, axis=0)).max() * RATE_HZ
    assert steepest < limits_of_recording(protocol(sweep)).slew_n_per_s
