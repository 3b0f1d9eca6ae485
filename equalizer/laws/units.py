"""Dimensional analysis: units of a law's free parameters from the units of its signals and of its value.

Terms of a sum have the same dimension, in a product the exponents of the dimensions add, and arguments of functions
such as sin and exp are dimensionless. The required dimension of the value is passed down the expression tree to each
parameter.
"""

from collections.abc import Mapping, Sequence

from equalizer.laws.tree import Apply, FreeParameter, Node, Number, Variable
from equalizer.signals.unit_system import LINEAR, UnitSystem

Dimension = tuple[float, float, float]
"""Exponents of force, of length (or angle) and of time."""
DIMENSIONLESS: Dimension = (0.0, 0.0, 0.0)
"""Dimension of exponents, of ratios, and of the arguments and values of functions such as sin."""
FORCE: Dimension = (1.0, 0.0, 0.0)
"""Dimension of a force; of a torque on a rotational axis."""
SECOND: Dimension = (0.0, 0.0, 1.0)
"""Dimension of a time."""


def compute_motion_dimension(order: int) -> Dimension:
    """Compute the dimension of a derivative of the position. order: 0 position, 1 velocity, 2 acceleration."""
    return 0.0, 1.0, -float(order)


def derive_units(
    tree: Node,
    numbers: Sequence[float],
    signals: Mapping[str, Dimension],
    dimension: Dimension,
    system: UnitSystem = LINEAR,
) -> tuple[str, ...]:
    """Derive the units of p0, p1, …; `?` where the formula does not determine the unit, as of two parameters that are
    multiplied with each other. numbers: values of the parameters; signals: dimension of each signal; dimension: that of
    the law's value; system: symbols of force, length and time."""
    solver = _DimensionSolver(numbers, signals)
    for _ in range(2):  # Two passes: a parameter found on the right of an operator may determine another on the left.
        solver.assign_dimension(tree, dimension)
    symbols = (system.force, system.length, system.time)
    return tuple(
        _format_dimension(solver.dimensions[index], symbols) if index in solver.dimensions else "?"
        for index in range(len(numbers))
    )


def _format_dimension(dimension: Dimension, symbols: tuple[str, str, str]) -> str:
    """Format the unit of a dimension, such as `N s/m`; 1 if dimensionless. symbols: of force, length and time, 1 for a
    quantity without unit."""
    positive_powers = [
        _format_power(symbol, power)
        for symbol, power in zip(symbols, dimension, strict=True)
        if power > 0 and symbol != "1"
    ]
    negative_powers = [
        _format_power(symbol, -power)
        for symbol, power in zip(symbols, dimension, strict=True)
        if power < 0 and symbol != "1"
    ]
    numerator = " ".join(positive_powers) or "1"
    denominator = " ".join(negative_powers)
    return (
        f"{numerator}/{f'({denominator})' if len(negative_powers) > 1 else denominator}"
        if negative_powers
        else numerator
    )


def _format_power(symbol: str, power: float) -> str:
    """Format a unit's symbol with its exponent (three digits), 1 left out; a product with an exponent is bracketed."""
    if power == 1:
        return symbol
    return f"{f'({symbol})' if ' ' in symbol else symbol}^{power:.3g}"


def _add_dimensions(first: Dimension | None, second: Dimension | None, sign: float = 1.0) -> Dimension | None:
    """Compute the dimension of a product (sign 1) or quotient (sign -1); None where that of a factor is not known."""
    if first is None or second is None:
        return None
    return first[0] + sign * second[0], first[1] + sign * second[1], first[2] + sign * second[2]


def _scale_dimension(dimension: Dimension | None, factor: float | None) -> Dimension | None:
    """Compute the dimension of a power with the exponent `factor`; None where either is not known."""
    return (
        None
        if dimension is None or factor is None
        else (dimension[0] * factor, dimension[1] * factor, dimension[2] * factor)
    )


class _DimensionSolver:
    """Derives the dimensions of a formula's parameters, in `dimensions` by index; a dimension that is derived later for
    the same parameter is ignored."""

    def __init__(self, parameter_values: Sequence[float], signal_dimensions: Mapping[str, Dimension]) -> None:
        self.parameter_values = parameter_values
        self.signal_dimensions = signal_dimensions
        self.dimensions: dict[int, Dimension] = {}

    def find_dimension(self, node: Node, literal: Dimension | None = DIMENSIONLESS) -> Dimension | None:
        """Find the dimension of an expression; None where it is not known. literal: dimension of the numbers that are
        part of the formula; None = not known, because such a number may have a unit."""
        match node:
            case Number() | Variable("pi"):
                return literal
            case FreeParameter(index):
                return self.dimensions.get(index)
            case Variable(name):
                return self.signal_dimensions.get(name)
            case Apply("+" | "-" | "minimum" | "maximum" | "neg" | "abs", parts):
                return next(
                    (dimension for part in parts if (dimension := self.find_dimension(part, literal)) is not None), None
                )
            case Apply("lag" | "play" | "delay", (signal, _)):
                return self.find_dimension(signal, literal)
            case Apply("*" | "/" as operator, (left, right)):
                return _add_dimensions(
                    self.find_dimension(left, literal),
                    self.find_dimension(right, literal),
                    1.0 if operator == "*" else -1.0,
                )
            case Apply("**", (base, exponent)):
                return _scale_dimension(self.find_dimension(base, literal), self._evaluate_exponent(exponent))
            case Apply("sqrt", (inner,)):
                return _scale_dimension(self.find_dimension(inner, literal), 0.5)
            case Apply("integral", (inner,)):
                return _add_dimensions(self.find_dimension(inner, literal), SECOND)
        return DIMENSIONLESS

    def _evaluate_exponent(self, node: Node) -> float | None:
        """Evaluate an exponent that is a number or a parameter, with or without sign; None for any other expression."""
        match node:
            case Number(value):
                return value
            case FreeParameter(index):
                return self.parameter_values[index]
            case Apply("neg", (inner,)):
                magnitude = self._evaluate_exponent(inner)
                return None if magnitude is None else -magnitude
        return None

    def assign_dimension(self, node: Node, dimension: Dimension | None) -> None:
        """Pass the required dimension of an expression (None: not known) down to its parameters."""
        match node:
            case FreeParameter(index):
                if dimension is not None:
                    self.dimensions.setdefault(index, dimension)
            case Apply("+" | "-" | "minimum" | "maximum" | "neg" | "abs", parts):
                for part in parts:
                    self.assign_dimension(part, self.find_dimension(node) if dimension is None else dimension)
            case Apply("*" | "/" as operator, (left, right)):
                sign = 1.0 if operator == "*" else -1.0
                left_dimension = _add_dimensions(dimension, self.find_dimension(right), -sign)
                right_dimension = _scale_dimension(_add_dimensions(dimension, self.find_dimension(left), -1.0), sign)
                self.assign_dimension(left, None if self._is_determined_by_signals(left, right) else left_dimension)
                self.assign_dimension(right, None if self._is_determined_by_signals(right, left) else right_dimension)
            case Apply("**", (base, exponent)):
                power = self._evaluate_exponent(exponent)
                self.assign_dimension(exponent, DIMENSIONLESS)
                self.assign_dimension(base, _scale_dimension(dimension, 1 / power if power else None))
            case Apply(name, parts):
                self._assign_arguments(name, parts, dimension)

    def _is_determined_by_signals(self, part: Node, factor: Node) -> bool:
        """Whether the dimension of a factor follows from the signals in it and not from the product: it is a sum,
        power, minimum or maximum with signals of known dimension, and the other factor contains a number that is part
        of the form, which may have a unit."""
        is_sum = isinstance(part, Apply) and part.name in ("+", "-", "minimum", "maximum", "**")
        has_unknown_unit = self.find_dimension(factor, None) is None and self.find_dimension(factor) is not None
        return is_sum and has_unknown_unit and self.find_dimension(part, None) is not None

    def _assign_arguments(self, name: str, parts: tuple[Node, ...], dimension: Dimension | None) -> None:
        """Pass dimensions to a function's arguments; those of functions such as sin and exp are dimensionless."""
        first = parts[0]
        match name:
            case "lag" | "delay" | "play":
                self.assign_dimension(first, dimension)
                self.assign_dimension(parts[1], self.find_dimension(first) if name == "play" else SECOND)
            case "integral":
                self.assign_dimension(first, _add_dimensions(dimension, SECOND, -1.0))
            case "sqrt":
                self.assign_dimension(first, _scale_dimension(dimension, 2.0))
            case "sign":
                self.assign_dimension(first, None)
            case _:
                self.assign_dimension(first, DIMENSIONLESS)
