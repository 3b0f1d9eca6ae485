"""Units of a law's free numbers, from what its signals are measured in."""

from collections.abc import Mapping, Sequence

from equalizer.laws.tree import Apply, Free, Node, Number, Variable
from equalizer.signals.unit_system import LINEAR, UnitSystem

Dimension = tuple[float, float, float]
"""Powers of the force's unit, of the position's, of the second."""
NONE: Dimension = (0.0, 0.0, 0.0)
FORCE: Dimension = (1.0, 0.0, 0.0)
SECOND: Dimension = (0.0, 0.0, 1.0)


def motion_dimension(order: int) -> Dimension:
    """Of a position's derivative."""
    return 0.0, 1.0, -float(order)


def units_of(
    tree: Node,
    numbers: Sequence[float],
    signals: Mapping[str, Dimension],
    wanted: Dimension,
    system: UnitSystem = LINEAR,
) -> tuple[str, ...]:
    """Of p0, p1, … ; `?` where the formula leaves one open, as of one of two factors. wanted: of the law's value."""
    reader = _Reader(numbers, signals)
    for _ in range(2):  # what is found on the right may tell of the left
        reader.assign(tree, wanted)
    symbols = (system.force, system.length, system.time)
    return tuple(_text(reader.found[place], symbols) if place in reader.found else "?" for place in range(len(numbers)))


def _text(dimension: Dimension, symbols: tuple[str, str, str]) -> str:
    above = [_power(name, power) for name, power in zip(symbols, dimension, strict=True) if power > 0 and name != "1"]
    below = [_power(name, -power) for name, power in zip(symbols, dimension, strict=True) if power < 0 and name != "1"]
    over = " ".join(above) or "1"
    under = " ".join(below)
    return f"{over}/{f'({under})' if len(below) > 1 else under}" if below else over


def _power(name: str, power: float) -> str:
    if power == 1:
        return name
    return f"{f'({name})' if ' ' in name else name}^{power:.3g}"


def _sum(one: Dimension | None, other: Dimension | None, sign: float = 1.0) -> Dimension | None:
    if one is None or other is None:
        return None
    return one[0] + sign * other[0], one[1] + sign * other[1], one[2] + sign * other[2]


def _times(of: Dimension | None, factor: float | None) -> Dimension | None:
    return None if of is None or factor is None else (of[0] * factor, of[1] * factor, of[2] * factor)


class _Reader:
    def __init__(self, numbers: Sequence[float], signals: Mapping[str, Dimension]) -> None:
        self.numbers = numbers
        self.signals = signals
        self.found: dict[int, Dimension] = {}

    def of(self, node: Node) -> Dimension | None:
        match node:
            case Number() | Variable("pi"):
                return NONE
            case Free(place):
                return self.found.get(place)
            case Variable(name):
                return self.signals.get(name)
            case Apply("+" | "-" | "minimum" | "maximum" | "neg" | "abs", parts):
                return next((known for part in parts if (known := self.of(part)) is not None), None)
            case Apply("lag" | "play" | "delay", (signal, _)):
                return self.of(signal)
            case Apply("*" | "/" as name, (left, right)):
                return _sum(self.of(left), self.of(right), 1.0 if name == "*" else -1.0)
            case Apply("**", (base, exponent)):
                return _times(self.of(base), self._value(exponent))
            case Apply("sqrt", (inner,)):
                return _times(self.of(inner), 0.5)
            case Apply("integral", (inner,)):
                return _sum(self.of(inner), SECOND)
        return NONE

    def _value(self, node: Node) -> float | None:
        match node:
            case Number(value):
                return value
            case Free(place):
                return self.numbers[place]
            case Apply("neg", (inner,)):
                positive = self._value(inner)
                return None if positive is None else -positive
        return None

    def assign(self, node: Node, wanted: Dimension | None) -> None:
        match node:
            case Free(place):
                if wanted is not None:
                    self.found.setdefault(place, wanted)
            case Apply("+" | "-" | "minimum" | "maximum" | "neg" | "abs", parts):
                for part in parts:
                    self.assign(part, self.of(node) if wanted is None else wanted)
            case Apply("*" | "/" as name, (left, right)):
                sign = 1.0 if name == "*" else -1.0
                self.assign(left, _sum(wanted, self.of(right), -sign))
                self.assign(right, _times(_sum(wanted, self.of(left), -1.0), sign))
            case Apply("**", (base, exponent)):
                power = self._value(exponent)
                self.assign(exponent, NONE)
                self.assign(base, _times(wanted, 1 / power if power else None))
            case Apply(name, parts):
                self._assign_arguments(name, parts, wanted)

    def _assign_arguments(self, name: str, parts: tuple[Node, ...], wanted: Dimension | None) -> None:
        first = parts[0]
        match name:
            case "lag" | "delay" | "play":
                self.assign(first, wanted)
                self.assign(parts[1], self.of(first) if name == "play" else SECOND)
            case "integral":
                self.assign(first, _sum(wanted, SECOND, -1.0))
            case "sqrt":
                self.assign(first, _times(wanted, 2.0))
            case "sign":
                self.assign(first, None)
            case _:
                self.assign(first, NONE)
