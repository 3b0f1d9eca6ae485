"""Evaluates the formula of a term along the samples of a recording, and collects the signals that formulas may contain.

Formulas without memory are evaluated by NumPy on all samples at once; those with memory, such as delays and filters, by
the sample-by-sample evaluator of `equalizer.laws`.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from analysis.diagnosis.discovery.grammar import AXES, Columns
from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.laws.parse import MEMORY_OPERATORS, parse_formula
from equalizer.laws.tree import Apply, Free, Node, Number, iterate_nodes
from equalizer.signals.signal import FloatArray

_NUMPY_FUNCTIONS: Mapping[str, Callable[..., FloatArray]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.power, "neg": np.negative,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "abs": np.abs,
    "sign": np.sign, "tanh": np.tanh, "atan": np.arctan, "minimum": np.minimum, "maximum": np.maximum,
}  # fmt: skip


def columns_of(evidence: Evidence) -> Columns:
    """Signals (n,) by their names in the grammar, in SI units: position x, velocity vx and command fx of the first
    axis, ax of the first response channel as the model predicts it (free of noise), and so on; time t in s."""
    n, m = evidence.command.shape
    columns = {"t": np.arange(n) / evidence.sample_rate_hz}
    for axis, name in zip(range(m), AXES, strict=False):
        columns[name] = evidence.axis_position[:, axis]
        columns[f"v{name}"] = evidence.axis_velocity[:, axis]
        columns[f"f{name}"] = evidence.command[:, axis]
    columns |= {f"a{name}": channel for name, channel in zip(AXES, evidence.predicted.T, strict=False)}
    return {name: np.ascontiguousarray(column) for name, column in columns.items()}


def evaluate_shape(shape: str, numbers: Sequence[float], columns: Columns, rate_hz: float) -> FloatArray:
    """(n,): the formula `shape` with these parameters; NaN or inf outside its domain. columns: signals by name,
    (n,)."""
    tree = parse_formula(shape, template=True)[0]
    with np.errstate(all="ignore"):
        if any(isinstance(node, Apply) and node.name in MEMORY_OPERATORS for node in iterate_nodes(tree)):
            return evaluate(Law(shape, tuple(numbers), (), "force", "x"), columns, rate_hz)
        return np.array(np.broadcast_to(_value(tree, numbers, columns), columns["t"].shape))


def _value(tree: Node, numbers: Sequence[float], columns: Columns) -> FloatArray:
    """Value of a node of the parsed formula, recursively: a scalar, or an array (n,) where it contains a signal."""
    match tree:
        case Number(value):
            return np.float64(value)  # type: ignore[return-value]
        case Free(place):
            return np.float64(numbers[place])  # type: ignore[return-value]
        case Apply(name, parts):
            return _NUMPY_FUNCTIONS[name](*(_value(part, numbers, columns) for part in parts))
    return columns[tree.name] if tree.name != "pi" else np.float64(np.pi)  # type: ignore[return-value]
