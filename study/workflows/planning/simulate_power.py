"""Statistical power by number of participants, from simulated studies (`hapteq power`).

The studies are simulated and tested by `analysis.psychophysics.power` in chunks on any executor. Each finished chunk is
appended to `studies.jsonl`, so that an interrupted simulation continues; power.json and a figure are written last.
"""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from pathlib import Path

from analysis.psychophysics.power.power_curve import (
    PowerPoint,
    StudyVerdict,
    compute_true_difference_db,
    find_judged_pair,
    judge_study,
    summarise_power,
)
from analysis.psychophysics.power.simulated_study import Crowd
from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS
from analysis.threshold_words import REVERSAL_WORDS, select_threshold_words
from protocols.definition.staircase_rule import StaircaseRule
from study.errors import StudyError, WrongUseError
from study.store.disk.file_errors import convert_write_errors
from study.store.disk.json_document import write_json
from study.store.disk.privacy import make_folder
from study.store.disk.text_file import read_text, write_text
from study.workflows.run_on_executor import run_tasks

STUDIES_PER_CHUNK = 10
"""Number of studies in a task of a worker process. Chosen: a task takes some seconds, so that an interruption loses
little."""
LATER_CROWD_FIELDS = ("guessers", "criterion_drift_sd", "unsure", "repeats", "delivery", "rove_db")
"""Fields of `Crowd` that were added in later versions. They are left out of the stored plan while they have their
defaults, so that a folder from an earlier version can be continued."""
PROGRESS_NAME, RESULT_NAME = "studies.jsonl", "power.json"
"""File with the plan in its first line and a finished chunk in each further line; file with the results."""


@dataclass(frozen=True, slots=True)
class PowerPlan:
    """Input of `simulate_power`: model of the participants, staircase rule, sample sizes and number of studies."""

    crowd: Crowd
    rule: StaircaseRule
    people: tuple[int, ...]
    """Sample sizes: numbers of participants of a study."""
    studies: int
    """Number of studies of each size."""
    seed: int
    """Seed of the simulation; with sample size and number of a study it gives all draws of that study."""
    contrast_hz: tuple[float, ...] = ()
    """Two frequencies (Hz) of the declared contrast, first minus second; empty: the highest and the lowest
    frequency."""

    @property
    def pair_hz(self) -> tuple[float, float]:
        """The two frequencies (Hz) whose thresholds are compared, first minus second."""
        return find_judged_pair(self.crowd.frequencies_hz, self.contrast_hz)


StudyChunk = tuple[int, int]
"""Sample size, and number of the first study of a chunk, from 0."""


def simulate_power(
    plan: PowerPlan, folder: Path, executor: Executor, on_finished: Callable[[int], None]
) -> tuple[PowerPoint, ...]:
    """Simulate and test all studies; write power.json and figures/power into `folder`, and return power by sample size.
    on_finished: called with the number of finished studies. The same seed gives the same results on any executor;
    `folder` may contain an interrupted run.

    Raises WrongUseError for a trial limit without the Psi method and for runs that do not end, StudyError where
    `folder` belongs to another plan, and CannotWriteError."""
    if plan.rule.trial_limit and not plan.rule.is_bayesian:
        raise WrongUseError(
            "This staircase has a trial limit",
            "Runs that it stops have no threshold, and the published analysis cannot be judged without them.",
            "Set staircase.trial_limit to 0 in the protocol.",
        )
    progress_path = folder / PROGRESS_NAME
    verdicts_by_chunk = _read_finished_chunks(progress_path, plan)
    remaining_chunks = [
        (sample_size, first_study)
        for sample_size in plan.people
        for first_study in range(0, plan.studies, STUDIES_PER_CHUNK)
        if (sample_size, first_study) not in verdicts_by_chunk
    ]
    finished_count = sum(len(verdicts_by_chunk[chunk]) for chunk in verdicts_by_chunk if chunk[0] in plan.people)
    on_finished(finished_count)
    for chunk, verdicts in verdicts_by_chunk.items():
        if chunk[0] in plan.people:
            _require_ended_runs(verdicts)
    for chunk, verdicts in run_tasks(executor, judge_chunk, ((chunk, (plan, chunk)) for chunk in remaining_chunks)):
        verdicts_by_chunk[chunk] = verdicts
        _append_json_line(progress_path, {"piece": chunk, "verdicts": [asdict(verdict) for verdict in verdicts]})
        finished_count += len(verdicts)
        on_finished(finished_count)
        _require_ended_runs(verdicts)
    points = tuple(_summarise_size(verdicts_by_chunk, sample_size) for sample_size in plan.people)
    payload = {"plan": _summarise_plan(plan), "judged_hz": plan.pair_hz, "points": [asdict(point) for point in points]}
    write_json(folder / RESULT_NAME, "hapteq-power", 1, payload, overwrite=True)
    _write_figure(folder / "figures", plan, points)
    return points


def _summarise_size(verdicts_by_chunk: Mapping[StudyChunk, Sequence[StudyVerdict]], sample_size: int) -> PowerPoint:
    """Summarise the studies of one sample size."""
    # In the order of the plan, not in the order of finishing, so that rounding of sums is the same in every run.
    verdicts = [
        verdict
        for chunk in sorted(verdicts_by_chunk)
        if chunk[0] == sample_size
        for verdict in verdicts_by_chunk[chunk]
    ]
    return summarise_power(verdicts)


def _require_ended_runs(verdicts: Sequence[StudyVerdict]) -> None:
    """Raise WrongUseError where a run of the studies of a chunk did not end and so has no threshold."""
    unended_count = sum(math.isnan(verdict.means_error_db) for verdict in verdicts)
    if unended_count:
        raise WrongUseError(
            "Simulated runs did not end",
            f"In {unended_count} of {len(verdicts)} studies of {verdicts[0].people} people a run did not reach its "
            f"reversals in {MOST_TRIALS} trials.",
            "Set fewer staircase.reversals or a smaller staircase.down_after_right, or give a lower --threshold-n.",
            saved=f"The finished studies are kept in {PROGRESS_NAME}.",
        )


def _write_figure(folder: Path, plan: PowerPlan, points: Sequence[PowerPoint]) -> None:
    """Draw the power curves and write them into `folder`. Raises CannotWriteError."""
    # Imported here: workers, which draw nothing, would have to load Matplotlib, too.
    from analysis.figures.power_curves import make_power_picture
    from study.workflows.picture_files import write_pictures

    effect_db, threshold_name = (
        compute_true_difference_db(plan.crowd, plan.contrast_hz),
        select_threshold_words(plan.rule).noun,
    )
    write_pictures(folder, (make_power_picture(points, effect_db, plan.pair_hz, threshold_name),))


def judge_chunk(plan: PowerPlan, chunk: StudyChunk) -> list[StudyVerdict]:
    """Simulate and test the studies of one chunk: `STUDIES_PER_CHUNK`, or fewer at the end of a sample size."""
    sample_size, first_study = chunk
    end_study = min(first_study + STUDIES_PER_CHUNK, plan.studies)
    return [
        judge_study(plan.crowd, plan.rule, sample_size, (plan.seed, sample_size, study_number), plan.contrast_hz)
        for study_number in range(first_study, end_study)
    ]


def _summarise_plan(plan: PowerPlan) -> dict[str, object]:
    """Summarise the plan as JSON values, without its sample sizes: further sizes may be added to a folder later."""
    from pydantic import TypeAdapter

    rule = TypeAdapter(StaircaseRule).dump_python(plan.rule, mode="json")
    crowd = json.loads(json.dumps(asdict(plan.crowd)))
    for field_name in LATER_CROWD_FIELDS:
        if not crowd[field_name]:
            del crowd[field_name]
    plan_values = {"crowd": crowd, "rule": rule, "studies": plan.studies, "seed": plan.seed}
    # The default pair is not stored, so that a folder from a version without a choice of the pair can be continued.
    is_default_pair = plan.pair_hz == find_judged_pair(plan.crowd.frequencies_hz, ())
    return plan_values if is_default_pair else {**plan_values, "contrast_hz": list(plan.pair_hz)}


def _read_finished_chunks(path: Path, plan: PowerPlan) -> dict[StudyChunk, list[StudyVerdict]]:
    """Read the verdicts of an interrupted run of the same plan, by chunk. An incomplete line is ignored; where the file
    is missing, or ends within or after the first line, the plan, it is created anew. Raises StudyError for another
    plan, CannotReadError and CannotWriteError."""
    text = read_text(path) if path.exists() else ""
    if _format_plan_line(plan).startswith(text):
        _create_progress_file(path, plan)
        return {}
    rows = []
    for line in text.splitlines():
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    if not rows or rows[0] != json.loads(_format_plan_line(plan)):
        raise StudyError(
            "This folder holds another power simulation",
            f"{path} was begun with other people, another rule, contrast, seed or number of studies.",
            "Choose another folder with --out, or the same options to continue.",
            saved="Nothing was changed.",
        )
    return {
        (row["piece"][0], row["piece"][1]): [StudyVerdict(**verdict) for verdict in row["verdicts"]] for row in rows[1:]
    }


def _format_plan_line(plan: PowerPlan) -> str:
    """Format the first line of the file of finished studies: the plan in JSON."""
    return json.dumps({"plan": _summarise_plan(plan)})


def _create_progress_file(path: Path, plan: PowerPlan) -> None:
    """Create the folder and the file of finished studies with the plan. Raises CannotWriteError."""
    with convert_write_errors(path.parent):
        make_folder(path.parent)
    write_text(path, _format_plan_line(plan), overwrite=True)


def _append_json_line(path: Path, row: dict[str, object]) -> None:
    """Append a JSON object as a line. It begins with the line break, so that an incomplete line before it remains
    separate. Raises CannotWriteError."""
    with convert_write_errors(path), path.open("a", encoding="utf-8") as file:
        file.write("\n" * (file.tell() > 0) + json.dumps(row))


def format_power_lines(points: Sequence[PowerPoint], threshold_name: str = REVERSAL_WORDS.noun) -> list[str]:
    """Format a table for the terminal: power in percent with its 95 % interval, by sample size and analysis; coverage
    of the 95 % interval of the difference; bias in dB. threshold_name: name of the thresholds of single runs, in the
    plural."""
    paired_heading = f"{threshold_name}, paired"
    # 24 characters: the longest entry, "100.0 % (100.0 to 100.0)".
    paired_width = max(24, len(paired_heading))
    lines = [
        f"{'people':>6}  {'all answers in one model':>26}  {paired_heading:>{paired_width}}  "
        f"{'as published (Tukey)':>24}  {'95 % interval covers':>22}  bias dB (model, means)"
    ]
    for point in points:
        shares = (point.primary, point.means, point.published, point.coverage)
        share_texts = [
            f"{100 * share.value:.1f} % ({100 * share.lower:.1f} to {100 * share.upper:.1f})" for share in shares
        ]
        lines.append(
            f"{point.people:6}  {share_texts[0]:>26}  {share_texts[1]:>{paired_width}}  {share_texts[2]:>24}  "
            f"{share_texts[3]:>22}  {point.primary_bias_db:+.2f}, {point.means_bias_db:+.2f}"
        )
    return lines
