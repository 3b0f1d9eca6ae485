"""The rule that chooses the error measure, and how feedback from the response to the command is recognised."""

from dataclasses import replace

import numpy as np

from analysis.diagnosis.data.closed_loop import is_in_closed_loop
from analysis.diagnosis.data.observed_parts import observe_parts
from analysis.diagnosis.errors.error_measure_rule import decays_within, select_error_measure
from equalizer.signals.recording import Hold, Recording
from equalizer.signals.signal import Signal
from tests.analysis.diagnosis.errors.drifting_plant import RATE_HZ, make_model


def test_the_rule_keeps_free_simulation_for_plants_that_hold_themselves(
    controlled_recording: Recording, drifting_recording: Recording
) -> None:
    for each in (controlled_recording, drifting_recording):
        assert select_error_measure(observe_parts([each], 1), make_model(stiffness=400.0)).measure == "free simulation"


def test_the_rule_takes_forces_where_a_model_grows_within_a_window(drifting_recording: Recording) -> None:
    choice = select_error_measure(observe_parts([drifting_recording], 1), make_model(stiffness=-400.0))
    assert choice.measure == "predicted force"
    assert "a controller must have held" in choice.reason
    felt = replace(
        drifting_recording, response=replace(drifting_recording.response, quantity="acceleration", unit="m/s^2")
    )
    choice = select_error_measure(observe_parts([felt], 1), make_model(stiffness=-400.0, quantity="acceleration"))
    assert choice.measure == "windows"


def test_the_rule_takes_windows_where_a_recording_begins_in_motion(drifting_recording: Recording) -> None:
    moving = replace(
        drifting_recording,
        response=replace(drifting_recording.response, samples=drifting_recording.response.samples + 0.3),
    )
    choice = select_error_measure(observe_parts([moving], 1), make_model(stiffness=400.0))
    assert choice.measure == "free simulation"
    late = replace(
        drifting_recording,
        command=drifting_recording.command.select_samples(900, 4900),
        response=drifting_recording.response.select_samples(900, 4900),
        segments=(),
    )
    choice = select_error_measure(observe_parts([late], 1), make_model(stiffness=400.0))
    assert choice.measure == "windows"
    assert "does not begin at rest" in choice.reason


def test_the_rule_takes_windows_under_a_controller_where_accelerations_alone_were_measured(
    controlled_recording: Recording,
) -> None:
    felt = replace(
        controlled_recording, response=replace(controlled_recording.response, quantity="acceleration", unit="m/s^2")
    )
    choice = select_error_measure(observe_parts([felt], 1), make_model(quantity="acceleration"))
    assert choice.measure == "windows"


def test_what_holds_itself_comes_to_rest_within_a_third_of_the_recording() -> None:
    assert decays_within(make_model(400.0), 10.0)
    assert not decays_within(make_model(400.0), 0.5)
    assert not decays_within(make_model(0.0), 10.0)


def test_feedback_is_seen_by_the_excitation_beside_the_command(controlled_recording: Recording) -> None:
    assert is_in_closed_loop(controlled_recording)
    assert not is_in_closed_loop(replace(controlled_recording, excitation=controlled_recording.command))
    gappy = np.array(controlled_recording.command.samples)
    gappy[100:130] = np.nan
    command = replace(controlled_recording.command, samples=gappy)
    assert is_in_closed_loop(replace(controlled_recording, command=command))
    nothing = replace(controlled_recording.command, samples=np.full_like(gappy, np.nan))
    assert not is_in_closed_loop(replace(controlled_recording, command=nothing))


def test_feedback_is_seen_without_an_excitation_where_responses_make_the_command() -> None:
    rng = np.random.default_rng(2)
    n = 4000
    push, x = rng.standard_normal(n), np.zeros(n)
    u = np.empty(n)
    for k in range(n):
        u[k] = -3.0 * x[k] - 0.5 * x[k - 1] + 0.01 * push[k]
        if k + 1 < n:
            x[k + 1] = 0.9 * x[k] + 0.1 * u[k] + 0.2 * rng.standard_normal()
    looped = _make_recording(u, x)
    assert is_in_closed_loop(looped)
    assert not is_in_closed_loop(replace(looped, hold=Hold.BAND_LIMITED))


def test_a_free_command_is_not_taken_for_feedback(drifting_recording: Recording) -> None:
    rng = np.random.default_rng(3)
    u = rng.standard_normal(4000)
    x = np.convolve(u, 0.9 ** np.arange(60))[: len(u)]
    assert not is_in_closed_loop(_make_recording(u, np.append(0.0, x[:-1])))
    assert not is_in_closed_loop(drifting_recording)


def _make_recording(u: np.ndarray, x: np.ndarray) -> Recording:
    command = Signal(u[:, None], RATE_HZ, "force", "N", ("x",))
    return Recording("loop", command, Signal(x[:, None], RATE_HZ, "position", "m", ("x",)))
