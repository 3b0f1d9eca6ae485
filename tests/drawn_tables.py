"""Tables of random layout with known contents, as loggers and spreadsheets write them."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Random = np.random.Generator
FloatArray = npt.NDArray[np.float64]
QUANTITIES = (
    ("force", ("N", "lbf", "gf", "kgf")),
    ("position", ("mm", "μm", "in", "m")),
    ("speed", ("mm/s", "in/sec", "m/s")),
    ("acceleration", ("m/s²", "m/sec2", "g")),
)
FACTORS = {
    "N": 1.0, "lbf": 4.4482216152605, "gf": 9.80665e-3, "kgf": 9.80665, "mm": 1e-3, "μm": 1e-6, "in": 0.0254, "m": 1.0,
    "mm/s": 1e-3, "in/sec": 0.0254, "m/s": 1.0, "m/s²": 1.0, "m/sec2": 1.0, "g": 9.80665,
}  # fmt: skip
TIMES = {"s": 1.0, "sec": 1.0, "ms": 1e3, "msec": 1e3, "us": 1e6, "µs": 1e6}


@dataclass(frozen=True, slots=True, eq=False)
class Layout:
    delimiter: str
    decimal: str
    encoding: str
    newline: str
    remarks: tuple[str, ...]
    """Lines above the header."""
    units: str
    """Where they stand: brackets, round, stroke, row, bracketed row, none."""
    header: bool
    ends: tuple[str, str]
    """Delimiters at the end of the header and of the other lines."""
    quoted: str
    """Which fields are in quotes: none, names, all."""
    thousands: str
    index: str | None
    """Name of a column that numbers the rows."""
    empty: str | None
    """Name of a column without any value."""
    time: str
    """Its unit, or date, or clock."""
    missing: str
    """Written where a sample is missing."""
    doubled: tuple[int, ...]
    below: tuple[str, ...]
    """Lines below the last row."""
    digits: int
    """Behind the decimal sign."""

    @property
    def open(self) -> bool:
        """Whether a part of what the table says may be refused."""
        comma = self.decimal == "," and self.digits == 3
        words = self.delimiter == " " and bool(self.below)
        return not self.header or self.units == "none" or bool(self.thousands) or comma or words


@dataclass(frozen=True, slots=True, eq=False)
class DrawnTable:
    layout: Layout
    data: bytes
    rate_hz: float
    names: tuple[str, ...]
    values: FloatArray
    """(n, channels) in SI units; NaN where a sample is missing."""


def draw_table(random: Random) -> DrawnTable:
    layout = _draw_layout(random)
    rate_hz = float(random.choice([10, 50, 100, 1000]))
    count = int(random.integers(24, 90))
    motion = QUANTITIES[int(random.integers(1, len(QUANTITIES)))]
    columns = [(name, str(random.choice(units))) for name, units in (QUANTITIES[0], motion)]
    size = 10.0 ** random.integers(0, 5)
    written = np.round(random.normal(0, size, (count, 2)), layout.digits)
    lost = random.random((count, 2)) < (0.05 if random.random() < 0.5 else 0)
    lost[[0, -1]] = False
    factors = [FACTORS[unit] if layout.units != "none" else 1.0 for _, unit in columns]
    values = np.where(lost, np.nan, written * factors)
    lines = _lines(layout, columns, [_stamp(k / rate_hz, layout) for k in range(count)], written, lost)
    text = layout.newline.join(lines) + layout.newline
    return DrawnTable(layout, text.encode(layout.encoding), rate_hz, tuple(name for name, _ in columns), values)


def _draw_layout(random: Random) -> Layout:
    def pick(*choices, usual=0.6):
        return choices[0] if random.random() < usual else choices[int(random.integers(len(choices)))]

    delimiter = pick(",", ";", "\t", "|", " ", usual=0.3)
    decimal = pick(".", ",", usual=0.5)
    quoted = "all" if decimal == delimiter else pick("none", "names", "all")
    ends = pick(("", ""), (delimiter, delimiter), ("", delimiter), (delimiter * 2, delimiter * 2))
    time = pick(*TIMES, "date", "clock", usual=0.3)
    return Layout(
        delimiter, decimal, pick("utf-8", "utf-8-sig", "utf-16", "cp1252", usual=0.4), pick("\n", "\r\n", "\r"),
        pick((), ("Rig 3",), ("# by hand",), ("Logger 4000", "", "rate;100", "started 12:03, by hand"), ("", "Run 1")),
        pick("brackets", "round", "stroke", "row", "bracketed row", "none", usual=0.3), random.random() < 0.95,
        ("", "") if delimiter == " " else ends, quoted, pick("", "'", "," if decimal == "." else ".", " ", usual=0.85),
        pick(None, "", "index", "#", "Nr.") if delimiter != " " else pick(None, "index"),
        None if delimiter == " " else pick(None, "", "spare"), time,
        pick("", "NaN", "-", "N/A") if delimiter != " " else "NaN",
        tuple(random.integers(0, 20, 3)) if random.random() < 0.2 else (), pick((), ("End of file",), ("",), usual=0.9),
        int(random.integers(0, 5)),
    )  # fmt: skip


def _stamp(seconds: float, layout: Layout) -> str:
    if layout.time in ("date", "clock"):
        clock = np.datetime64("2026-05-04T23:59:59.5") + np.timedelta64(round(seconds * 1e6), "us")
        text = str(clock)[:23].replace("T", " " if layout.delimiter != " " else "T")
        return text if layout.time == "date" else text[11:]
    return f"{seconds * TIMES[layout.time]:.6f}".rstrip("0").rstrip(".").replace(".", layout.decimal)


def _lines(layout, columns, stamps, written, lost):
    time = "when" if layout.time in ("date", "clock") else "time"
    units = ["" if time == "when" else layout.time, *(unit for _, unit in columns)]
    if layout.encoding == "cp1252":
        units = [unit.replace("μ", "µ") for unit in units]
    names = [time, *(name for name, _ in columns)]
    forms = {"brackets": "{} [{}]", "round": "{} ({})", "stroke": "{} / {}"}
    if layout.units in forms:
        names = [
            forms[layout.units].format(name, unit) if unit else name for name, unit in zip(names, units, strict=True)
        ]
    rows = [[stamp, *(layout.missing if gone else _number(x, layout) for x, gone in zip(*row, strict=True))]
            for stamp, *row in zip(stamps, written, lost, strict=True)]  # fmt: skip
    head = [names] if layout.header else []
    if layout.units.endswith("row"):
        bare = [unit or ("-" if layout.delimiter == " " else "") for unit in units]
        head.append([f"[{unit}]" if unit and layout.units != "row" else unit for unit in bare])
    rows = [list(row) for k, row in enumerate(rows) for _ in range(1 + (k in layout.doubled))]
    for column, body, first in (
        (layout.index, map(str, range(len(rows))), True),
        (layout.empty, [""] * len(rows), False),
    ):
        if column is not None:
            cells = [*([column] if layout.header else []), *[""] * (len(head) - layout.header)]
            for row, cell in zip((*head, *rows), (*cells, *body), strict=True):
                cell = cell or ("-" if layout.delimiter == " " else "")
                row.insert(0 if first else len(row), cell)
    above = [_join(row, layout, layout.quoted != "none") + layout.ends[0] for row in head]
    return [*layout.remarks, *above, *(_join(row, layout, layout.quoted == "all") + layout.ends[1] for row in rows),
            *layout.below]  # fmt: skip


def _number(value, layout):
    text = f"{value:{',' if layout.thousands else ''}.{layout.digits}f}"
    return "".join({",": layout.thousands, ".": layout.decimal}.get(letter, letter) for letter in text)


def _join(fields, layout, quoted):
    if layout.delimiter == " ":
        fields = [field if quoted or " " not in field else f'"{field}"' for field in fields]
    return layout.delimiter.join(f'"{field}"' if quoted else field for field in fields)
