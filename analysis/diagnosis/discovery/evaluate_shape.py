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
from equalizer.laws.tree import Apply, FreeParameter, Node, Number, iterate_nodes
from equalizer.signals.signal import FloatArray

_NUMPY_FUNCTIONS: Mapping[str, Callable[..., FloatArray]] = {
    "+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide, "**": np.power, "neg": np.negative,
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "exp": np.exp, "log": np.log, "sqrt": np.sqrt, "abs": np.abs,
    "sign": np.sign, "tanh": np.tanh, "atan": np.arctan, "minimum": np.minimum, "maximum": np.maximum,
}  # fmt: skip
"""NumPy function of each operator and function of a formula without memory."""


def name_signals(evidence: Evidence) -> Columns:
    """Name the signals (n,) as the grammar does, in SI units: position x, velocity vx, acceleration dvx and command fx
    of the first axis, ax of the first response channel as the model predicts it (free of noise), and so on up to the
    third axis and channel; further ones get no name. Time t in s from the first sample. At least two samples."""
    n, m = evidence.command.shape
    columns = {"t": np.arange(n) / evidence.sample_rate_hz}
    for axis, name in zip(range(m), AXES, strict=False):
        columns[name] = evidence.axis_position[:, axis]
        columns[f"v{name}"] = evidence.axis_velocity[:, axis]
        columns[f"dv{name}"] = np.gradient(evidence.axis_velocity[:, axis]) * evidence.sample_rate_hz
        columns[f"f{name}"] = evidence.command[:, axis]
    columns |= {f"a{name}": channel for name, channel in zip(AXES, evidence.predicted.T, strict=False)}
    return {name: np.ascontiguousarray(column) for name, column in columns.items()}


def evaluate_shape(shape: str, parameters: Sequence[float], columns: Columns, rate_hz: float) -> FloatArray:
    """Evaluate the formula `shape` with these parameters, (n,); NaN or inf outside its domain. columns: signals (n,) by
    name, as from `name_signals`. rate_hz: sample rate, used by formulas with memory."""
    tree = parse_formula(shape, template=True)[0]
    with np.errstate(all="ignore"):
        if any(isinstance(node, Apply) and node.name in MEMORY_OPERATORS for node in iterate_nodes(tree)):
            return evaluate(Law(shape, tuple(parameters), (), "force", "x"), columns, rate_hz)
        return np.array(np.broadcast_to(_evaluate_node(tree, parameters, columns), columns["t"].shape))


def _evaluate_node(node: Node, parameters: Sequence[float], columns: Columns) -> FloatArray:
    """Evaluate a node of the parsed formula recursively: a scalar, or an array (n,) where it contains a signal."""
    match node:
        case Number(value):
            return np.float64(value)  # type: ignore[return-value]
        case FreeParameter(parameter_index):
            return np.float64(parameters[parameter_index])  # type: ignore[return-value]
        case Apply(name, arguments):
            return _NUMPY_FUNCTIONS[name](*(_evaluate_node(argument, parameters, columns) for argument in arguments))
    return columns[node.name] if node.name != "pi" else np.float64(np.pi)  # type: ignore[return-value]
