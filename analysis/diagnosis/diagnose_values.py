"""Diagnose recordings in one function of values: recordings in, findings out, with or without a model.

This is `analysis.diagnose` of the Python interface.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import get_args

from analysis.diagnosis.balance.laws.free_laws import FREE_LAWS, list_excluded_laws
from analysis.diagnosis.data.input_checks import NothingToDiagnoseError, require_comparable, require_model_of
from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.effect_words import LAW_WORDS
from analysis.diagnosis.errors.choose_measure import Compared
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.first_model.fit_without_model import fit_first_linear_model, fit_first_model
from analysis.diagnosis.prepare_recordings import keep_common_signals, prepare_recordings
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.types import Mapper, Progress
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording


def _ignore_progress(step: str, share: float) -> None:
    """Do nothing: the default where no progress is shown."""


def diagnose_values(
    recordings: Recording | Sequence[Recording],
    model: MechanicalModel | None = None,
    settings: DiagnosisSettings | None = None,
    map_: Mapper = map,
    progress: Progress = _ignore_progress,
) -> Findings:
    """Find the physics that a model of the device lacks.

    recordings: of one device, alike in channels, units and rate. model: None = a linear model is fitted to them, or to
    the clean recordings where there are any. settings: None = the defaults. map_: as `map`, may run in parallel.
    progress: receives a description of the current step and the share of it that is done, 0 to 1. Raises
    NothingToDiagnoseError with the errors in the recordings, the model or the settings, IncomparableRecordingsError
    where clean recordings cannot be compared with them."""
    recording_list = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    settings = settings or DiagnosisSettings()
    _require_valid_settings(settings, len(recording_list))
    names = settings.names or tuple(f"recording {number}" for number in range(1, len(recording_list) + 1))
    clean_names = tuple(f"clean recording {number}" for number in range(1, len(settings.clean) + 1))
    require_comparable((*recording_list, *settings.clean), (*names, *clean_names))
    prepared = prepare_recordings(recording_list, names, model is None and not settings.clean)
    clean = prepare_recordings(settings.clean, clean_names, False).recordings if settings.clean else ()
    common_signals = keep_common_signals((*prepared.recordings, *clean))
    compared_recordings = common_signals.recordings[: len(recording_list)]
    settings = replace(settings, names=names, clean=common_signals.recordings[len(recording_list) :])
    if model is None:
        first_model = _fit_first_model(compared_recordings, settings, map_, progress)
        settings = replace(settings, fitted=True, balances=first_model.balances)
    else:
        require_model_of(model, compared_recordings)
        first_model = FirstModel(model, ())
    if settings.compared == "force" and not all(has_motion(each, first_model.model) for each in compared_recordings):
        raise NothingToDiagnoseError(
            ("forces cannot be compared: neither positions nor velocities of every driven axis were measured",)
        )
    findings = diagnose(compared_recordings, first_model.model, settings, map_, progress)
    first_remarks = first_model.list_remarks(findings.given, findings.diagnosis.error)
    return replace(findings, remarks=(*prepared.remarks, *common_signals.remarks, *first_remarks, *findings.remarks))


def _require_valid_settings(settings: DiagnosisSettings, recording_count: int) -> None:
    """Raise NothingToDiagnoseError for names that are not one per recording, effects to leave out that neither the
    catalogue nor the laws of the force balance nor the kept laws contain, and an unknown comparison."""
    problems = []
    if settings.names and len(settings.names) != recording_count:
        problems.append(f"names has {len(settings.names)} entries for {recording_count} recordings; give one for each")
    known_effects = {*EFFECTS_BY_NAME, *LAW_WORDS, *FREE_LAWS, *(entry.name for entry in settings.kept)}
    if unknown_effects := [name for name in settings.without if name not in known_effects]:
        problems.append(f"there is no effect {', '.join(unknown_effects)} to leave out; see equalizer.EFFECTS")
    if settings.compared not in get_args(Compared):
        problems.append(f"compared is '{settings.compared}'; allowed are {', '.join(get_args(Compared))}")
    if problems:
        raise NothingToDiagnoseError(tuple(problems))


def _fit_first_model(
    recordings: Sequence[Recording], settings: DiagnosisSettings, map_: Mapper, progress: Progress
) -> FirstModel:
    """Fit a linear model, with remarks: to these recordings, with their force balances, or to the clean ones alone."""
    if not settings.clean:
        excluded = list_excluded_laws(settings.without, settings.discovery)
        return fit_first_model(recordings, excluded, settings.time_left, progress, map_)
    step = "fitting a linear model, as none was given"
    return FirstModel(
        *fit_first_linear_model(settings.clean, lambda share: progress(step, share), "the clean recordings")
    )
