"""First mechanical model for a diagnosis to which no model was given, fitted to the recordings themselves.

A refusal of the fit becomes a StudyError that names a remedy.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from analysis.diagnosis.data.input_checks import NothingToDiagnose
from analysis.diagnosis.diagnosis_settings import BALANCE
from analysis.diagnosis.first_model import fit_without_model
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.plant.mechanical_model import MechanicalModel
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput, make_not_diagnosable_error
from study.workflows.forked_map import map_forked

GIVE_A_MODEL = "Give a model of the device alone with --model, or a recording that carries one."


def first_model_of(
    diagnosis_input: DiagnosisInput,
    excluded_effects: Sequence[str],
    bounds: tuple[TimeBudget, Guard],
    on_progress: Progress,
) -> FirstModel:
    """Fit a first model by force balance or, if that crashes, to spectra. excluded_effects: names of effects that are
    left out. bounds: remaining time, and the guard that catches crashes. Raises StudyError for unsuitable
    recordings."""
    time_left, guard = bounds

    def fit_by_balance() -> FirstModel | None:
        return fit_without_model.fit_first_model(
            diagnosis_input.recordings, excluded_effects, time_left, on_progress, map_forked
        )

    with _translate_refusals():
        first = guard.run(BALANCE, "the first model", fit_by_balance, None, (NothingToDiagnose,))
    return first or FirstModel(
        *fit_linear_model(diagnosis_input, lambda share: on_progress("fitting a linear model", share)), ()
    )


def fit_linear_model(
    diagnosis_input: DiagnosisInput, on_progress: Callable[[float], None], origin: str = "these recordings"
) -> tuple[MechanicalModel, tuple[str, ...]]:
    """Fit a linear model to the spectra; also returns remarks. origin: origin of the recordings, for the model's name.
    Raises StudyError."""
    with _translate_refusals():
        return fit_without_model.fit_first_linear_model(diagnosis_input.recordings, on_progress, origin)


@contextmanager
def _translate_refusals() -> Iterator[None]:
    """Turn `NothingToDiagnose` into a StudyError with the same problems and a remedy."""
    try:
        yield
    except NothingToDiagnose as refusal:
        raise make_not_diagnosable_error(refusal.problems, GIVE_A_MODEL) from refusal
