"""Evaluation of a law (a formula with memory operators) along sampled signals, by the compiled stack machine `kernel`.

`evaluate`: signals are interpolated linearly between samples, as measured motion is. `evaluate_held`: signals are held
over each step, as commands are. Called by the discovery of laws and their evaluation, the effects made of laws, and
their compensation.
"""

from collections.abc import Mapping

import numpy as np

from equalizer.laws.kernel import FROM_ZERO, run_held, run_interpolated
from equalizer.laws.law import Law
from equalizer.laws.parse import LawError
from equalizer.laws.program import Program, compile_program
from equalizer.signals.signal import FloatArray


def evaluate(law: Law, columns: Mapping[str, FloatArray], sample_rate_hz: float) -> FloatArray:
    """Evaluate the law at each sample; returns values (n,). columns: (n,) each, by the signals' names, in SI units;
    where the time `t` is not among them, it is counted in seconds from the first sample. Operators with memory start in
    the steady state of the signals' first values, integrals at zero. Outside its domain a function returns NaN or inf.
    Raises LawError where a signal is missing, there are no columns, their lengths differ, or the law is nested too
    deeply.
    """
    program, signals = _bind_signals(law, columns, sample_rate_hz)
    values, memory = np.empty(len(signals)), np.zeros(program.memory_size)
    run_interpolated(program.insert_numbers(law.numbers), signals, memory, 1 / sample_rate_hz, values)
    return values


def evaluate_held(law: Law, columns: Mapping[str, FloatArray], sample_rate_hz: float) -> FloatArray:
    """Evaluate the law at the start and at the end of each step, over which the signals (n,) are held; returns values
    (2, n). Before the first sample all signals are zero. Raises LawError as `evaluate` does."""
    program, signals = _bind_signals(law, columns, sample_rate_hz)
    values, memory = np.empty((2, len(signals))), np.zeros(program.memory_size)
    memory[0] = FROM_ZERO
    run_held(program.insert_numbers(law.numbers), signals, memory, 1 / sample_rate_hz, values)
    return values


def _bind_signals(law: Law, columns: Mapping[str, FloatArray], sample_rate_hz: float) -> tuple[Program, FloatArray]:
    """Compile the law's program, and arrange its signals as an array (n, k), in the program's order of columns. Raises
    LawError as `evaluate` does."""
    if not columns:
        raise LawError("a law is evaluated along signals, and there are none")
    lengths = {len(column) for column in columns.values()}
    if len(lengths) > 1:
        raise LawError(
            f"the signals have different lengths: {', '.join(str(sample_count) for sample_count in sorted(lengths))}"
        )
    sample_count = lengths.pop()
    used_names = law.variables
    available_columns = {"t": np.arange(sample_count) / sample_rate_hz, **columns} if "t" in used_names else columns
    program = compile_program(
        law.tree, {name: column_index for column_index, name in enumerate(used_names) if name in available_columns}
    )
    signals = np.empty((sample_count, len(used_names)))
    for column_index, name in enumerate(used_names):
        signals[:, column_index] = available_columns[name]
    return program, signals
