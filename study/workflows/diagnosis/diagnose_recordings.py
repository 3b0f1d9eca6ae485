"""Find the physics that a mechanical model lacks from recordings, and write the result folder (`hapteq diagnose`).

Steps: read the input, take or fit the model to compare with, add the virtual spring of a session, run the diagnosis
(`analysis.diagnosis.diagnose`), write the results.
"""

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from analysis.diagnosis.data.measured_motion import has_motion
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.choose_measure import Compared
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.types import Mapper, Progress, TimeBudget
from equalizer.effects.law_entry import LawEntry
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.linear_simulation import compute_driven_axes
from equalizer.plant.mechanical_model import MechanicalModel, suggest_word
from equalizer.signals.recording import Recording
from study.errors import WrongUseError
from study.store.disk.new_folder import create_new_folder, require_new_folder
from study.workflows.crash_guard import make_crash_guard
from study.workflows.diagnosis.diagnosis_input import (
    DiagnosisInput,
    convert_refusals,
    read_given_model,
    read_input,
)
from study.workflows.forked_map import map_forked, measure_processor_s

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance

READ_SHARE, FITTED_SHARE, DIAGNOSED_SHARE = 0.02, 0.2, 0.92
"""Share of progress (0 to 1, chosen) after reading, after fitting a model where none was given, after the diagnosis."""

TWIN_REMARK = (
    "No model was given. The session was compared with the simulated device's twin: a linear model, identified from "
    "recordings without a hand at the handle, as `hapteq twin` writes it."
)
"""Remark in the result where a session on the simulated device was diagnosed without a given model."""


@dataclass(frozen=True, slots=True)
class DiagnosePlan:
    """Arguments of a diagnosis: input files, output folder, and the options of `hapteq diagnose`."""

    sources: tuple[Path, ...]
    """Recordings, or one session's folder."""
    out: Path
    """A new or empty folder."""
    model: Path | None = None
    """Mechanical model to compare with; None: one is fitted, or identified from the simulated device."""
    excluded_effects: tuple[str, ...] = ()
    """Names of effects that are not considered."""
    clean: tuple[Path, ...] = ()
    """Reference recordings of the intact device, or one session's folder."""
    seed: int = 1
    """Seed of the draws: which trials of a session are used, and which are kept for the test."""
    compare: Compared = "auto"
    """Error measure: forces, motion, or chosen by rule."""
    effect_files: tuple[Path, ...] = ()
    """Files of laws found elsewhere, as `hapteq effect` writes them."""
    seconds: float | None = None
    """Processor time (s) after which the search ends with its best result; None: no limit."""
    discovery: bool = True
    """Whether laws outside the catalogue of effects are searched for too."""
    force_constants: tuple[float, ...] = ()
    """Force or torque per unit of a command (N or N m), where commands are not forces: for all, or for each."""


@dataclass(frozen=True, slots=True, eq=False)
class DiagnosedRecordings:
    """Findings of a diagnosis, and the folder into which its report was written."""

    findings: Findings
    out: Path


@dataclass(frozen=True, slots=True, eq=False)
class UnwrittenDiagnosis:
    """Result of a diagnosis (`run_diagnosis`) before it is written (`write_result_folder`)."""

    findings: Findings
    plan: DiagnosePlan
    parents: tuple[Path, ...]
    """Input files."""


class Engine(Protocol):
    """Signature of the function that diagnoses recordings against a model; `analysis.diagnosis.diagnose.diagnose`."""

    def __call__(
        self,
        recordings: Sequence[Recording],
        model: MechanicalModel,
        settings: DiagnosisSettings,
        map_: Mapper,
        progress: Progress,
    ) -> Findings: ...


def diagnose_recordings(plan: DiagnosePlan, on_progress: Progress, engine: Engine = diagnose) -> DiagnosedRecordings:
    """Run a diagnosis and write its folder. `on_progress(step, share)`, share 0 to 1. Raises StudyError for input that
    cannot be diagnosed; then, and if interrupted, no folder is written."""
    return write_result_folder(run_diagnosis(plan, on_progress, engine), on_progress)


def run_diagnosis(plan: DiagnosePlan, on_progress: Progress, engine: Engine = diagnose) -> UnwrittenDiagnosis:
    """Run a diagnosis without writing (first part of `diagnose_recordings`), so that its answer can be shown before the
    figures are drawn. Raises StudyError."""
    check_effect_names(plan.excluded_effects)
    require_new_folder(plan.out)
    on_progress("reading", 0.0)
    for_force_balance = plan.model is None and not plan.clean
    inputs, clean = _read_clean(plan, read_input(plan.sources, plan.seed, for_force_balance, plan.force_constants))
    file_laws = _read_effect_laws(plan.effect_files, inputs.recordings)
    on_progress("reading", READ_SHARE)
    has_time_left, guard = _start_time_budget(plan), make_crash_guard()
    # Half of the time for a first model with its force balance, so that the search has as much. Chosen.
    first_model = _choose_model(plan, inputs, clean, (_start_time_budget(plan, 0.5), guard), on_progress)
    # A model that was fitted to these recordings already contains the spring.
    spring_n_per_m = inputs.spring_n_per_m if plan.model is not None or inputs.simulated else 0.0
    model = add_spring(first_model.model, spring_n_per_m)
    start_share = FITTED_SHARE if plan.model is None else READ_SHARE
    _check_comparison(plan, inputs, model)
    settings = replace(
        _make_settings(plan, inputs, clean, first_model.balances), time_left=has_time_left, guard=guard, kept=file_laws
    )
    with convert_refusals(has_model=plan.model is not None):
        findings = engine(
            inputs.recordings, model, settings, map_forked, _scale_progress(on_progress, start_share, DIAGNOSED_SHARE)
        )
    first_remarks = first_model.list_remarks(findings.given, findings.diagnosis.error)
    findings = replace(
        findings,
        improved=add_spring(findings.improved, -spring_n_per_m),
        remarks=(*inputs.remarks, *describe_spring(spring_n_per_m), *first_remarks, *findings.remarks),
    )
    return UnwrittenDiagnosis(
        findings, plan, (*inputs.parents, *(() if clean is None else clean.parents), *filter(None, [plan.model]))
    )


def _read_clean(plan: DiagnosePlan, inputs: DiagnosisInput) -> tuple[DiagnosisInput, DiagnosisInput | None]:
    """Read the recordings of the intact device. Returns both inputs in the same form; None where the plan has none."""
    if not plan.clean:
        return inputs, None
    # Imported here: most diagnoses have no recordings of the intact device.
    from study.workflows.diagnosis.clean_recordings import read_clean_reference

    reduced_inputs = read_clean_reference(inputs, plan.sources, plan.clean, plan.seed)
    return reduced_inputs.diagnosed, reduced_inputs.clean


def write_result_folder(diagnosis: UnwrittenDiagnosis, on_progress: Progress) -> DiagnosedRecordings:
    """Write document, improved model, figures and page atomically (second part of `diagnose_recordings`). Raises
    StudyError where a file cannot be written or the participant of a diagnosed session withdrew meanwhile."""
    # Imported here because plotting is slow to import, and the answer comes first.
    from study.store.sessions.archive import require_consent
    from study.workflows.diagnosis.write_diagnosis import note_sessions, write_diagnosis_into

    on_progress("writing the report", DIAGNOSED_SHARE)
    plan = diagnosis.plan
    sessions = note_sessions((*plan.sources, *plan.clean), plan.out)
    with create_new_folder(plan.out) as folder:
        findings = write_diagnosis_into(folder, diagnosis.findings, diagnosis.parents)
        require_consent(sessions)
    on_progress("done", 1.0)
    return DiagnosedRecordings(findings, plan.out)


def _start_time_budget(plan: DiagnosePlan, share: float = 1.0) -> TimeBudget:
    """Make the test whether this share of the processor time is left, counted from now; always True without a limit."""
    start_s = measure_processor_s()
    return lambda: plan.seconds is None or measure_processor_s() - start_s < share * plan.seconds


def _make_settings(
    plan: DiagnosePlan, inputs: DiagnosisInput, clean: DiagnosisInput | None, balances: "tuple[Balance, ...] | None"
) -> DiagnosisSettings:
    """Make the settings of the diagnosis from the plan and its inputs."""
    return DiagnosisSettings(
        without=plan.excluded_effects,
        names=inputs.names,
        clean=() if clean is None else clean.recordings,
        fitted=plan.model is None and not inputs.simulated,
        balances=balances,
        compared=plan.compare,
        discovery=plan.discovery,
    )


def _read_effect_laws(paths: Sequence[Path], recordings: Sequence[Recording]) -> tuple[LawEntry, ...]:
    """Read the laws of effect files; empty without files. Raises StudyError."""
    if not paths:
        return ()
    from study.workflows.diagnosis.effect_file import read_entries

    return read_entries(paths, recordings)


def _check_comparison(plan: DiagnosePlan, inputs: DiagnosisInput, model: MechanicalModel) -> None:
    """Raise WrongUseError if the requested comparison is not possible."""
    if plan.compare == "force" and plan.clean:
        reason = "With --clean, hapteq chooses the comparison, so that both sets of recordings are measured alike."
    elif plan.compare == "force" and not all(has_motion(recording, model) for recording in inputs.recordings):
        reason = "Neither positions nor velocities of every driven axis were measured, so no force can be computed."
    else:
        return
    raise WrongUseError(
        "Forces cannot be compared", reason, "Leave --compare out, or ask for motion.", saved="Nothing was written."
    )


def check_effect_names(excluded_effects: Sequence[str]) -> None:
    """Check the names of effects to leave out. Raises WrongUseError for a name that no effect has."""
    for name in excluded_effects:
        if name not in EFFECTS_BY_NAME:
            raise WrongUseError(
                f"There is no effect '{name}' to exclude",
                f"The catalogue does not contain it{suggest_word(name, tuple(EFFECTS_BY_NAME))}.",
                f"Its names are {', '.join(EFFECTS_BY_NAME)}.",
                saved="Nothing was written.",
            )


def _choose_model(
    plan: DiagnosePlan,
    inputs: DiagnosisInput,
    clean: DiagnosisInput | None,
    limits: tuple[TimeBudget, Guard],
    on_progress: Progress,
) -> FirstModel:
    """Choose the model to compare with: the given one; for a session on the simulated device, its twin; with clean
    recordings, a linear model of these; otherwise a model fitted to the recordings themselves."""
    fit_progress = _scale_progress(on_progress, READ_SHARE, FITTED_SHARE)
    if plan.model is not None:
        return FirstModel(read_given_model(plan.model, inputs), ())
    if inputs.simulated:
        return FirstModel(_identify_twin(fit_progress), (TWIN_REMARK,))
    # Imported here: a given model needs no fit of a first one.
    from study.workflows.diagnosis.fit_without_model import fit_first_model, fit_linear_model

    if clean is None:
        return fit_first_model(inputs, plan.excluded_effects, limits, fit_progress, plan.discovery)
    step = "fitting a linear model, as none was given"
    on_progress(step, READ_SHARE)
    return FirstModel(*fit_linear_model(clean, partial(fit_progress, step), "the clean recordings", limits[0]))


def _identify_twin(on_progress: Progress) -> MechanicalModel:
    """Identify a linear model of the simulated device; its file is temporary."""
    from study.workflows.diagnosis.write_twin import TwinPlan, write_twin

    on_progress(step := "identifying the simulated device's twin", 0.0)
    with tempfile.TemporaryDirectory() as folder:
        return write_twin(TwinPlan(Path(folder) / "twin.toml"), lambda share: on_progress(step, share)).model


def _scale_progress(on_progress: Progress, start_share: float, end_share: float) -> Callable[[str, float], None]:
    """Make the progress callback of a step whose share 0 to 1 becomes `start_share` to `end_share` of the whole."""
    return lambda step, share: on_progress(step, start_share + (end_share - start_share) * min(max(share, 0.0), 1.0))


def add_spring(model: MechanicalModel, spring_n_per_m: float) -> MechanicalModel:
    """Return the model with stiffness K + k A A', k = spring_n_per_m of any sign; columns of A: the driven axes."""
    if spring_n_per_m == 0:
        return model
    axes = compute_driven_axes(model)
    return replace(model, stiffness=model.stiffness + spring_n_per_m * axes @ axes.T)


def describe_spring(spring_n_per_m: float) -> tuple[str, ...]:
    """Describe the virtual spring that was added to the model; empty for a stiffness of 0."""
    if spring_n_per_m == 0:
        return ()
    return (
        f"A virtual spring of {spring_n_per_m:.0f} N/m held the handle at its place. It was added to the model for the "
        "comparison, and is not in improved.toml.",
    )
