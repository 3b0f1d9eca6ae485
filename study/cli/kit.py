"""Commands `hapteq kit`: a laboratory's own blind test of the diagnosis, on a device that is changed on purpose.

Three steps: `draw` writes a table with the changes in random order, `seal` hashes the completed table before the
diagnosis, `score` compares the diagnoses with it (docs/kit.md). Options and output only; `study.evaluation.kit` does
the work.
"""

from pathlib import Path
from typing import Annotated

import typer

from study.cli.command_table import Subcommands
from study.cli.seed import check_seed

app = typer.Typer(
    cls=Subcommands,
    add_completion=False,
    help="A blind test on your own device: draw what is changed, seal it, score it (docs/kit.md).",
    no_args_is_help=True,
    rich_markup_mode=None,
)

LabelsArgument = Annotated[Path, typer.Argument(metavar="LABELS.csv", help="The table of what was changed.")]


@app.command("draw")
def draw(
    out: Annotated[Path, typer.Option(help="The table to write, LABELS.csv; for the one who changes the device.")],
    repeats: Annotated[int, typer.Option(min=1, max=20, help="Of each change; nothing is changed twice as often.")] = 2,
    seed: Annotated[
        int | None, typer.Option(min=0, callback=check_seed, help="Of the order [default: drawn at random].")
    ] = None,
) -> None:
    """Draw the order of the changes. The person who diagnoses must not see it."""
    from analysis.evaluation.blind_test.lab_kit import CHANGES
    from study.evaluation.kit.lab_kit import draw_labels

    labels = draw_labels(out, repeats, seed)
    typer.echo(f"{len(labels)} recordings, {labels[0].recording} to {labels[-1].recording}: {out}")
    for change in CHANGES:
        number_request = f" Write down the number, in {change.unit}, where you know it." if change.unit else ""
        typer.echo(f"  {change.name}: {change.instruction}{number_request}")


@app.command("seal")
def seal(labels: LabelsArgument) -> None:
    """Hash the completed table. Give the hash to the person who diagnoses, and keep the table."""
    from study.evaluation.kit.lab_kit import seal_labels

    typer.echo(seal_labels(labels))


@app.command("score")
def score(
    labels: LabelsArgument,
    diagnoses: Annotated[Path, typer.Option(help="Folder with one diagnosis per recording, by its name.")],
    out: Annotated[Path, typer.Option(help="The table to write, SCORE.csv.")],
    seal: Annotated[
        str | None, typer.Option(metavar="HASH", help="The hash that was handed over before the diagnoses.")
    ] = None,
) -> None:
    """Compare the revealed table with the diagnoses. It must be the one that was sealed.

    Without --seal its hash is compared only with the file next to it. A recording without a diagnosis is not right.
    """
    from study.evaluation.kit.score_kit import format_score_lines, score_kit

    for line in format_score_lines(score_kit(labels, diagnoses, out, seal)):
        typer.echo(line)
