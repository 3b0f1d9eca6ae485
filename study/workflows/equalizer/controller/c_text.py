"""Export of a real-time controller as C source: its sizes and tables of numbers are inserted into templates.

Each number is the shortest decimal that a compiler reads back to the same double (`repr`), so that the C program
computes with exactly the numbers of the Python controller.
"""

from importlib.resources import files
from math import comb

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from equalizer.tracking.realtime.controller_cases import ControllerCases
from equalizer.tracking.realtime.realtime_controller import RealtimeController

# Files of an export: the controller, a loop that uses it, and a program that checks it.
HEADER, EXAMPLE, CHECK = "hapteq_controller.h", "example_loop.c", "check_controller.c"
A_LINE = 6
"""Numbers per line of a table."""
GROUP = 4
"""Rows and columns that a loop of the C code processes at once; matrices are padded to multiples of it."""


def header_text(controller: RealtimeController, description_lines: tuple[str, ...]) -> str:
    """C header with an exported controller. description_lines: lines that describe the model; they become a comment."""
    comment = "\n".join(f"/* {line.replace('*/', '* /')} */" for line in description_lines)
    return _source("controller.h").replace("@TABLES@", f"{comment}\n\n{_sizes(controller)}\n\n{_tables(controller)}")


def example_text() -> str:
    """C source of an example of a real-time loop that calls the controller."""
    return _source(EXAMPLE)


def check_text(cases: ControllerCases) -> str:
    """C source of a program that compares the compiled controller with these cases, inserted as tables: inputs, and the
    forces that the Python controller computed."""
    tables = (
        c_table("case_rotation", cases.rotations.reshape(len(cases), -1)),
        c_table("case_transient_force", cases.transient_forces),
        c_table("case_wanted", cases.wanted),
        c_table("case_low", cases.low),
        c_table("case_high", cases.high),
        c_table("case_stream_force", cases.stream_forces),
    )
    return _source(CHECK).replace("@CASES@", "\n".join((f"#define CASE_ROWS {len(cases)}", *tables)))


def c_table(name: str, values: npt.ArrayLike) -> str:
    """C definition of a constant array of double with this name and the shape of `values`."""
    numbers = np.asarray(values, dtype=np.float64)
    return f"static const double {name}{''.join(f'[{size}]' for size in numbers.shape)} = {_c_initializer(numbers)};"


def _c_initializer(numbers: FloatArray) -> str:
    """Initializer of an array in braces, nested by dimension."""
    if numbers.ndim > 1:
        return "{" + ",\n".join(_c_initializer(row) for row in numbers) + "}"
    texts = [repr(value) for value in numbers.tolist()]
    lines = [", ".join(texts[start : start + A_LINE]) for start in range(0, len(texts), A_LINE)]
    return "{" + ",\n".join(lines) + "}"


def _sizes(controller: RealtimeController) -> str:
    """Preprocessor definitions of rate (Hz), force cap (N) and array sizes."""
    problem, split, tracker = controller.problem, controller.split, controller.tracker
    has_low, has_high = split.edges.low_hz is not None, split.edges.high_hz is not None
    sizes: dict[str, str] = {
        "RATE_HZ": repr(float(problem.sample_rate_hz)),
        "CAP_N": repr(float(controller.cap_n)),
        "STATES": str(problem.order),
        "INPUTS": str(problem.inputs),
        "OUTPUTS": str(problem.outputs),
        "DEPTH": str(_pad_to_groups(problem.step).shape[0]),
        "WIDTH": str(_pad_to_groups(problem.step).shape[1]),
        "ROWS": f"{len(controller.transient)}L",
        "DIRECTIONS": str(controller.transient.g.shape[2]),
        "PREVIEW": str(len(tracker)),
        "HAS_LOW": str(int(has_low)),
        "HAS_HIGH": str(int(has_high)),
        "SPLITS": str(max(1, has_low + has_high)),
        "SPLIT_ORDER": str(split.order),
        "SPLIT_TERMS": str((split.order + 1) // 2),
    }
    return "\n".join(f"#define HAPTEQ_{name} {value}" for name, value in sizes.items())


def _tables(controller: RealtimeController) -> str:
    """Definitions of all tables: matrices of the model and the controller, and filters that split the band. The weights
    of the split are binomial coefficients, as in `CausalSplit`."""
    problem, split, tracker = controller.problem, controller.split, controller.tracker
    powers = range((split.order + 1) // 2, split.order + 1)
    tables = [
        c_table("hapteq_step", _pad_to_groups(problem.step)),
        c_table("hapteq_gains", controller.transient.K),
        c_table("hapteq_basis", controller.transient.g),
        c_table("hapteq_gain", tracker.K),
        c_table("hapteq_ahead", tracker.preview_gains),
        c_table("hapteq_split_weight", [comb(split.order, power) for power in powers]),
    ]
    for name, edge_hz in (("low", split.edges.low_hz), ("high", split.edges.high_hz)):
        if edge_hz is not None:
            numerator, denominator = split.one_pole(edge_hz)
            tables.append(c_table(f"hapteq_{name}_filter", [*numerator, denominator[1]]))
    return "\n".join(tables)


def _pad_to_groups(matrix: FloatArray) -> FloatArray:
    """The matrix, padded with zero rows and columns to multiples of `GROUP`."""
    return np.pad(matrix, [(0, -size % GROUP) for size in matrix.shape])


def _source(name: str) -> str:
    """Text of a template in this package."""
    return (files("study.workflows.equalizer.controller") / name).read_text("utf-8")
