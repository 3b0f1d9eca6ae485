"""Compiler of a formula's expression tree to postfix code for the stack machine in `equalizer.laws.kernel`.

Each row of the code is an operation and an operand; arguments precede their operator. Operators with memory get a
region of a memory array. Called by `evaluate` and by the simulation of laws (`effects.discovered_law`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.laws.parse import LawError
from equalizer.laws.tree import Apply, FreeParameter, Node, Number, Variable
from equalizer.signals.signal import FloatArray

OPERATIONS = (
    "number", "variable", "+", "-", "*", "/", "**", "minimum", "maximum",
    "neg", "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "sign", "tanh", "atan",
    "lag", "play", "delay", "integral",
)  # fmt: skip
"""Operations in the order of their codes, on which the kernel relies: operands, binary operators, unary operators,
operators with memory."""
OPCODES: Mapping[str, int] = {name: number for number, name in enumerate(OPERATIONS)}
"""Code of each operation, by its name."""
MAX_CELLS = 256
"""Resolution of a delay: every second instant in its ring buffer is at least delay / MAX_CELLS later. Chosen."""
MEMORY_SIZE: Mapping[str, int] = {"lag": 4, "play": 2, "delay": 4 + 2 * (2 * MAX_CELLS + 8), "integral": 4}
"""Numbers in the memory of each operator; its layout is described at the operators in `kernel`. The ring buffer of a
delay has eight instants to spare."""
STACK_SIZE = 32
"""Largest number of values on the stack. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """Formula in postfix notation for the stack machine; result of `compile_program`."""

    codes: FloatArray
    """(k, 2): code of the operation, and its operand: a number, the column of a signal, the index of its memory, or 0
    where it has none."""
    parameter_rows: tuple[tuple[int, int], ...]
    """Row of each free parameter's occurrence, and the parameter's index."""
    memory_size: int
    """Number of values in the memory, the first of which is its state (`SETTLED`, ... in `equalizer.laws.kernel`)."""

    def insert_numbers(self, numbers: Sequence[float]) -> FloatArray:
        """Insert the values of the free parameters p0, p1, … (SI units); returns the rows one after the other, (2
        k,)."""
        codes = self.codes.copy()
        for row, parameter_index in self.parameter_rows:
            codes[row, 1] = numbers[parameter_index]
        return codes.ravel()


def compile_program(tree: Node, signals: Mapping[str, int]) -> Program:
    """Compile a formula's tree for the stack machine. signals: column of each signal. Raises LawError for an unknown
    signal, and for a formula that needs more than `STACK_SIZE` values on the stack."""
    program = _append_formula(tree, Program(np.empty((0, 2)), (), 1), signals)
    _check_depth(program.codes[:, 0])
    return program


def _append_formula(tree: Node, program: Program, signals: Mapping[str, int]) -> Program:
    """Append the code of a tree to the program, arguments first. Raises LawError for an unknown signal."""
    match tree:
        case Number(value):
            return _append_row(program, "number", value)
        case FreeParameter(parameter_index):
            return replace(
                _append_row(program, "number", np.nan),
                parameter_rows=(*program.parameter_rows, (len(program.codes), parameter_index)),
            )
        case Variable("pi"):
            return _append_row(program, "number", np.pi)
        case Variable(name):
            if name not in signals:
                raise LawError(f"the law needs the signal '{name}'; there are {', '.join(signals) or 'none'}")
            return _append_row(program, "variable", signals[name])
        case Apply(name, arguments):
            for argument in arguments:
                program = _append_formula(argument, program, signals)
            operator_size = MEMORY_SIZE.get(name, 0)
            return replace(
                _append_row(program, name, program.memory_size if operator_size else 0),
                memory_size=program.memory_size + operator_size,
            )


def _append_row(program: Program, name: str, operand: float) -> Program:
    """Append the operation `name` with its operand to the program as the last row."""
    return replace(program, codes=np.vstack([program.codes, [OPCODES[name], operand]]))


def _check_depth(codes: FloatArray) -> None:
    """Raise LawError where more than `STACK_SIZE` values are on the stack. Each code changes the stack's height by 1, 0
    or -1."""
    growth = np.ones(len(codes))
    growth[(codes >= OPCODES["+"]) & (codes <= OPCODES["maximum"])] = -1
    growth[codes >= OPCODES["neg"]] = 0
    growth[(codes >= OPCODES["lag"]) & (codes <= OPCODES["delay"])] = -1
    if np.cumsum(growth).max() > STACK_SIZE:
        raise LawError(f"the law keeps more than {STACK_SIZE} numbers at once; write it less nested")
