"""Recordings of odd rates, lengths, gaps, levels and channel counts: each has an answer, or is refused in words; a part
of the work that crashes is named, and does not end the rest."""

import numpy as np
import pytest
from scipy.signal import lfilter

from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.document import Verdict
from analysis.diagnosis.first_model import fit_without_model
from analysis.diagnosis.search.guard import Guard
from equalizer.signals.recording import Recording, Segment
from equalizer.signals.signal import Signal
from study.errors import StudyError
from study.store.formats.recording_file import write_recording
from study.workflows.diagnosis.diagnose_recordings import DiagnosePlan, diagnose_recordings
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput
from study.workflows.diagnosis.fit_without_model import fit_first_model

VERDICTS = set(Verdict.__args__)
QUANTITIES = (("position", "m"), ("velocity", "m/s"), ("acceleration", "m/s^2"), ("angle", "rad"), ("unknown", "1"))


def quiet(what, share):
    return None


def drawn(seed: int) -> Recording:
    """A lightly damped device per channel, with friction of a sort, under what a stranger may have done to the file."""
    random = np.random.default_rng(seed)
    rate_hz = float(random.choice([1.0, 9.7, 50.0, 333.3, 1000.0]))
    samples, commands, responses = (int(random.integers(*ends)) for ends in ((1500, 4000), (1, 4), (1, 4)))
    period = int(random.choice([0, 64, 200]))
    command = random.standard_normal((samples, commands))
    if period:
        command = np.tile(command[:period], (-(-samples // period), 1))[:samples]
    levels = random.choice([0.3, 1.0, 3.0], size=int(random.integers(1, 4)))
    edges = np.linspace(0, samples, len(levels) + 1).astype(int)
    for level, start, stop in zip(levels, edges[:-1], edges[1:], strict=True):
        command[start:stop] *= level
    command *= 10.0 ** random.uniform(-4, 3)
    mixed = np.resize(command.T, (responses, samples)).T
    response = lfilter([0.0, 0.1], [1.0, -1.7, 0.75], mixed - 0.1 * np.sign(mixed) * mixed.std(), axis=0)
    response = 10.0 ** random.uniform(-6, 3) * (
        response + 0.01 * response.std() * random.standard_normal(response.shape)
    )
    if random.random() < 0.4:
        begin = int(random.integers(0, samples))
        response[begin : begin + int(random.integers(1, 200)), -1] = np.nan
    if commands > 1 and random.random() < 0.2:
        command[:, -1] = 0.0
    segments = tuple(
        Segment(int(start), int(stop), "multisine" if period else "noise", float(level), period)
        for level, start, stop in zip(levels, edges[:-1], edges[1:], strict=True)
    )
    quantity, unit = QUANTITIES[int(random.integers(len(QUANTITIES)))]
    return Recording(
        "fuzz", Signal(command, rate_hz, "force", "N", tuple(f"f{k}" for k in range(commands))),
        Signal(response, rate_hz, quantity, unit, tuple(f"r{k}" for k in range(responses))),
        segments=segments if random.random() < 0.5 else (),
    )  # fmt: skip


def answer_or_refusal(seed, folder):
    path = folder / "fuzz.h5"
    write_recording(path, drawn(seed))
    try:
        return diagnose_recordings(DiagnosePlan((path,), folder / "out", seconds=1.0), quiet).findings
    except StudyError as refusal:
        assert refusal.happened
        return None


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_any_recording_has_an_answer_or_a_refusal(seed, tmp_path):
    found = answer_or_refusal(seed, tmp_path)
    assert found is None or found.diagnosis.verdict in VERDICTS


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 160))
def test_many_recordings_have_an_answer_or_a_refusal(seed, tmp_path):
    found = answer_or_refusal(seed, tmp_path)
    assert found is None or found.diagnosis.verdict in VERDICTS


def test_where_the_force_balance_crashes_a_model_is_fitted_without_it_and_the_crash_is_named(monkeypatch):
    def broken(*arguments):
        raise ValueError("operands could not be broadcast together")

    monkeypatch.setattr(fit_without_model, "fit_first_model", broken)
    monkeypatch.setattr(fit_without_model, "fit_first_linear_model", lambda *arguments: ("a model", ("how",)))
    guard, given = Guard(enabled=True), DiagnosisInput((), (), (), ())
    first = fit_first_model(given, (), (lambda: True, guard), quiet)
    assert (first.model, first.remarks, first.balances) == ("a model", ("how",), ())
    (said,) = guard.sentences
    assert said.startswith("The force balance was left out") and "broadcast" in said
    with pytest.raises(ValueError, match="broadcast"):
        fit_first_model(given, (), (lambda: True, Guard()), quiet)


def test_a_refusal_in_the_force_balance_is_no_crash(monkeypatch):
    def refused(*arguments):
        raise NothingToDiagnoseError(("the recordings carry no model",))

    monkeypatch.setattr(fit_without_model, "fit_first_model", refused)
    guard = Guard(enabled=True)
    with pytest.raises(StudyError):
        fit_first_model(DiagnosisInput((), (), (), ()), (), (lambda: True, guard), quiet)
    assert guard.sentences == ()
