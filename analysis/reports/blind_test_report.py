"""HTML report of a blind test: the diagnosis of simulated devices with concealed missing physics.

Wrong answers come first, each with the concealed effects and the diagnosis; then the scores with 95 % intervals, the
further experiments on ambiguous answers, the controls, figures, and the method. `analysis.evaluation.blind_test`
computes the scores.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate
from analysis.evaluation.blind_test.control_claims import ControlOutcome
from analysis.evaluation.blind_test.follow_up import FollowUp
from analysis.evaluation.blind_test.outcome import Outcome
from analysis.evaluation.blind_test.score import Score
from analysis.evaluation.blind_test.wording import (
    describe_answer,
    describe_concealed,
    describe_strengths,
    format_figure,
)
from analysis.figures.picture import Picture
from analysis.reports.page import Page, Section, Table, render_page

METHOD_PARAGRAPHS = (
    "Each device is simulated by a separate bench with its own integrator, step, friction law, sensor chain and "
    "small extras that no label names. It shares no code with the catalogue of the diagnosis. The model that comes "
    "with a recording is calibrated within its tolerances, or re-tuned to the device with the concealed effect, so "
    "that it hides the effect as far as possible.",
    "Labels were hashed with a salt before the first diagnosis (labels.sha256). The diagnosis ran in separate "
    "processes that were given the open folder only; they could not import the bench and could not open any other "
    "file of the test. Afterwards every label and every file of a case was compared with its hash.",
    "An effect is detectable where the error of the re-tuned model is more than 1.25 times the noise in some "
    "channel, on held-out samples. A diagnosis that failed counts as a miss.",
)
"""Section on the method; the factor 1.25 is `analysis.evaluation.blind_test.outcome.DETECTABLE_ERROR`."""


@dataclass(frozen=True, slots=True)
class BlindTestMetadata:
    """Origin of a blind test (seeds, hashes, versions), its remarks, its controls and its further experiments."""

    seeds: str
    """Seeds of the simulated devices, as text."""
    labels_sha256: str
    """SHA-256 of labels.sha256, the file with the hashes of the labels."""
    commit: str
    engines: tuple[str, ...]
    """Digests of the source code of the diagnosis."""
    remarks: tuple[str, ...]
    """Sentences for the banner of the report."""
    controls: tuple[ControlOutcome, ...] = ()
    """Controls: repeated diagnoses of altered recordings, whose change of the answer is known in advance."""
    follow_ups: tuple[FollowUp, ...] = ()
    """Ambiguous answers that were diagnosed again with a further recording."""


def render_blind_test_report(
    outcomes: Sequence[Outcome],
    score: Score,
    pictures: Sequence[Picture],
    metadata: BlindTestMetadata,
    provenance: Mapping[str, str],
    generated: str,
) -> str:
    """Render the report as an HTML page. outcomes: of all devices; score: of these outcomes. generated: local time of
    the report, as text; provenance: texts by name."""
    sections = (
        Section(f"Misses: {len(score.misses)}", tables=(_make_miss_table(score.misses),) if score.misses else ()),
        Section("Figures", tables=(_make_score_table(score),)),
        *_make_follow_up_sections(metadata.follow_ups),
        *_make_control_sections(metadata.controls),
        Section("Detection, confusions and calibration", pictures=tuple(pictures)),
        Section("Method", METHOD_PARAGRAPHS, points=_describe_reproduction(metadata)),
    )
    return render_page(
        Page(
            title="Blind test of the diagnosis on concealed physics",
            summary=f"{len(outcomes)} devices were diagnosed blind; {len(score.misses)} answers are wrong. "
            "All of them are listed.",
            banner=" ".join(metadata.remarks),
            sections=sections,
            generated=generated,
            provenance=provenance,
        )
    )


def _make_control_sections(controls: Sequence[ControlOutcome]) -> tuple[Section, ...]:
    """Make the section on the controls: changes with a known effect on the answer; empty without controls."""
    if not controls:
        return ()
    rows = tuple(
        (control.name, control.claim, "held" if control.held else "did not hold", "; ".join(control.said))
        for control in controls
    )
    table = Table("Altered recordings and their claims", ("control", "claim", "outcome", "diagnosis"), rows)
    return (Section("Controls", tables=(table,)),)


def _make_follow_up_sections(follow_ups: Sequence[FollowUp]) -> tuple[Section, ...]:
    """Make the section on ambiguous answers after the proposed and after a random further recording; empty without
    any."""
    if not follow_ups:
        return ()
    rows = tuple(
        (
            str(follow_up.number), follow_up.effect, ", ".join(follow_up.returned),
            follow_up.proposed or "no recording would decide",
            _describe_returned(follow_up.proposed, follow_up.after_proposed), follow_up.drawn or "-",
            _describe_returned(follow_up.drawn, follow_up.after_drawn),
        )
        for follow_up in follow_ups
    )  # fmt: skip
    header = ("number", "concealed", "names at first", "proposed", "names then", "random", "names then")
    notes = ("A random recording comes from the same menu, and may be the proposed one.",)
    table = Table("Single effects whose first recording left several names", header, rows, notes)
    return (Section("The next experiment", tables=(table,)),)


def _describe_returned(recorded: str, returned: Sequence[str]) -> str:
    """Describe the names returned after a further recording; "-" without one. recorded: the recording, as text."""
    return (", ".join(returned) or "no name") if recorded else "-"


def _describe_reproduction(metadata: BlindTestMetadata) -> tuple[str, ...]:
    """Describe in sentences how the test can be reproduced and checked."""
    return (
        f"Seeds {metadata.seeds}.",
        f"SHA-256 of labels.sha256: {metadata.labels_sha256}.",
        f"Commit {metadata.commit}; code of the diagnosis {', '.join(metadata.engines)}.",
        "sha256sum --check labels.sha256 checks the labels; proof.csv holds one row per device.",
    )


def _make_miss_table(misses: Sequence[Outcome]) -> Table:
    """Make the table of all wrong answers, with the largest ratio of error to noise of the re-tuned model and of the
    model with the named effects."""
    rows = tuple(
        (
            str(miss.number), f"{miss.kind}, {miss.bank}", describe_concealed(miss), describe_strengths(miss) or "-",
            describe_answer(miss),
            f"{miss.compute_worst_error('retuned'):.2f}", f"{miss.compute_worst_error('after'):.2f}",
        )
        for miss in misses
    )  # fmt: skip
    header = ("number", "kind, bank", "concealed", "strength", "diagnosis", "re-tuned / noise", "after / noise")
    return Table("Every wrong answer", header, rows)


def _make_score_table(score: Score) -> Table:
    """Make the table of all scores with 95 % intervals, the expected calibration error last."""
    calibration = score.calibration
    calibration_estimate = IntervalEstimate(
        "expected calibration error, 10 bins of equal count", calibration.error, calibration.low, calibration.high,
        sum(probability_bin.of for probability_bin in calibration.bins),
    )  # fmt: skip
    rows = tuple((estimate.name, format_figure(estimate)) for estimate in (*score.figures, calibration_estimate))
    notes = ("95 % intervals: Wilson for shares, else resampling. Singles, pairs and outside: detectable cases.",)
    return Table("Scores with 95 % intervals", ("score", "value"), rows, notes)
