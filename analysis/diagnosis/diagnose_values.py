"""The whole diagnosis as one call of values: recordings in, findings out, with a model or without one."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.data.command_gaps import across_gaps
from analysis.diagnosis.data.force_driven import all_force_driven
from analysis.diagnosis.data.found_segments import with_found_segments
from analysis.diagnosis.data.input_checks import (
    FEW_CYCLES,
    NothingToDiagnose,
    require_alike,
    require_different,
    require_model_of,
    require_something,
)
from analysis.diagnosis.diagnose import DiagnosisSettings, diagnose
from analysis.diagnosis.first_model.fitted_first import FirstModel, first_model_of, fitted_model
from analysis.diagnosis.first_model.plain_form import plain_form
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.types import Mapper, Progress
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording


def _untold(what: str, share: float) -> None:
    """No progress is shown."""


def diagnose_values(
    recordings: Recording | Sequence[Recording],
    model: MechanicalModel | None = None,
    settings: DiagnosisSettings | None = None,
    map_: Mapper = map,
    progress: Progress = _untold,
) -> Findings:
    """Which physics a model of the device lacks.

    recordings: of one device, alike in channels, units and rate. model: None = a first one is fitted to them, or to the
    clean ones where there are any. settings: what is left out of the search, clean recordings of the device, what is
    compared. map_: as `map`, may run in parallel. progress(what is being done, share done). Raises NothingToDiagnose
    with what is wrong in the recordings, NothingLearned where clean recordings say nothing of these.
    """
    given = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    settings = settings or DiagnosisSettings()
    names = settings.names or tuple(f"recording {number}" for number in range(1, len(given) + 1))
    clean_names = tuple(f"clean recording {number}" for number in range(1, len(settings.clean) + 1))
    require_alike((*given, *settings.clean), (*names, *clean_names))
    found, remarks = _prepared(given, names, model is None and not settings.clean)
    clean, _ = _prepared(settings.clean, clean_names, False) if settings.clean else ((), ())
    settings = replace(settings, names=names, clean=clean)
    if model is None:
        first = _first_model(found, settings, progress)
        model, remarks = first.model, (*remarks, *first.remarks)
        settings = replace(settings, fitted=True, balances=first.balances)
    else:
        require_model_of(model, found)
    findings = diagnose(found, model, settings, map_, progress)
    return replace(findings, remarks=(*remarks, *findings.remarks))


def _prepared(
    recordings: Sequence[Recording], names: tuple[str, ...], plain: bool
) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """In the form that errors are measured in, and what must be known of that. plain: one motion per force, as a force
    balance needs it, and few cycles are a remark. Raises NothingToDiagnose."""
    parts = [with_found_segments(each) for each in recordings]
    read, repeats = tuple(each for each, _ in parts), tuple(text for _, text in parts if text)
    formed, said = plain_form(read) if plain else (read, ())
    driven, gaps = across_gaps(all_force_driven(formed), names)
    few: tuple[str, ...] = ()
    try:
        require_different(driven, names)
        require_something(driven, names)
    except NothingToDiagnose as refusal:
        if not plain or not all(FEW_CYCLES in problem for problem in refusal.problems):
            raise
        few = refusal.problems
    return driven, (*repeats, *said, *gaps, *few)


def _first_model(recordings: Sequence[Recording], settings: DiagnosisSettings, progress: Progress) -> FirstModel:
    if not settings.clean:
        return first_model_of(recordings, settings.without, settings.time_left, progress)
    what = "fitting a linear model, as none was given"
    return FirstModel(*fitted_model(settings.clean, lambda share: progress(what, share), "the clean recordings"))
