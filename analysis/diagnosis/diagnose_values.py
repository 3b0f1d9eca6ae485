"""The whole diagnosis as one call of values: recordings in, findings out, with a model or without one."""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.data.command_gaps import across_gaps
from analysis.diagnosis.data.force_driven import all_force_driven
from analysis.diagnosis.data.found_segments import with_found_segments
from analysis.diagnosis.data.input_checks import require_alike, require_model_of
from analysis.diagnosis.diagnose import DiagnosisSettings, diagnose
from analysis.diagnosis.first_model.fitted_first import first_model_of
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

    recordings: of one device, alike in channels, units and rate. model: None = a first one is fitted to them.
    settings: what is left out of the search, clean recordings of the device, what is compared. map_: as `map`, may run
    in parallel. progress(what is being done, share done). Raises NothingToDiagnose with what is wrong in the
    recordings, NothingLearned where clean recordings say nothing of these.
    """
    given = (recordings,) if isinstance(recordings, Recording) else tuple(recordings)
    settings = settings or DiagnosisSettings()
    names = settings.names or tuple(f"recording {number}" for number in range(1, len(given) + 1))
    require_alike(given, names)
    found = [with_found_segments(each) for each in given]
    formed, said = plain_form(tuple(each for each, _ in found)) if model is None else (tuple(e for e, _ in found), ())
    driven, gaps = across_gaps(all_force_driven(formed), names)
    remarks = (*(text for _, text in found if text), *said, *gaps)
    settings = replace(settings, names=names)
    if model is None:
        first = first_model_of(driven, settings.without, settings.time_left, progress)
        model, remarks = first.model, (*remarks, *first.remarks)
        settings = replace(settings, fitted=True, balances=first.balances)
    else:
        require_model_of(model, driven)
    findings = diagnose(driven, model, settings, map_, progress)
    return replace(findings, remarks=(*remarks, *findings.remarks))
