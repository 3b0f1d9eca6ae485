"""First models of invented mechanisms: parameters come back within their intervals, and what cannot be is refused."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.diagnosis.errors.prediction_error import compute_prediction_error
from analysis.diagnosis.first_model.choose_structure import choose_structure
from analysis.diagnosis.first_model.fit_without_model import (
    FIT_OUT_OF_TIME,
    _responds_to_commands,
    fit_first_linear_model,
)
from equalizer.effects.simulation.simulator import simulate_mechanism
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.cli.main import main
from study.errors import StudyError
from study.store.formats.mechanical_model_file import read_mechanical_model
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis import diagnose_recordings
from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan
from study.workflows.diagnosis.diagnosis_input import read_given_model, read_input
from study.workflows.diagnosis.fit_first_model import FirstModelPlan, FittedFirstModel, fit_and_write_first_model

RATE_HZ, SECONDS = 1000.0, 30.0


def device(m: float, c: float, k: float, quantity: str = "position", rotational: bool = False) -> MechanicalModel:
    one = np.eye(1)
    return MechanicalModel("invented", quantity, m * one, c * one, k * one, one, one, rotational=rotational)


def slow_noise(seed: int, axes: int = 1, high_hz: float = 20.0) -> np.ndarray:
    count = int(RATE_HZ * SECONDS)
    rng = np.random.default_rng(seed)
    spectrum = np.fft.rfft(rng.standard_normal((count, axes)), axis=0)
    spectrum[np.fft.rfftfreq(count, 1 / RATE_HZ) > high_hz] = 0
    wave = np.fft.irfft(spectrum, count, axis=0)
    return wave / wave.std(axis=0)


def recorded(model: MechanicalModel, seed: int = 1, noise: float = 1e-4, position: bool = False) -> Recording:
    """White noise of a share of its rms on the response, and none on the command."""
    command = slow_noise(seed, model.inputs)
    played = simulate_mechanism(model, command, RATE_HZ, ())
    names = "xyz"[: model.inputs]
    units = ("rad", "N m") if model.rotational else ("m", "N")
    unit = {"position": units[0], "velocity": units[0] + "/s", "acceleration": "m/s^2", "angle": "rad"}[model.quantity]
    rng = np.random.default_rng(seed + 100)
    read = played.response + noise * played.response.std(axis=0) * rng.standard_normal(played.response.shape)
    what = "torque" if model.rotational else "force"
    seen = Signal(played.position, RATE_HZ, "position", "m", tuple(names)) if position else None
    return Recording(
        "invented",
        Signal(command, RATE_HZ, what, units[1], tuple("f" + name for name in names)),
        Signal(read, RATE_HZ, model.quantity, unit, tuple(names)),
        seen,
    )


def untimed(recording: Recording) -> Recording:
    def numbered(signal: Signal) -> Signal:
        return replace(signal, sample_rate_hz=1.0)

    return replace(
        recording,
        command=numbered(recording.command), response=numbered(recording.response), meta={"time": "unknown"},
    )  # fmt: skip


def fitted(folder: Path, recording: Recording, structure: str = "auto") -> FittedFirstModel:
    write_recording(folder / "rec.h5", recording, precision="float64")
    return fit_and_write_first_model(
        FirstModelPlan((folder / "rec.h5",), folder / "model.toml", structure), lambda share: None
    )


def inside(done: FittedFirstModel, name: str, truth: float) -> bool:
    (number,) = [each for each in done.choice.fit.parameters if each.name == name]
    return number.half_width is not None and abs(number.value - truth) <= number.half_width


@pytest.mark.parametrize("seed", range(1, 6))
def test_mass_damping_and_stiffness_come_back_within_their_intervals(tmp_path, seed):
    done = fitted(tmp_path, recorded(device(0.4, 6.0, 900.0), seed), "mass-spring")
    assert [inside(done, f"{part} fx", value) for part, value in
            (("mass", 0.4), ("damping", 6.0), ("stiffness", 900.0))] == [True] * 3  # fmt: skip
    assert max(done.choice.fit.held_out) < 0.05


def test_the_intervals_are_no_wider_than_a_tenth_where_there_is_hardly_noise(tmp_path):
    done = fitted(tmp_path, recorded(device(0.4, 6.0, 900.0)), "mass-spring")
    assert all(
        number.half_width is not None and number.half_width < 0.1 * number.value
        for number in done.choice.fit.parameters
    )


def test_coupled_axes_give_symmetric_matrices(tmp_path):
    eye, couple = np.eye(2), np.array([[0.0, 1.0], [1.0, 0.0]])
    given = MechanicalModel(
        "two", "position", 0.4 * eye + 0.1 * couple, 6 * eye, 900 * eye + 200 * couple, eye, eye
    )  # fmt: skip
    done = fitted(tmp_path, recorded(given), "mass-spring")
    found = read_mechanical_model(done.plan.out)
    np.testing.assert_allclose(found.mass, given.mass, rtol=0.03)
    np.testing.assert_allclose(found.stiffness, given.stiffness, rtol=0.03)
    np.testing.assert_array_equal(found.stiffness, found.stiffness.T)


@pytest.mark.parametrize(
    ("model", "structure"),
    [
        pytest.param(device(0.4, 6.0, 900.0), "mass-spring", marks=pytest.mark.slow),
        (device(0.4, 6.0, 0.0, "velocity"), "motor"),
        (device(1e-6, 6.0, 900.0), "massless"),
    ],
)
def test_auto_takes_the_structure_that_is_there(tmp_path, model, structure):
    done = fitted(tmp_path, recorded(model))
    assert done.choice.fit.kind == structure
    assert {"massless", "motor", "mass-spring"} <= {each.kind for each in done.choice.tried}


def test_a_motion_beside_the_force_of_another_recording_is_not_explained(tmp_path):
    """The negative control; files of that kind are refused."""
    plain, other = (recorded(device(0.4, 6.0, 900.0), seed) for seed in (1, 2))
    mixed = replace(plain, command=other.command)
    assert min(choose_structure([mixed], "massless", lambda share: None).fit.held_out) > 0.9
    with pytest.raises(StudyError, match="not related to the commands"):
        fitted(tmp_path, mixed, "mass-spring")


def test_a_pendulum_is_a_spring_about_its_mean_and_that_is_said(tmp_path):
    done = fitted(tmp_path, recorded(device(0.01, 0.05, 2.0, "angle", rotational=True)), "gravity")
    assert inside(done, "stiffness fx", 2.0)
    assert any("linearised" in remark for remark in done.remarks)


@pytest.mark.slow
def test_a_body_on_a_body_is_two_mode(tmp_path):
    eye = np.array([[1.0, 0.0]])
    given = MechanicalModel(
        "two masses", "acceleration", np.diag([0.3, 0.1]), np.array([[5.0, -0.2], [-0.2, 0.2]]),
        np.array([[1500.0, -600.0], [-600.0, 600.0]]), eye.T, eye,
    )  # fmt: skip
    done = fitted(tmp_path, recorded(given))
    assert done.choice.fit.kind == "two-mode"
    assert done.choice.fit.model.coordinates == 2


def test_where_no_time_is_known_stiffness_alone_is_reported(tmp_path):
    done = fitted(tmp_path, untimed(recorded(device(1e-6, 1e-6, 900.0))))
    assert done.choice.fit.kind == "massless"
    assert inside(done, "stiffness fx", 900.0)
    again = tmp_path / "again"
    again.mkdir()
    with pytest.raises(StudyError, match="no time is known"):
        fitted(again, untimed(recorded(device(1e-6, 1e-6, 900.0))), "motor")


def test_motion_in_and_force_out_is_turned_round(tmp_path):
    plain = recorded(device(0.4, 6.0, 900.0))
    done = fitted(tmp_path, replace(plain, command=plain.response, response=plain.command), "mass-spring")
    assert done.choice.fit.parameters[2].value == pytest.approx(900.0, rel=0.05)


def test_the_file_says_which_way_a_command_is_counted(tmp_path):
    plain = recorded(device(0.4, 6.0, 900.0))
    against = replace(plain, command=replace(plain.command, samples=-plain.command.samples))
    done = fitted(tmp_path, against, "mass-spring")

    model = read_mechanical_model(done.plan.out)
    assert model.input[0, 0] == -1
    assert any("opposite in sign to the motion" in remark for remark in done.remarks)
    assert compute_prediction_error(against, model, "test").without_gain < 0.02
    assert compute_prediction_error(plain, model, "test").without_gain > 1


@pytest.mark.slow
def test_the_file_is_accepted_for_a_diagnosis(tmp_path):
    done = fitted(tmp_path, recorded(device(0.4, 6.0, 900.0)))
    found = read_given_model(done.plan.out, read_input([tmp_path / "rec.h5"], 1))
    assert found.tolerance is not None and found.tolerance.mass_kg > 0
    assert found.provenance["structure"] == "mass-spring"


@pytest.mark.parametrize(("mass", "answers"), [(0.5, True), (1e31, False)])
def test_a_model_of_masses_without_bound_does_not_answer(mass, answers):
    assert _responds_to_commands(device(mass, 2.0, 300.0), recorded(device(0.5, 2.0, 300.0))) == answers


def test_segments_to_test_are_held_out(tmp_path):
    count = int(RATE_HZ * SECONDS)
    parts = (Segment(0, count // 2, "noise", role="fit"), Segment(count // 2, count, "noise", role="test"))
    plain = recorded(device(0.4, 6.0, 900.0))
    other = plain.response.samples.copy()
    other[count // 2 :] *= 2
    bent = replace(plain, response=replace(plain.response, samples=other), segments=parts)
    done = fitted(tmp_path, bent, "mass-spring")
    assert inside(done, "stiffness fx", 900.0)
    assert max(done.choice.fit.held_out) > 0.5


@pytest.mark.parametrize(
    ("quantity", "structure", "why"),
    [("acceleration", "motor", "position or velocity"), ("acceleration", "massless", "position or velocity"),
     ("position", "gravity", "pendulums"), ("position", "mass-sprin", "did you mean 'mass-spring'")],
)  # fmt: skip
def test_refusals_say_why_and_write_nothing(tmp_path, quantity, structure, why):
    with pytest.raises(StudyError, match=why):
        fitted(tmp_path, recorded(device(0.4, 6.0, 900.0, quantity)), structure)
    assert list(tmp_path.rglob("*.toml")) == []


def test_the_command_prints_numbers_and_never_overwrites(tmp_path, capsys):
    write_recording(tmp_path / "rec.h5", recorded(device(0.4, 6.0, 900.0)))
    words = ["model", str(tmp_path / "rec.h5"), "--structure", "mass-spring", "--out", str(tmp_path / "m.toml")]
    assert main(words) == 0
    said = capsys.readouterr().out
    assert "stiffness fx" in said and "95 %" in said and "Held-out error" in said
    assert main(words) == 1
    assert "never overwritten" in capsys.readouterr().err


@pytest.mark.slow
def test_a_recording_whose_units_nothing_says_gets_a_model_and_what_was_assumed_is_reported(tmp_path):
    recording = recorded(device(0.4, 6.0, 300.0))
    plain = {"quantity": "1", "unit": "1"}
    bare = replace(
        recording, command=replace(recording.command, **plain), response=replace(recording.response, **plain)
    )
    write_recording(tmp_path / "bare.h5", bare)
    done = fit_and_write_first_model(FirstModelPlan((tmp_path / "bare.h5",), tmp_path / "m.toml"), lambda share: None)
    assert done.choice.fit.kind == "mass-spring"
    assert done.choice.fit.parameters[0].value == pytest.approx(0.4, rel=0.02)
    assert any(
        "The recording does not state what x measures; it was taken for a position" in remark for remark in done.remarks
    )


def test_the_first_model_of_a_diagnosis_ends_within_half_of_the_time_and_says_so(tmp_path, monkeypatch):
    source = recorded(device(0.4, 6.0, 900.0, "acceleration"))
    whole, cut = (
        fit_first_linear_model([source], lambda share: None, time_left=is_left)
        for is_left in (lambda: True, lambda: False)
    )
    assert FIT_OUT_OF_TIME not in whole[1] and FIT_OUT_OF_TIME in cut[1]
    assert cut[0].mass[0, 0] == pytest.approx(0.4, rel=0.05)

    def fit_and_stop(inputs, excluded, limits, *further):
        with monkeypatch.context() as clock:
            seconds = iter([9.0, 11.0])
            start_s = diagnose_recordings.measure_processor_s()
            clock.setattr(diagnose_recordings, "measure_processor_s", lambda: start_s + next(seconds))
            raise StudyError(str([limits[0](), limits[0]()]), "", "")

    monkeypatch.setattr("study.workflows.diagnosis.fit_without_model.fit_first_model", fit_and_stop)
    write_recording(tmp_path / "rec.h5", source)
    with pytest.raises(StudyError, match=r"True, False"):
        diagnose_recordings.run_diagnosis(
            DiagnosePlan((tmp_path / "rec.h5",), tmp_path / "out", seconds=20.5), lambda step, share: None
        )
