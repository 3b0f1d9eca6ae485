"""Compiles the expression tree of a formula to postfix code for the stack machine in `equalizer.laws.kernel`.

Each row of the code is an operation and an operand; arguments precede their operator. Operators with memory get a
region of a memory array, whose first number is its state.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from equalizer.laws.parse import LawError
from equalizer.laws.tree import Apply, FreeParameter, Node, Number, Variable
from equalizer.signals.signal import FloatArray

CODES = (
    "number", "variable", "+", "-", "*", "/", "**", "minimum", "maximum",
    "neg", "sin", "cos", "tan", "exp", "log", "sqrt", "abs", "sign", "tanh", "atan",
    "lag", "play", "delay", "integral",
)  # fmt: skip
"""Operations in the order of their codes, on which the kernel relies: operands, binary operators, unary operators,
operators with memory."""
CODE: Mapping[str, int] = {name: number for number, name in enumerate(CODES)}
CELLS = 256
"""Resolution of a delay: every second instant in its ring buffer is at least delay / CELLS later."""
MEMORY_SIZE: Mapping[str, int] = {"lag": 4, "play": 2, "delay": 4 + 2 * (2 * CELLS + 8), "integral": 4}
"""Numbers in the memory of each operator; its layout is described at the operators in `kernel`."""
STACK_SIZE = 32
"""Largest number of values on the stack."""


@dataclass(frozen=True, slots=True, eq=False)
class Program:
    """Formula in postfix notation for the stack machine; result of `compile_program`."""

    codes: FloatArray
    """(k, 2): operation, and its operand: a number, the column of a signal, or the index of its memory."""
    free: tuple[tuple[int, int], ...]
    """Row of each free parameter's occurrence, and the parameter's index."""
    memory: int
    """Size of the memory, which starts with its state (`SETTLED`, ... in `equalizer.laws.kernel`)."""

    def with_numbers(self, numbers: Sequence[float]) -> FloatArray:
        """(2 k,): the program as a vector, with the values of the free parameters inserted."""
        codes = self.codes.copy()
        for row, place in self.free:
            codes[row, 1] = numbers[place]
        return codes.ravel()


def compile_program(tree: Node, signals: Mapping[str, int]) -> Program:
    """Compile a formula's tree for the stack machine. signals: column of each signal. Raises LawError for an unknown
    signal, and for a formula that needs more than `STACK_SIZE` values on the stack."""
    program = _append_formula(tree, Program(np.empty((0, 2)), (), 1), signals)
    _check_depth(program.codes[:, 0])
    return program


def _append_formula(tree: Node, program: Program, signals: Mapping[str, int]) -> Program:
    """The program with the code of a tree appended, arguments first."""
    match tree:
        case Number(value):
            return _append_row(program, "number", value)
        case FreeParameter(place):
            return replace(_append_row(program, "number", np.nan), free=(*program.free, (len(program.codes), place)))
        case Variable("pi"):
            return _append_row(program, "number", np.pi)
        case Variable(name):
            if name not in signals:
                raise LawError(f"the law needs the signal '{name}'; there are {', '.join(signals) or 'none'}")
            return _append_row(program, "variable", signals[name])
        case Apply(name, parts):
            for part in parts:
                program = _append_formula(part, program, signals)
            memory_size = MEMORY_SIZE.get(name, 0)
            return replace(
                _append_row(program, name, program.memory if memory_size else 0), memory=program.memory + memory_size
            )


def _append_row(program: Program, name: str, operand: float) -> Program:
    return replace(program, codes=np.vstack([program.codes, [CODE[name], operand]]))


def _check_depth(codes: FloatArray) -> None:
    """Raises LawError where the stack overflows. Each code changes the stack's height by 1, 0 or -1."""
    growth = np.ones(len(codes))
    growth[(codes >= CODE["+"]) & (codes <= CODE["maximum"])] = -1
    growth[codes >= CODE["neg"]] = 0
    growth[(codes >= CODE["lag"]) & (codes <= CODE["delay"])] = -1
    if np.cumsum(growth).max() > STACK_SIZE:
        raise LawError(f"the law keeps more than {STACK_SIZE} numbers at once; write it less nested")
