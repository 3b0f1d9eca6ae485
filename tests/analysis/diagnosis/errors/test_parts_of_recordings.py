"""Which samples of joined and repeated recordings are fitted, chosen by and tested on."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.measured_motion import convert_to_force_driven
from analysis.diagnosis.data.observed_parts import name_parts, observe_parts
from analysis.diagnosis.errors.choose_measure import make_measure
from equalizer.signals.joining import join_recordings
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from tests.analysis.diagnosis.errors.drifting_plant import RATE_HZ, make_model


def test_parts_made_one_after_another_are_compared_apart(controlled_recording: Recording) -> None:
    n = len(controlled_recording)
    both = join_recordings(
        [controlled_recording, controlled_recording], {"parts": [{"start": 0, "stop": n}, {"start": n, "stop": 2 * n}]}
    )
    one, two = make_measure([both], make_model()).measure, make_measure([controlled_recording], make_model()).measure
    assert len(one.records) == 2
    assert np.allclose(one.residuals(make_model(), ())[1], two.residuals(make_model(), ())[0], atol=1e-6)
    assert name_parts([both, controlled_recording], ("a", "b")) == ("a, part 1", "a, part 2", "b")


def test_a_recording_for_the_test_spares_the_others(controlled_recording: Recording) -> None:
    fitted = replace(controlled_recording, segments=(Segment(0, len(controlled_recording), "slow", role="fit"),))
    tested = replace(controlled_recording, segments=(Segment(0, len(controlled_recording), "slow", role="test"),))
    one, other = observe_parts([fitted, tested], 1)
    assert not one.test.any() and (one.fit | one.choose).all()
    assert other.test.all() and not (other.fit | other.choose).any()
    (alone,) = observe_parts([tested], 1)
    assert alone.fit.any() and alone.choose.any() and alone.test.any()


def test_an_imposed_motion_is_turned_round(controlled_recording: Recording) -> None:
    x, force = controlled_recording.response, controlled_recording.command
    speed = Signal(np.gradient(x.samples, 1 / RATE_HZ, axis=0), RATE_HZ, "velocity", "m/s", ("x",))
    turned = convert_to_force_driven(Recording("rack", speed, force, x, segments=controlled_recording.segments))
    assert turned.command is force and turned.response is speed
    assert convert_to_force_driven(controlled_recording) is controlled_recording
    chosen = make_measure([turned], make_model(quantity="velocity"))
    assert chosen.measure.name == "predicted force"
    assert "imposed" in chosen.remarks[0]


def test_decisions_are_made_by_the_first_periods_of_many(drifting_recording: Recording) -> None:
    repeated = replace(drifting_recording, segments=(Segment(0, 6000, "multisine", 1.0, 500, "fit"),))
    (record,) = observe_parts([repeated], 1)
    assert np.flatnonzero(record.fit | record.choose)[-1] < 4 * 500
