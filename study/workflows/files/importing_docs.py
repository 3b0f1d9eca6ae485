"""Writes docs/importing.md: how recordings of other programs are imported, and every key of an import map.

The introduction is text in this module; the tables of keys, functions and shipped maps, and the limits of size, come
from the schema and the constants of the code that reads a map, so that page and code agree.
"""

from collections.abc import Iterable

from equalizer.signals.resampling import FLAT_TO
from equalizer.signals.units import ALLOWED
from protocols.document.schema import Node, resolve_reference
from study.importing.arrays.csv_arrays import MOST_ROWS
from study.importing.expressions.budget import (
    COMPUTED,
    COMPUTED_PER_NUMBER,
    DEEPEST,
    HELD,
    HELD_PER_NUMBER,
    MOST_HELD,
)
from study.importing.expressions.functions import FUNCTIONS
from study.importing.map_format.map_toml import MAP_SCHEMA, describe_allowed_in_map
from study.importing.map_library import list_shipped_maps, read_map
from study.regular_file import TABLE_BYTES
from study.store.disk.declared_size import FACTOR, MOST_BYTES, PLAIN_BYTES

EXAMPLE = """\
device = "one axis of our rig"
title = "Noise at two levels, grip by hand"
files = ["drive_*.csv", "daq_*.csv"]
rate_hz = 2000
hold = "zero-order"

[meta]
place_m = [0.0, 0.0, 0.02]
grip = "light"

[let]
zero = "mean(array('load cell')[:100])"

[[clock]]                      # the first clock is the reference
name = "daq"
file = "daq_*.csv"
time = "time"
time_unit = "s"

[[clock]]                      # its logger was started by hand
name = "drive"
file = "drive_*.csv"
time = "t"
time_unit = "ms"
align = "derivative(counts)"   # velocity of the encoder, in counts per second
align_to = "velocity"          # velocity of the vibrometer
align_within_s = 0.5

[[channel]]
role = "command"
name = "fx"
clock = "drive"
value = "clip(current * 0.0231, -3, 3)"
unit = "N"
resample = "held"              # the drive holds its current until the next

[[channel]]
role = "response"
name = "vx"
value = "velocity"
unit = "mm/s"
resample = "band-limited"

[[channel]]
role = "response"
name = "load"
value = "-20 * (array('load cell') - zero)"
unit = "N"
resample = "band-limited"

[[computed]]                   # on the recording's grid
role = "position"
name = "x"
value = "integral(vx - mean(vx))"
unit = "mm"

[[segment]]
kind = "noise"
stop_s = 1.0
role = "fit"

[[segment]]
kind = "noise"
start_s = 1.0
role = "test"
"""
"""The page's example of a map."""

_INTRODUCTION = f"""\
# Importing recordings of others

This page is made from the code (`python -m study.workflows.files.format_docs docs`): change the code, not the page.

```
hapteq import run1.npz run2.npz --map MAP.toml --out rec.h5    # any arrays, by a map
hapteq import run1.csv --out rec.h5                            # named with units: time [s],fx [N]; t_s, force_N, x_mm
hapteq import data.mat --out rec.h5 > MAP.toml                 # unclear names: a map for this file, to be completed
hapteq import FOLDER --out rec.h5                              # its map, ours that fits, or numbered tables by header
```

`hapteq look`, `show`, `diagnose` and `model` also take a file whose names say all as it is, imported in memory;
`validate` says what an import would read, and with which remarks, or why it would refuse.

CSV and other tables, workbooks (XLSX), JSON, NPZ, NPY, MAT (both kinds) and HDF5 are read. The recording is in SI
units, all channels on one uniform rate ([file formats](formats.md)). What was done to the samples is printed and kept
in the recording (`meta/import`): what was resampled and how, which clock was moved and by how much, how many samples
are missing. What cannot be understood is refused by name, and then nothing is written.
`hapteq validate MAP.toml` checks a map.

* **Tables** are read from their rows of numbers upwards: the row above them is the header, or units (`s,N,mm`,
  `[s] [N]`) with the header above; what stands higher, and lines with `#` or `%`, are remarks. Delimiter and decimal
  sign are those by which the rows are numbers. Comments between rows are counted; a line that begins like one but has
  the fields of a row, as one with a spreadsheet's error (`#DIV/0!`), is refused.
  UTF-8, UTF-16 and Windows' western encoding (`µ`, `°`) are understood.
  Other encodings (GBK, Shift-JIS, EUC, KOI8 ...) are recognised by a word for what is measured in them, such as 位移 or
  сила, and that is said; else `encoding` under `[csv]` states it, and the error shows how the text reads in each.
  Delimiters with which all lines end are no columns. Columns of words, columns that number the rows, and lines of words
  below the last row are left out, and that is said. So is a column with words among its numbers, unless the map takes
  it or its name says a quantity or a role: then it is refused. Signs between thousands are refused, and so are
  commas and points that may be such (`1,250`; `1.886` next to `946`) until `decimal` under `[csv]` says that they are
  the decimal sign.
* **Workbooks**: each sheet with rows of numbers is read as a table. Of several, arrays are named with their sheet
  (`Run 1/force [N]`), and sheets that are alike and numbered are parts, which is said. Hidden sheets are left out.
  `sheet` under `[csv]` takes a single one. Percents are read as they are shown where a header says percent. Formulas
  must have been computed, and up to four million cells are read.
* **JSON**: records (`[{{"t": 0, "u": 1}}, ...]`), columns (`{{"t": [0, ...], "u": [1, ...]}}`) or a record in each
  line. What is inside an object is named by it (`imu.x` of records, `run1/u` of columns). A unit beside values
  (`{{"unit": "N", "values": [...]}}`) is theirs; a number next to them, as a scale, is refused, and so is a key that
  occurs twice. Objects that are alike (`run1`, `run2`) are parts if they are numbered.
* **Rows that were logged twice** (the same time stamp, the same values) are left out and counted. Where a stamp occurs
  again with other values, time stands still, and the import is refused with the keys that mend it.
* **Units** are never guessed: a channel without one keeps its numbers, in the unit `1`, and that is said. So is the
  unit in which each computed channel is taken to be. {ALLOWED[0].upper()}{ALLOWED[1:]}; `lb` and `oz` are masses.
  In headers other spellings are understood (`RPM`, `rad/sec`, `m/sec2`, `m/s²`, `°/s`, `kgf·cm`, `oz-in`, `lbf-in`,
  `force / N`, `force, N`); `ms-2` is m/s^2, and `m/s-2` is refused; numbers in `A rms` or `A (peak)` are kept as they
  are, and that is said; a unit that is not known is named, with the nearest one that is.
* **Cells** of Matlab hold a run in each of their arrays, where these are alike (-v6, -v7): `y` of a cell of three is
  `1-of-3/y`, `2-of-3/y`, `3-of-3/y`, and `prefix = "2-of-3/"` a part. A part whose arrays have other names says
  them, as in `let = {{ y = "y_test" }}`.
* **Conditions**: circumstances that were recorded too (a temperature, a pressure, a setting) are a channel with the
  role `condition`.
* **Free motion**: a recording without a command gets one of zeros for each axis, as `[[computed]]` with
  `role = "command"`, `name = "none"`, `value = "0 * clock_s"`, `unit = "N"` (`"N m"` for angles).
* **No time**: where none is known, `unknown = true` of the clock numbers the samples, at 1 Hz; `meta/time` says so
  (`unknown`; `stamps` where the rate is that of the file's own time).
* **Dates and clock times** (`2024-03-01T12:00:00.123+01:00`, with a blank for the T, with or without a zone;
  `12:00:00.123`; a date and a clock time in two columns) are read as seconds since the first, and that is said. Dates
  that do not begin with the year are read where all are the same. Clock times without a date may pass midnight. A clock
  that was set back or ahead by an hour, or a counter that restarts, is refused with the expression that mends it:
  `time = "t + 3600 * cumsum(diff(t) < 0)"` under `[[clock]]`. Stamps with and without a zone are not mixed.
* **Left out** of what is proposed, and said: columns without any number, and further columns of the same time.
* **Resampling** is never done unasked. `held`: a command that stays until the next one. `band-limited`: a signal that
  was sampled behind a filter; flat to {FLAT_TO:.0%} of the lower Nyquist frequency, what is above the new one is taken
  out. `linear`: straight lines. Between uniform rates the band-limited way is exact to 1e-4 of the amplitude up to four
  fifths of the lower Nyquist frequency; from uneven stamps to 5e-5 up to a tenth, and 2e-3 up to a fifth, of their mean
  rate (tested with sinusoids).
* **Even stamps** are those of which each lies within 2 % of a step of its place, or all within the rounding of their
  last decimal, as whole milliseconds at 400 Hz. Steps that are now and then a single unit of a fine last decimal (up to
  2 % of a step) off the usual one, as 9.9 and 10.1 among 10.0 ms, are even too, as long as no stamp lies half a step
  from an even grid; a change of rate is not. Where all steps are multiples of the shortest, and no more than about 2 %
  are longer (in a short table, a few), rows were left out. How far stamps lie from the even grid is said.
* **Missing** samples are NaN. Rows that a uniform logger has left out, and gaps in uneven stamps, become NaN; samples
  next to them are unchanged. Where nothing is missing between them, as in a log of changes, `gap_s` of the clock says
  from which step on there is a gap; the channels then need `resample`.
* **Clocks** of several loggers are brought to the first by `offset_s`, by a trigger that both saw, or by correlating
  one motion that both saw. The offset is said. Where nothing agrees, or two offsets agree equally well, it is refused.
* **Parts**: several files, or several groups of arrays in one file (`prefix`), go one after another; the state of the
  device jumps between them. `meta/parts` says where each begins and ends. Where names of arrays begin alike (`run1__u`,
  `run1__y`, `run2__u`, ...; `run1/force`, ...) the map that is proposed has a part for each run.
* **Segments**: where a map states none, or there is no map, each part whose command repeats exactly, three times or
  more, becomes a segment with that period and its level, and that is said; where nothing repeats none are made.
* **Names** are understood in headers and in the map that is proposed: force, load, torque, position, displacement,
  stroke, encoder, angle, theta, speed, velocity, omega, acceleration, voltage, current, temperature, pressure,
  humidity, setting, supply, yaw, pitch, roll, rpm and what they are in Spanish, German and French (`velocidad`,
  `Drehzahl`, `vitesse`; not `tension`, which is a force in English), with a unit in brackets or at the end
  (`displacement_mm`, `omega_rad_s`, `torque_Nm`). Words may be joined (`Yaw_Rate`, `motorSpeed`).
  Without forces, currents and voltages are commands, or else what is called a command. What is neither drive nor
  motion is a condition.
  Of a force and a displacement alone, neither called a command, the displacement is the command where it follows ramps
  or sines and the force does not, as on a testing machine; else the force. Either is said, with the way to turn it.
  The map that is proposed also takes `cmd`, `input`, `output`, `u` together with `y`, and `ref` or `target` (a helper)
  for what they say. `hapteq diagnose` takes a response in no unit for what its name says.
* **Rate**: where no column is the time, a single number in hertz that is called so (`fs_Hz`, `rate [Hz]`, `sampling
  frequency [Hz]`, not `excitation rate [Hz]`) is the sample rate, or one in seconds (`Ts_s`, `dt [s]`) the step, and
  that is said. In a table it stands in the first row, with nothing below. The map that is proposed takes `fs` and
  `Ts` without a unit, too.
* **Time** runs along the only dimension of a channel. Of a table of arrays take a row (`y[0]`) or column (`y[:, 0]`).
  Signals that carry their own time, as tables of [time, value] and as Simulink stores them (`force.time`,
  `force.signals.values`, several as `scope.signals.1.values`), get a `[[clock]]` each in the map that is proposed;
  signals of one time share it.

With `hold = "zero-order"`, `command[k]` is held from t_k to t_(k+1) and `response[k]` is taken just before. With
`"band-limited"` or `"linear"` both are samples of the same instant.

## An example

Two loggers write a table each: `drive_3.csv` with the columns `t,counts,current`, `daq_3.csv` with
`time [s],velocity [mm/s],load cell [V]`."""
"""Introduction of the page, in Markdown, up to the example of a map."""


def write_importing_page() -> str:
    """The text of docs/importing.md, in Markdown."""
    parts = [
        _INTRODUCTION,
        f"```toml\n{EXAMPLE}```",
        "## Expressions",
        "Numbers, names of arrays, `+ - * / ** %`, comparisons (1 where true, 0 where not), parts of arrays as in "
        "`u[:10]`, `u[::2]`, `y[0]`, and the functions below. `pi` is known; `array('NAME')` takes an array whose name "
        "is no word. A column `fx [N]` is also known as `fx`. Structures of Matlab are `array('data.u')`, datasets of "
        "HDF5 `array('run1/force')`. In computed channels `clock_s` is the reference time and `rate_hz` the rate. "
        "Nothing else is understood: an expression cannot run code.",
        f"All expressions of an import together may hold {HELD:.0e} numbers at once and {HELD_PER_NUMBER} times as "
        f"many as its files hold ({MOST_HELD:.0e} at most), compute {COMPUTED:.0e} and {COMPUTED_PER_NUMBER} times as "
        f"many, and nest {DEEPEST} levels deep, definitions included; beyond that they are refused by name.",
        _rows(("function", "gives"), ((f"`{f.usage}`", f.meaning) for f in FUNCTIONS.values())),
        "## What is not read",
        "Only regular files: no pipes, devices or folders. A file is held to its size on disk before any memory is "
        f"taken for it: what it declares may be {PLAIN_BYTES // 2**20} MiB in any case, beyond that {FACTOR} times "
        f"its bytes, and {MOST_BYTES // 2**30} GiB at most (an hour of nine channels at 10 kHz is 2.6 GB). Compress "
        f"less, or cut the recording, where that is refused. Tables may have {TABLE_BYTES // 2**20} MiB and "
        f"{MOST_ROWS:.0e} rows. HDF5: no external storage, no virtual datasets, no links to other files. NPY and NPZ: "
        "versions 1.0 and 2.0, stored or deflated, no Python objects. MAT: versions 5 to 7.3 (Matlab's -v6, -v7, "
        "-v7.3); texts, sparse matrices, objects (timeseries, tables) and cells of unlike arrays (in -v7.3 all cells) "
        "are left out, and named, with what to write in Matlab instead.",
        "## Keys of a map",
        _keys("At the top", MAP_SCHEMA),
        *(_keys(_title(name, node), _table_of(node)) for name, node in _tables()),
        "## Maps that come with hapteq",
        "For public recordings; no data are in them. `--map NAME` takes one.",
        _rows(("name", "files", "what"), (_map_row(name) for name in list_shipped_maps())),
    ]
    return "\n\n".join(parts) + "\n"


def _tables() -> list[tuple[str, Node]]:
    """Name and schema of each table of a map."""
    return [(name, node) for name, node in MAP_SCHEMA["properties"].items() if _table_of(node)]


def _table_of(node: Node) -> Node:
    """Schema of a table, or of the entries of a list of tables; empty for a plain value."""
    inner = resolve_reference(MAP_SCHEMA, node)
    entries = resolve_reference(MAP_SCHEMA, inner["items"]) if inner.get("type") == "array" else inner
    return entries if "properties" in entries else {}


def _title(name: str, node: Node) -> str:
    """Header of a table as it is written in TOML: `[[name]]` for a list of tables, else `[name]`."""
    return f"`[[{name}]]`" if resolve_reference(MAP_SCHEMA, node).get("type") == "array" else f"`[{name}]`"


def _keys(title: str, table: Node) -> str:
    """Section about the plain keys of a table, as a Markdown table."""
    plain = [(key, node) for key, node in table["properties"].items() if table is not MAP_SCHEMA or not _table_of(node)]
    needed = table.get("required", ())
    rows = (
        (
            f"`{key}`{' (needed)' if key in needed else ''}",
            describe_allowed_in_map(node, key),
            node.get("description", ""),
        )
        for key, node in plain
    )
    return f"### {title}\n\n{_rows(('key', 'holds', 'meaning'), rows)}"


def _map_row(name: str) -> tuple[str, str, str]:
    """Name, file patterns and title of a shipped map."""
    found = read_map(name).map
    return f"`{name}`", ", ".join(f"`{pattern}`" for pattern in found.files), found.title


def _rows(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table. A bar within a cell would end it and is replaced by a slash."""
    lines = [heading, tuple("---" for _ in heading), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)
