"""Trajectories of desired accelerations or commanded forces: parsing and formatting of their CSV tables.

A table has a header, the time in its first column (s) and constant time steps. Its header determines its kind:
accelerations of three axes, forces of three axes, or a transient along a single direction.
`study.store.formats.trajectory_file` reads and writes the files.
"""

import csv
import io
from dataclasses import dataclass, replace

import numpy as np

from equalizer.signals.listed_problems import ListedProblemsError
from equalizer.signals.signal import FloatArray, Signal

STEP_TOLERANCE = 0.01
"""Largest relative deviation of a time step from the mean step, for the rate to count as constant. Chosen."""
RATE_TOLERANCE = 1e-5
"""Largest relative difference of a rate from a whole number of hertz at which it is rounded to it, because printed time
stamps are rounded; also of two rates that count as equal. Chosen."""


class TableError(ListedProblemsError):
    """A CSV table is invalid. `problems`: one sentence each, with the line number where there is one."""


@dataclass(frozen=True, slots=True)
class TableKind:
    """Kind of a CSV table: its name, its header, and quantity and unit of all columns after the time."""

    name: str
    header: tuple[str, ...]
    quantity: str
    unit: str


TRAJECTORY = TableKind("trajectory", ("time_s", "ax", "ay", "az"), "acceleration", "m/s^2")
"""Desired accelerations along three axes."""
FORCES = TableKind("forces", ("time_s", "fx", "fy", "fz"), "force", "N")
"""Commanded forces along three axes."""
TRANSIENT = TableKind("transient", ("time_s", "a"), "acceleration", "m/s^2")
"""Acceleration along a single direction, which is chosen at playback."""
# The header identifies the kind of a table, so that all headers must differ.
TABLE_KINDS = (TRAJECTORY, FORCES, TRANSIENT)


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """Samples at a constant rate. Raises ValueError where quantity, unit or channels are not those of its kind."""

    signal: Signal
    """(n, 3): desired acceleration (m/s²) or commanded force (N); (n, 1) for a transient."""
    start_s: float = 0.0
    """Time of the first row (s): forces can have the same times as the accelerations from which they were computed."""

    @property
    def kind(self) -> TableKind:
        """Kind of the table, by quantity and channels: FORCES, TRANSIENT or TRAJECTORY."""
        if self.signal.quantity == FORCES.quantity:
            return FORCES
        return TRANSIENT if self.signal.channels == TRANSIENT.header[1:] else TRAJECTORY

    def __post_init__(self) -> None:
        kind = self.kind
        actual_kind = (self.signal.quantity, self.signal.unit, self.signal.channels)
        if actual_kind != (kind.quantity, kind.unit, kind.header[1:]):
            raise ValueError(
                f"a table of {kind.name} holds {kind.quantity} in {kind.unit}, channels "
                f"{', '.join(kind.header[1:])}, not {actual_kind[0]} in {actual_kind[1]}, channels "
                f"{', '.join(actual_kind[2])}"
            )


def parse_trajectory(text: str) -> Trajectory:
    """Parse a table of one of `TABLE_KINDS`. Raises TableError for text that is not CSV, an unknown header, rows
    without a finite number in every column, fewer than two rows, and time steps that are not constant."""
    try:
        rows = list(csv.reader(io.StringIO(text.rstrip())))
    except csv.Error as error:
        raise TableError((f"this is not CSV: {error}",)) from error
    header = tuple(name.strip() for name in rows[0]) if rows else ()
    kind = next((kind for kind in TABLE_KINDS if kind.header == header), None)
    if kind is None:
        allowed_headers = " or ".join(",".join(kind.header) for kind in TABLE_KINDS)
        raise TableError((f"line 1 reads '{','.join(header)}'; allowed is {allowed_headers}",))
    values_by_row = _read_numbers(rows[1:], kind)
    rate_hz = _find_rate_hz(values_by_row[:, 0])
    signal = Signal(values_by_row[:, 1:], rate_hz, kind.quantity, kind.unit, kind.header[1:])
    return Trajectory(signal, float(values_by_row[0, 0]))


def format_trajectory_csv(trajectory: Trajectory) -> str:
    """Format a trajectory as CSV text, from which `parse_trajectory` reads the same samples, if there are two rows or
    more. Raises TableError for NaN or infinite samples."""
    samples = trajectory.signal.samples
    if not np.isfinite(samples).all():
        raise TableError((f"a table of {trajectory.kind.name} cannot hold missing or infinite values",))
    lines = [",".join(trajectory.kind.header)]
    for index, row in enumerate(samples.tolist()):
        time_s = trajectory.start_s + index / trajectory.signal.sample_rate_hz
        lines.append(",".join(repr(value) for value in (time_s, *row)))
    return "\n".join(lines) + "\n"


def require_rate(trajectory: Trajectory, model_rate_hz: float) -> Trajectory:
    """Return a trajectory with exactly the sample rate of a model, `model_rate_hz`; that of a table is rounded. Raises
    TableError where the rates differ by more than `RATE_TOLERANCE`."""
    table_rate_hz = trajectory.signal.sample_rate_hz
    if abs(table_rate_hz - model_rate_hz) > RATE_TOLERANCE * model_rate_hz:
        raise TableError(
            (f"the rows are at {table_rate_hz:g} Hz, but the model is at {model_rate_hz:g} Hz; resample them to it",)
        )
    return replace(trajectory, signal=replace(trajectory.signal, sample_rate_hz=model_rate_hz))


def _read_numbers(rows: list[list[str]], kind: TableKind) -> FloatArray:
    """Read the numbers of the rows after the header, (n, columns), n >= 2. Raises TableError for fewer rows, and for
    invalid ones with at most six sentences."""
    column_count = len(kind.header)
    rows_of_values, problems = [], []
    for line, row in enumerate(rows, start=2):
        try:
            values = [float(field) for field in row]
        except ValueError:
            values = [np.nan]
        if len(row) != column_count:
            problems.append(f"line {line} has {len(row)} fields, but the header names {column_count}")
        elif not np.isfinite(values).all():
            problems.append(f"line {line} reads '{','.join(row)}'; every field must be a number")
        else:
            rows_of_values.append(values)
    if problems:
        summary_lines = [f"and {len(problems) - 5} lines more like these"] if len(problems) > 6 else []
        raise TableError((*problems[: 5 if summary_lines else 6], *summary_lines))
    if len(rows_of_values) < 2:
        raise TableError((f"there are {len(rows_of_values)} rows of numbers; a rate needs two or more",))
    return np.array(rows_of_values, dtype=np.float64)


def _find_rate_hz(time_s: FloatArray) -> float:
    """Find the sample rate (Hz) of rows at these times (n,), rounded to whole hertz within `RATE_TOLERANCE`. Raises
    TableError for times that do not increase and for steps that are not constant within `STEP_TOLERANCE`."""
    steps_s = np.diff(time_s)
    mean_step_s = float(time_s[-1] - time_s[0]) / len(steps_s)
    if mean_step_s <= 0 or (steps_s <= 0).any():
        row_index = int(np.argmax(steps_s <= 0))
        raise TableError((f"time_s does not grow at row {row_index + 2} (line {row_index + 3})",))
    deviation = np.abs(steps_s / mean_step_s - 1)
    if (deviation > STEP_TOLERANCE).any():
        row_index = int(np.argmax(deviation > STEP_TOLERANCE))
        raise TableError(
            (
                f"time_s is not at a constant rate: the step to row {row_index + 2} (line {row_index + 3}) is "
                f"{steps_s[row_index]:g} s, the mean step {mean_step_s:g} s; allowed is 1 % (write more digits, or "
                "resample)",
            )
        )
    rate_hz = 1 / mean_step_s
    rounded_hz = round(rate_hz)
    return float(rounded_hz) if rounded_hz and abs(rate_hz - rounded_hz) <= RATE_TOLERANCE * rounded_hz else rate_hz
