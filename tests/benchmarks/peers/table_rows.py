"""The table that is printed: one row for each way to identify."""

import statistics
import sys
from dataclasses import dataclass, field

from scores import Score


@dataclass
class Row:
    label: str
    scores: list[Score] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    assisted: bool = False

    def median(self, what: str) -> float:
        return statistics.median(getattr(score, what) for score in self.scores)

    @property
    def rms(self) -> float:
        return statistics.median(score.rms[0] for score in self.scores)

    @property
    def usable(self) -> bool:
        """Stable each time: can be simulated, and so drive a device."""
        return bool(self.scores) and not self.failures and all(score.stable for score in self.scores)


def report(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


COLUMNS = ("seeds", "states", "CPU s", "stable", "rho", "rms", "worst", "line", "held out", "worst")
HEAD = f"{'':54}" + "".join(f"{name:>9}" for name in COLUMNS)


def shown(row: Row) -> None:
    """Medians over seeds, and the worst of them; the largest pole of all, the worst line of all."""
    if row.scores:
        held_out = [score.held_out for score in row.scores] if row.usable else [float("nan")]
        cells = (
            str(len(row.scores)),
            str(row.scores[0].states or "-"),
            f"{row.median('cpu_s'):.2f}",
            f"{sum(score.stable for score in row.scores)}/{len(row.scores)}" if row.scores[0].states else "-",
            f"{max(score.radius for score in row.scores):.5f}" if row.scores[0].states else "-",
            percent(row.rms),
            percent(max(score.rms[0] for score in row.scores)),
            percent(max(score.worst_line for score in row.scores)),
            percent(statistics.median(held_out)),
            percent(max(held_out)),
        )
        report(f"{row.label:54}" + "".join(f"{cell:>9}" for cell in cells))
    for failure in sorted(set(row.failures)):
        report(f"{row.label:54} {row.failures.count(failure)} x failed: {failure}")


def percent(share: float) -> str:
    if share != share:
        return "-"
    return f"{100 * share:.3f}%" if share < 10 else f"{100 * share:.0e}%"
