"""Command `hapteq power`: power analysis of a protocol by Monte-Carlo simulation of whole studies.

Reads the protocol, makes the population from the options, simulates the studies on worker processes or a cluster
(`study.workflows.planning.simulate_power`), and prints the power for each sample size. With --compare it prints the
errors of staircase rules on the same simulated people instead.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from study.cli.results import JsonOption
from study.cli.scheduler import SchedulerOption
from study.cli.seed import check_seed
from study.errors import WrongUseError

if TYPE_CHECKING:
    from analysis.psychophysics.power.felt_delivery import FeltDelivery
    from analysis.psychophysics.power.power_curve import PowerPoint
    from analysis.psychophysics.power.simulated_study import Crowd
    from protocols.definition.staircase_rule import StaircaseRule
    from protocols.definition.study_protocol import StudyProtocol
    from study.workflows.planning.simulate_power import PowerPlan

EffectOption = Annotated[
    float,
    typer.Option(
        min=-40,
        max=40,
        help="True difference of the declared contrast's first frequency from its second (none declared: of the "
        "highest from the lowest); 0 gives the type-1 error.",
    ),
]
CurveOption = Annotated[
    str, typer.Option(help="Curve of the people: weibull, logistic or gauss; the analysis assumes weibull.")
]
LapseOption = Annotated[float, typer.Option(min=0, max=0.3, help="Lapse rate of the people.")]
PeopleOption = Annotated[
    str,
    typer.Option(
        help="attentive; some-guess (one in ten guesses); repeating (all ask again when unsure, as often as the "
        "protocol allows); criterion-drift (the response bias drifts)."
    ),
]

CompareOption = Annotated[
    bool,
    typer.Option(
        "--compare",
        help="Compare rules instead: one run of each of --studies people at --threshold-n, under the protocol's "
        "staircase with each reading of its steps and under Psi, on the same draws; prints the error per trial.",
    ),
]
DeliveredOption = Annotated[
    Path | None,
    typer.Option(
        metavar="DATA",
        help="Sessions on a device (hapteq rehearse --subjects 1 makes one on the simulated omega.3): people feel what "
        "was delivered there, along and across, with harmonics, and get numb. [default: they feel the command]",
    ),
]


def power(
    subjects: Annotated[str, typer.Option(help="Sample sizes: 5:40:5 (from, to, step), or one number.")] = "5:40:5",
    effect_db: EffectOption = 3.0,
    threshold_n: Annotated[float, typer.Option(min=0.01, max=100, help="Median at the other frequencies, in N.")] = 0.7,
    studies: Annotated[int, typer.Option(min=10, max=100_000, help="Simulated studies of each size.")] = 200,
    workers: Annotated[int, typer.Option(min=1, max=64, help="Processes at work at once.")] = 2,
    scheduler: SchedulerOption = None,
    protocol: Annotated[str, typer.Option(help="Protocol with staircase and frequencies.")] = "direction_threshold",
    out: Annotated[Path, typer.Option(help="Folder of results; an interrupted run continues there.")] = Path("power"),
    curve: CurveOption = "weibull",
    lapse: LapseOption = 0.02,
    people: PeopleOption = "attentive",
    delivered: DeliveredOption = None,
    compare: CompareOption = False,
    seed: Annotated[int, typer.Option(min=0, callback=check_seed, help="Seed of all draws.")] = 1,
    as_json: JsonOption = False,
) -> None:
    """Simulate whole studies and count how often each analysis finds the difference. Run again, it continues."""
    from study.cli.progress import show_bar
    from study.store.formats.protocol_files import read_study_protocol
    from study.workflows.cluster import open_cluster_workers
    from study.workflows.planning.simulate_power import PowerPlan, simulate_power
    from study.workflows.worker_processes import open_worker_processes

    design = read_study_protocol(protocol, Path()).protocol
    crowd = _make_crowd(design, threshold_n, effect_db)
    crowd = _apply_person_options(crowd, people, curve, lapse, design.trial.repeats_per_run)
    crowd = replace(crowd, delivery=_read_delivery(delivered, crowd.frequencies_hz), rove_db=design.stimulus.rove_db)
    if compare:
        _print_comparison(crowd, design.staircase, studies, seed, as_json)
        return
    sizes = parse_sample_sizes(subjects)
    plan = PowerPlan(crowd, design.staircase, sizes, studies, seed, design.analysis.contrast_hz)
    title = f"{studies} studies of each of {len(sizes)} sizes"
    executor = open_worker_processes(workers) if scheduler is None else open_cluster_workers(scheduler)
    with executor as pool, show_bar(title, total=studies * len(sizes)) as advance:
        points = simulate_power(plan, out, pool, advance)
    if as_json:
        typer.echo(json.dumps([asdict(point) for point in points], indent=2))
        return
    typer.echo("\n".join((*_format_table(points, plan), f"Figure: {out / 'figures' / 'power.png'}")))


def _print_comparison(crowd: "Crowd", rule: "StaircaseRule", person_count: int, seed: int, as_json: bool) -> None:
    """Print bias, standard deviation and error of each rule on the same simulated people, one run each; without the
    habits of --people and without delivery. person_count: number of people."""
    from analysis.psychophysics.power.compare_rules import compare_rules, list_compared_rules
    from analysis.psychophysics.power.staircase_kernel import MOST_TRIALS
    from analysis.wording import MISSING

    results = compare_rules(crowd, list_compared_rules(rule), person_count, seed)
    if as_json:
        typer.echo(json.dumps([asdict(result) for result in results], indent=2))
        return
    typer.echo(f"{'rule':42}{'trials':>7}{'bias':>8}{'sd':>7}{'error':>8}  error x sqrt(trials), dB")
    for row in results:
        errors_db = (row.bias_db, row.sd_db, row.error_db, row.error_per_trial_db)
        error_texts = [
            f"{MISSING:>{width}}" if error_db is None else f"{error_db:{sign}{width}.{digits}f}"
            for error_db, (sign, width, digits) in zip(
                errors_db, (("+", 8, 2), ("", 7, 2), ("", 8, 2), ("", 10, 1)), strict=True
            )
        ]
        typer.echo(f"{row.rule:42}{row.trials:7.1f}{''.join(error_texts)}")
    typer.echo(f"{person_count} people, the same under every rule; errors of single runs in dB, root mean square.")
    if stopped_rows := [f"{person_count - row.runs} ({row.rule})" for row in results if row.runs < person_count]:
        typer.echo(
            f"Runs stopped by the trial limit, or without an end in {MOST_TRIALS} trials, have no threshold and no "
            f"error: {'; '.join(stopped_rows)}."
        )
    if crowd.rove_db:
        typer.echo(f"Roved by {crowd.rove_db:g} dB, as the protocol says; Psi's levels are not roved.")
    if crowd.guessers or crowd.criterion_drift_sd or crowd.unsure or crowd.delivery is not None:
        typer.echo(
            "--people and --delivered have no influence on this comparison: people are attentive and feel "
            "the commanded force."
        )


def _make_crowd(protocol: "StudyProtocol", threshold_n: float, effect_db: float) -> "Crowd":
    """Make a population whose median threshold is threshold_n (N) at all frequencies but the first of the compared
    pair, where it is higher by effect_db (dB). Raises WrongUseError for a protocol with fewer than two frequencies."""
    from analysis.psychophysics.power.power_curve import find_judged_pair
    from analysis.psychophysics.power.simulated_study import Crowd

    frequencies_hz = tuple(sorted(protocol.stimulus.frequencies_hz))
    if len(frequencies_hz) < 2:
        raise WrongUseError(
            "There is nothing to compare",
            f"{protocol.name} plays fewer than two frequencies.",
            "Choose a protocol with two or more in stimulus.frequencies_hz.",
        )
    changed_n = threshold_n * 10.0 ** (effect_db / 20.0)
    changed_hz, _ = find_judged_pair(frequencies_hz, protocol.analysis.contrast_hz)
    return Crowd(
        frequencies_hz,
        tuple(changed_n if frequency_hz == changed_hz else threshold_n for frequency_hz in frequencies_hz),
    )


def _format_table(points: Sequence["PowerPoint"], plan: "PowerPlan") -> list[str]:
    """Format the lines of the result: power for each sample size, the compared frequencies, roving, and what counts
    where both medians are above the cap."""
    from analysis.psychophysics.hierarchy.primary import FAR_ABOVE_DB
    from analysis.threshold_words import select_threshold_words
    from study.workflows.planning.simulate_power import format_power_lines

    first_hz, second_hz = plan.pair_hz
    contrast_text = (
        "the declared contrast" if plan.contrast_hz else "the highest frequency and the lowest; no contrast is declared"
    )
    comparison_text = f"Compared: {first_hz:g} Hz minus {second_hz:g} Hz, {contrast_text}."
    roving_lines = [f"Levels roved by {plan.crowd.rove_db:g} dB, as the protocol says."] if plan.crowd.rove_db else []
    medians_n = dict(zip(plan.crowd.frequencies_hz, plan.crowd.medians_n, strict=True))
    above_cap_text = (
        f"Both medians lie above the cap of {plan.rule.cap_n:g} N. Where the model puts both more than "
        f"{FAR_ABOVE_DB:g} dB above it, a report gives neither the difference nor its interval: this counts as not "
        "found and not covered."
    )
    above_cap_lines = [above_cap_text] if min(medians_n[first_hz], medians_n[second_hz]) > plan.rule.cap_n else []
    power_lines = format_power_lines(points, select_threshold_words(plan.rule).noun)
    return [*power_lines, "", comparison_text, *roving_lines, *above_cap_lines]


def _read_delivery(data: Path | None, frequencies_hz: tuple[float, ...]) -> "FeltDelivery | None":
    """Read the delivery of a device from the sessions in a folder; None without a folder. Raises StudyError where the
    sessions contain no measured trials of both directions at a frequency."""
    if data is None:
        return None
    from analysis.psychophysics.power.felt_delivery import tabulate_felt_delivery
    from study.participants.delivered_feeler import MPS2_PER_N
    from study.participants.psychometric_curve import interpolate_threshold_n
    from study.workflows.results.collect_sessions import collect_sessions

    ideal_thresholds = [interpolate_threshold_n(MPS2_PER_N, frequency_hz) for frequency_hz in frequencies_hz]
    try:
        return tabulate_felt_delivery(collect_sessions(data).trials, frequencies_hz, ideal_thresholds)
    except ValueError as problem:
        raise WrongUseError(
            "It is not known what the device delivers",
            f"In {data} there are {problem}.",
            "Give sessions of the same frequencies whose acceleration was measured, or leave --delivered out.",
        ) from problem


def _apply_person_options(crowd: "Crowd", people: str, curve: str, lapse: float, repeats: int) -> "Crowd":
    """Apply the options on people to the population: habits, curve and lapse rate. repeats: most repeats in a run. The
    numbers of the habits are chosen: a guessing share of 0.1; repeats within 0.5 standard errors of the criterion; a
    criterion's drift per 100 trials with a standard deviation between people of 0.3 (d'). Raises WrongUseError for an
    unknown curve or kind of people."""
    from analysis.psychophysics.hierarchy.curve import Family

    crowds_by_habit: dict[str, Crowd] = {
        "attentive": crowd,
        "some-guess": replace(crowd, guessers=0.1),
        "repeating": replace(crowd, unsure=0.5, repeats=repeats),
        "criterion-drift": replace(crowd, criterion_drift_sd=0.3),
    }
    for option, name, choices in (
        ("--people", people, list(crowds_by_habit)),
        ("--curve", curve, [curve_family.value for curve_family in Family]),
    ):
        if name not in choices:
            raise WrongUseError(
                "There are no such people", f"{option} is {name}.", f"Choose one of {', '.join(choices)}."
            )
    return replace(crowds_by_habit[people], family=Family(curve), lapse=lapse)


def parse_sample_sizes(text: str) -> tuple[int, ...]:
    """Parse sample sizes from:to:step, both limits included: "5:40:5" gives 5, 10 ... 40. Without to: one size; without
    step: 1. Raises WrongUseError for any other text, sizes outside 2 to 1000, falling limits, and a step of 0."""
    numbers = (
        [int(number_text) for number_text in text.split(":")] if re.fullmatch(r"\d{1,4}(:\d{1,4}){0,2}", text) else []
    )
    smallest = numbers[0] if numbers else 0
    largest = numbers[1] if len(numbers) > 1 else smallest
    step = numbers[2] if len(numbers) > 2 else 1
    if smallest < 2 or largest < smallest or step < 1 or largest > 1000:
        raise WrongUseError(
            "These are no sample sizes",
            f"--subjects is {text}.",
            "Write a number from 2 to 1000, or from:to:step, such as 5:40:5.",
        )
    return tuple(range(smallest, largest + 1, step))
