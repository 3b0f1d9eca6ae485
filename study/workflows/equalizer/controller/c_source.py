"""Export of a real-time controller as C source: its sizes and tables of numbers are inserted into templates.

Each number of a table is the shortest decimal that a compiler reads back to the same double (`repr`), so that the C
program computes with exactly the numbers of the Python controller.
"""

from importlib.resources import files
from math import comb

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from equalizer.tracking.realtime.controller_cases import ControllerCases
from equalizer.tracking.realtime.realtime_controller import RealtimeController

HEADER_NAME, EXAMPLE_NAME, CHECK_NAME = "hapteq_controller.h", "example_loop.c", "check_controller.c"
"""File names of an export: the controller, a loop that uses it, and a program that checks it."""
NUMBERS_PER_LINE = 6
"""Numbers per line of a table (chosen, for readable lines)."""
BLOCK_SIZE = 4
"""Number of rows that a loop of the C code processes together; the step matrix is padded to multiples of it. The
template `controller.h` uses the same number."""


def format_header(controller: RealtimeController, description_lines: tuple[str, ...]) -> str:
    """Format the C header with the controller. description_lines: lines that describe the model; they become a
    comment."""
    comment = "\n".join(f"/* {line.replace('*/', '* /')} */" for line in description_lines)
    return _read_template("controller.h").replace(
        "@TABLES@", f"{comment}\n\n{_format_macros(controller)}\n\n{_format_tables(controller)}"
    )


def read_example() -> str:
    """Read the C source of an example of a real-time loop that calls the controller."""
    return _read_template(EXAMPLE_NAME)


def format_check_program(cases: ControllerCases) -> str:
    """Format the C source of a program that checks the compiled controller against test cases, inserted as tables of
    inputs and of the forces (N) that the Python controller computed from them."""
    definitions = (
        format_c_table("case_rotation", cases.rotations.reshape(len(cases), -1)),
        format_c_table("case_transient_force", cases.transient_forces),
        format_c_table("case_wanted", cases.reference),
        format_c_table("case_low", cases.low),
        format_c_table("case_high", cases.high),
        format_c_table("case_stream_force", cases.stream_forces),
    )
    return _read_template(CHECK_NAME).replace("@CASES@", "\n".join((f"#define CASE_ROWS {len(cases)}", *definitions)))


def format_c_table(name: str, values: npt.ArrayLike) -> str:
    """Format the C definition of a constant array of double with this name and with the shape of `values`."""
    numbers = np.asarray(values, dtype=np.float64)
    return (
        f"static const double {name}{''.join(f'[{length}]' for length in numbers.shape)} = "
        f"{_format_c_initializer(numbers)};"
    )


def _format_c_initializer(numbers: FloatArray) -> str:
    """Format the C initializer of an array, in braces that are nested by dimension."""
    if numbers.ndim > 1:
        return "{" + ",\n".join(_format_c_initializer(row) for row in numbers) + "}"
    number_texts = [repr(value) for value in numbers.tolist()]
    lines = [
        ", ".join(number_texts[start : start + NUMBERS_PER_LINE])
        for start in range(0, len(number_texts), NUMBERS_PER_LINE)
    ]
    return "{" + ",\n".join(lines) + "}"


def _format_macros(controller: RealtimeController) -> str:
    """Format the preprocessor definitions: sample rate (Hz), force cap (N), sizes, and edges that split the band."""
    problem, split, tracker = controller.problem, controller.split, controller.tracker
    has_low, has_high = split.edges.low_hz is not None, split.edges.high_hz is not None
    macros: dict[str, str] = {
        "RATE_HZ": repr(float(problem.sample_rate_hz)),
        "CAP_N": repr(float(controller.cap_n)),
        "STATES": str(problem.order),
        "INPUTS": str(problem.inputs),
        "OUTPUTS": str(problem.outputs),
        "DEPTH": str(_pad_to_blocks(problem.step).shape[0]),
        "WIDTH": str(_pad_to_blocks(problem.step).shape[1]),
        "ROWS": f"{len(controller.transient)}L",
        "DIRECTIONS": str(controller.transient.g.shape[2]),
        "PREVIEW": str(len(tracker)),
        "HAS_LOW": str(int(has_low)),
        "HAS_HIGH": str(int(has_high)),
        "SPLITS": str(max(1, has_low + has_high)),
        "SPLIT_ORDER": str(split.order),
        "SPLIT_TERMS": str((split.order + 1) // 2),
    }
    return "\n".join(f"#define HAPTEQ_{name} {value}" for name, value in macros.items())


def _format_tables(controller: RealtimeController) -> str:
    """Format the C definitions of all tables: the matrices of model and controller, and the filters that split the
    band. The weights of the split are binomial coefficients, as in `CausalSplit`."""
    problem, split, tracker = controller.problem, controller.split, controller.tracker
    powers = range((split.order + 1) // 2, split.order + 1)
    definitions = [
        format_c_table("hapteq_step", _pad_to_blocks(problem.step)),
        format_c_table("hapteq_gains", controller.transient.K),
        format_c_table("hapteq_basis", controller.transient.g),
        format_c_table("hapteq_gain", tracker.K),
        format_c_table("hapteq_ahead", tracker.preview_gains),
        format_c_table("hapteq_split_weight", [comb(split.order, power) for power in powers]),
    ]
    for edge_name, edge_hz in (("low", split.edges.low_hz), ("high", split.edges.high_hz)):
        if edge_hz is not None:
            numerator, denominator = split.design_one_pole(edge_hz)
            definitions.append(format_c_table(f"hapteq_{edge_name}_filter", [*numerator, denominator[1]]))
    return "\n".join(definitions)


def _pad_to_blocks(matrix: FloatArray) -> FloatArray:
    """Pad a matrix with zero rows and columns to multiples of `BLOCK_SIZE`."""
    return np.pad(matrix, [(0, -length % BLOCK_SIZE) for length in matrix.shape])


def _read_template(name: str) -> str:
    """Read the template file of this name, which is in this package."""
    return (files("study.workflows.equalizer.controller") / name).read_text("utf-8")
