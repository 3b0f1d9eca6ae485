"""Dimensional analysis: units of a law's free parameters from the units of its signals and of its value.

Terms of a sum have the same dimension, in a product the exponents of the dimensions add, and arguments of functions
such as sin and exp are dimensionless. The dimension wanted of the value is passed down the expression tree to each
parameter.
"""

from collections.abc import Mapping, Sequence

from equalizer.laws.tree import Apply, Free, Node, Number, Variable
from equalizer.signals.unit_system import LINEAR, UnitSystem

Dimension = tuple[float, float, float]
"""Exponents of force, of length (or angle) and of time."""
DIMENSIONLESS: Dimension = (0.0, 0.0, 0.0)
"""Dimensionless."""
FORCE: Dimension = (1.0, 0.0, 0.0)
SECOND: Dimension = (0.0, 0.0, 1.0)


def motion_dimension(order: int) -> Dimension:
    """Dimension of the time derivative of the position of this order: 0 position, 1 velocity, 2 acceleration."""
    return 0.0, 1.0, -float(order)


def units_of(
    tree: Node,
    numbers: Sequence[float],
    signals: Mapping[str, Dimension],
    dimension: Dimension,
    system: UnitSystem = LINEAR,
) -> tuple[str, ...]:
    """Units of p0, p1, …; `?` where the formula does not determine the unit, as of two parameters that are factors of
    each other. numbers: values of the parameters; dimension: dimension of the law's value."""
    solver = _DimensionSolver(numbers, signals)
    for _ in range(2):  # Two passes: a parameter found on the right of an operator may determine another on the left.
        solver.assign(tree, dimension)
    symbols = (system.force, system.length, system.time)
    return tuple(
        _format_dimension(solver.dimensions[place], symbols) if place in solver.dimensions else "?"
        for place in range(len(numbers))
    )


def _format_dimension(dimension: Dimension, symbols: tuple[str, str, str]) -> str:
    above = [
        _format_power(name, power) for name, power in zip(symbols, dimension, strict=True) if power > 0 and name != "1"
    ]
    below = [
        _format_power(name, -power) for name, power in zip(symbols, dimension, strict=True) if power < 0 and name != "1"
    ]
    numerator = " ".join(above) or "1"
    denominator = " ".join(below)
    return f"{numerator}/{f'({denominator})' if len(below) > 1 else denominator}" if below else numerator


def _format_power(name: str, power: float) -> str:
    if power == 1:
        return name
    return f"{f'({name})' if ' ' in name else name}^{power:.3g}"


def _add_dimensions(first: Dimension | None, second: Dimension | None, sign: float = 1.0) -> Dimension | None:
    if first is None or second is None:
        return None
    return first[0] + sign * second[0], first[1] + sign * second[1], first[2] + sign * second[2]


def _scale_dimension(dimension: Dimension | None, factor: float | None) -> Dimension | None:
    return (
        None
        if dimension is None or factor is None
        else (dimension[0] * factor, dimension[1] * factor, dimension[2] * factor)
    )


class _DimensionSolver:
    """Dimensions of a formula's parameters, collected in `found` by index; the first dimension found counts."""

    def __init__(self, numbers: Sequence[float], signals: Mapping[str, Dimension]) -> None:
        self.numbers = numbers
        self.signals = signals
        self.dimensions: dict[int, Dimension] = {}

    def dimension_of(self, node: Node, literal: Dimension | None = DIMENSIONLESS) -> Dimension | None:
        """Dimension of an expression; None where it is not known. literal: dimension of the numbers that are part of
        the formula; None = not known, because such a number may have a unit."""
        match node:
            case Number() | Variable("pi"):
                return literal
            case Free(place):
                return self.dimensions.get(place)
            case Variable(name):
                return self.signals.get(name)
            case Apply("+" | "-" | "minimum" | "maximum" | "neg" | "abs", parts):
                return next(
                    (dimension for part in parts if (dimension := self.dimension_of(part, literal)) is not None), None
                )
            case Apply("lag" | "play" | "delay", (signal, _)):
                return self.dimension_of(signal, literal)
            case Apply("*" | "/" as name, (left, right)):
                return _add_dimensions(
                    self.dimension_of(left, literal), self.dimension_of(right, literal), 1.0 if name == "*" else -1.0
                )
            case Apply("**", (base, exponent)):
                return _scale_dimension(self.dimension_of(base, literal), self._value(exponent))
            case Apply("sqrt", (inner,)):
                return _scale_dimension(self.dimension_of(inner, literal), 0.5)
            case Apply("integral", (inner,)):
                return _add_dimensions(self.dimension_of(inner, literal), SECOND)
        return DIMENSIONLESS

    def _value(self, node: Node) -> float | None:
        """Value of an exponent that is a number or a parameter, with or without sign; None for any other expression."""
        match node:
            case Number(value):
                return value
            case Free(place):
                return self.numbers[place]
            case Apply("neg", (inner,)):
                positive = self._value(inner)
                return None if positive is None else -positive
        return None

    def assign(self, node: Node, dimension: Dimension | None) -> None:
        """Pass the dimension that an expression must have (None: not known) down to its parameters."""
        match node:
            case Free(place):
                if dimension is not None:
                    self.dimensions.setdefault(place, dimension)
            case Apply("+" | "-" | "minimum" | "maximum" | "neg" | "abs", parts):
                for part in parts:
                    self.assign(part, self.dimension_of(node) if dimension is None else dimension)
            case Apply("*" | "/" as name, (left, right)):
                sign = 1.0 if name == "*" else -1.0
                left_dimension = _add_dimensions(dimension, self.dimension_of(right), -sign)
                right_dimension = _scale_dimension(_add_dimensions(dimension, self.dimension_of(left), -1.0), sign)
                self.assign(left, None if self._determines_itself(left, right) else left_dimension)
                self.assign(right, None if self._determines_itself(right, left) else right_dimension)
            case Apply("**", (base, exponent)):
                power = self._value(exponent)
                self.assign(exponent, DIMENSIONLESS)
                self.assign(base, _scale_dimension(dimension, 1 / power if power else None))
            case Apply(name, parts):
                self._assign_arguments(name, parts, dimension)

    def _determines_itself(self, part: Node, factor: Node) -> bool:
        """Whether the signals in a sum (or power) determine its dimension better than the dimension wanted of the
        product: the other factor is a number that is part of the form, and may have a unit."""
        is_sum = isinstance(part, Apply) and part.name in ("+", "-", "minimum", "maximum", "**")
        has_unknown_unit = self.dimension_of(factor, None) is None and self.dimension_of(factor) is not None
        return is_sum and has_unknown_unit and self.dimension_of(part, None) is not None

    def _assign_arguments(self, name: str, parts: tuple[Node, ...], dimension: Dimension | None) -> None:
        """Pass dimensions to a function's arguments; those of functions such as sin and exp are dimensionless."""
        first = parts[0]
        match name:
            case "lag" | "delay" | "play":
                self.assign(first, dimension)
                self.assign(parts[1], self.dimension_of(first) if name == "play" else SECOND)
            case "integral":
                self.assign(first, _add_dimensions(dimension, SECOND, -1.0))
            case "sqrt":
                self.assign(first, _scale_dimension(dimension, 2.0))
            case "sign":
                self.assign(first, None)
            case _:
                self.assign(first, DIMENSIONLESS)
