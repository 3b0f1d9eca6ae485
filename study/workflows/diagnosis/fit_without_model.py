"""Fit of a first mechanical model to the recordings of a diagnosis to which no model was given.

Runs the fits of `analysis.diagnosis.first_model` and converts their error for unsuitable recordings into a StudyError
with a remedy.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from analysis.diagnosis.balance.laws.free_laws import list_excluded_laws
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError
from analysis.diagnosis.diagnosis_settings import BALANCE
from analysis.diagnosis.first_model import fit_without_model
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.plant.mechanical_model import MechanicalModel
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput, make_not_diagnosable_error
from study.workflows.forked_map import map_forked

MODEL_REMEDY = "Give a model of the device alone with --model, or a recording that carries one."
"""Remedy of the error for recordings to which no model can be fitted."""


def fit_first_model(
    diagnosis_input: DiagnosisInput,
    excluded_effects: Sequence[str],
    time_budget_and_guard: tuple[TimeBudget, Guard],
    on_progress: Progress,
    discovery: bool = True,
) -> FirstModel:
    """Fit a first model (`analysis.diagnosis.first_model.fit_without_model.fit_first_model`) or, if that crashes, a
    linear one. excluded_effects: names of effects that are left out. on_progress: called with the step's name and its
    completed share, 0 to 1. discovery: whether laws outside the catalogue are tried. Raises StudyError for unsuitable
    recordings."""
    has_time_left, guard = time_budget_and_guard  # the time limit of the search, and the guard that catches crashes
    excluded_names = list_excluded_laws(excluded_effects, discovery)

    def fit_by_balance() -> FirstModel | None:
        return fit_without_model.fit_first_model(
            diagnosis_input.recordings, excluded_names, has_time_left, on_progress, map_forked
        )

    with _translate_refusals():
        balance_model = guard.run(BALANCE, "the first model", fit_by_balance, None, (NothingToDiagnoseError,))
    return balance_model or FirstModel(
        *fit_linear_model(
            diagnosis_input, lambda share: on_progress("fitting a linear model", share), time_left=has_time_left
        ),
        (),
    )


def fit_linear_model(
    diagnosis_input: DiagnosisInput,
    on_progress: Callable[[float], None],
    origin: str = "these recordings",
    time_left: TimeBudget = lambda: True,
) -> tuple[MechanicalModel, tuple[str, ...]]:
    """Fit a linear model to forces or spectra. Returns the model and remarks. on_progress: called with the completed
    share, 0 to 1. origin: of the recordings, for the model's name. time_left: time limit of the fit. Raises StudyError
    for unsuitable recordings."""
    with _translate_refusals():
        return fit_without_model.fit_first_linear_model(diagnosis_input.recordings, on_progress, origin, time_left)


@contextmanager
def _translate_refusals() -> Iterator[None]:
    """Convert `NothingToDiagnoseError` into a StudyError with the same problems and `MODEL_REMEDY`."""
    try:
        yield
    except NothingToDiagnoseError as refusal:
        raise make_not_diagnosable_error(refusal.problems, MODEL_REMEDY) from refusal
