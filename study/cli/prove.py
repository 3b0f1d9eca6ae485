"""Command `hapteq prove`: blind test of the diagnosis on simulated devices with concealed effects or laws.

Options and output only; `study.evaluation.bank` draws, seals and diagnoses the devices and writes the results.
"""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

import typer

from study.cli.results import JsonOption, print_summary
from study.cli.scheduler import SchedulerOption, connect_cluster
from study.cli.seed import check_seed

if TYPE_CHECKING:
    from study.evaluation.bank.seal_cases import BankPlan
    from study.evaluation.bank.sealed_bank import BankOptions

Result = TypeVar("Result")
"""Result of a blind test."""


def prove(
    out: Annotated[Path, typer.Option(help="Folder of the bank and the results; new, or one to be continued.")],
    cases: Annotated[int, typer.Option(min=1, max=100_000, help="How many devices are drawn.")] = 40,
    seed: Annotated[
        int, typer.Option(min=0, callback=check_seed, help="Seed of all draws but the salt of the labels.")
    ] = 1,
    workers: Annotated[int, typer.Option(min=1, max=64, help="Processes at work at once.")] = 2,
    scheduler: SchedulerOption = None,
    brief: Annotated[bool, typer.Option("--brief", help="Short recordings: a quick look.")] = False,
    controls: Annotated[
        bool,
        typer.Option("--controls", help="Also check which answers must change and which must not; takes minutes more."),
    ] = False,
    laws: Annotated[bool, typer.Option("--laws", help="Conceal laws that no catalogue names.")] = False,
    keep: Annotated[bool, typer.Option("--keep", help="Keep the recordings, 1 to 4 MB each.")] = False,
    table: Annotated[Path | None, typer.Option(help="A small table of the figures, CSV, to be kept.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Conceal physics in simulated devices, seal what it is, diagnose them blind, and count.

    Writes proof.json, proof.csv and report.html. Interrupted, the same command continues.
    """
    from study.evaluation.bank.proof_summary import format_blind_test, summarise_blind_test
    from study.evaluation.bank.prove import prove as run_blind_test
    from study.evaluation.bank.seal_cases import BankPlan
    from study.evaluation.bank.sealed_bank import BankOptions
    from study.evaluation.bank.write_proof import write_proof, write_table

    if laws and controls:
        raise typer.BadParameter("The bank of laws has no controls: leave --controls or --laws out.")
    plan = BankPlan(seed, cases, brief)
    with connect_cluster(scheduler) as cluster:
        options = BankOptions(workers, keep, controls, cluster)
        if laws:
            _prove_laws(out, plan, options, table, as_json)
            return
        proof = _run_with_steps(lambda on_step: run_blind_test(out, plan, options, on_step))
    write_proof(proof)
    if table is not None:
        write_table(table, proof)
    print_summary(summarise_blind_test(proof), format_blind_test(proof), as_json)


def _prove_laws(out: Path, plan: "BankPlan", options: "BankOptions", table: Path | None, as_json: bool) -> None:
    """Run the blind test with laws that no catalogue names, write its results, and print them. table: CSV file of the
    figures to write; None = none."""
    from study.evaluation.bank.laws.prove_laws import prove_laws
    from study.evaluation.bank.laws.write_law_proof import (
        format_law_lines,
        summarise_law_blind_test,
        write_law_proof,
        write_law_table,
    )

    law_proof = _run_with_steps(lambda on_step: prove_laws(out, plan, options, on_step))
    write_law_proof(law_proof)
    if table is not None:
        write_law_table(table, law_proof)
    print_summary(summarise_law_blind_test(law_proof), format_law_lines(law_proof), as_json)


def _run_with_steps(run_test: Callable[[Callable[[str, int, int], None]], Result]) -> Result:
    """Run the test with a progress display, and return its result. run_test: called with a callback (name of the step,
    its number, total)."""
    from study.cli.progress import show_steps

    with show_steps("Proving") as show_step:
        return run_test(
            lambda step_name, step, total: show_step(f"{step_name} {step} of {total}", step / max(total, 1))
        )
