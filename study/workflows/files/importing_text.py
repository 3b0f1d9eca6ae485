"""Prose of docs/importing.md, in Markdown: how recordings of other programs are imported.

`importing_docs` joins the text with the tables of keys, functions and shipped maps. Limits of size, except that of the
cells of workbooks, are inserted from the constants of the code that reads the files, so that both agree.
"""

from equalizer.signals.resampling import PASSBAND
from equalizer.signals.units import UNITS_CLAUSE
from study.importing.arrays.csv_arrays import MAX_ROWS
from study.importing.expressions.budget import (
    COMPUTED_NUMBERS,
    COMPUTED_PER_NUMBER,
    HELD_NUMBERS,
    HELD_PER_NUMBER,
    MAX_EXPRESSION_DEPTH,
    MAX_HELD_NUMBERS,
)
from study.regular_file import MAX_TABLE_BYTES
from study.store.disk.declared_size import MAX_EXPANSION, MAX_LIMIT_BYTES, MIN_LIMIT_BYTES

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
"""Example of an import map (TOML)."""

_COMMANDS_AND_RESULT = """\
# Importing recordings of others

This page is generated from the code (`python -m study.workflows.files.format_docs docs`): change the code, not the
page.

```
hapteq import run1.npz run2.npz --map MAP.toml --out rec.h5    # any arrays, by a map
hapteq import run1.csv --out rec.h5                            # header with units: time [s],fx [N]; t_s,force_N,pos_mm
hapteq import data.mat --out rec.h5 > MAP.toml                 # unclear names: prints a map of this file, to complete
hapteq import FOLDER --out rec.h5                              # its map, a shipped map, or numbered tables by header
```

`hapteq look`, `show`, `diagnose` and `model` also accept a file directly if the names in it state all that an import
needs; the file is imported in memory. `hapteq validate FILE` reports what an import would read, with its remarks, or
why it would refuse the file. `hapteq validate MAP.toml` checks a map.

An import reads CSV and other tables, workbooks (XLSX), JSON, NPZ, NPY, MAT (both kinds) and HDF5. The recording is in
SI units, with all channels on one uniform rate ([file formats](formats.md)). The import prints what it did to the
samples and stores it in the recording (`meta/import`): which channels were resampled and how, which clock was shifted
and by how much, how many samples are missing. On this page, *reported* means printed and stored in this way. An import
refuses what it cannot interpret, by name, and then writes nothing."""
"""Beginning of the page: commands, accepted files, result."""

_FILES = """\
## File types

* **Tables.**
    * Header: the row above the rows of numbers is the header. If that row contains units (`s,N,mm`, `[s] [N]`), the row
      above it is the header. Higher lines, and lines with `#` or `%`, are comments.
    * Delimiter and decimal sign are those with which the rows are numbers. Delimiters at the end of all lines do not
      make columns.
    * Comments between rows are counted. A line that begins like a comment but has the fields of a row is refused, such
      as a row with a spreadsheet's error (`#DIV/0!`).
    * Encoding: UTF-8, UTF-16 and Windows' western encoding (`µ`, `°`) are detected. Other encodings (GBK, Shift-JIS,
      EUC, KOI8 ...) are detected by a word for a quantity in the text, such as 位移 or сила, and reported. If this
      fails, `encoding` under `[csv]` states the encoding; the error shows how the text reads in each candidate.
    * Left out, and reported: columns of words, columns that number the rows, and lines of words below the last row. A
      column with words among its numbers is left out, too. It is refused if the map uses it, or if its name states a
      quantity or a role.
    * Separators of thousands are refused. Commas and points that may be such (`1,250`; `1.886` next to `946`) are
      refused until `decimal` under `[csv]` states that they are the decimal sign.
* **Workbooks.** Each sheet with rows of numbers is read as a table. With several sheets, the names of arrays begin with
  their sheet (`Run 1/force [N]`). Sheets that are alike and numbered are parts, which is reported. Hidden sheets are
  left out. `sheet` under `[csv]` selects a single sheet. Percentages are read as displayed if a header says percent.
  Formulas must have stored results. At most four million cells are read.
* **JSON.** Three forms: records (`[{"t": 0, "u": 1}, ...]`), columns (`{"t": [0, ...], "u": [1, ...]}`), or a record in
  each line. Names of nested values begin with their object (`imu.x` of records, `run1/u` of columns). A unit beside
  values belongs to them (`{"unit": "N", "values": [...]}`). A number beside values, such as a scale, is refused, and so
  is a duplicate key. Objects that are alike and numbered (`run1`, `run2`) are parts, and so are records most of which
  hold lists of at least 16 values, of several lengths (`data/1/u`).
* **Matlab cells** (-v6, -v7) whose arrays are alike contain one run per array. `y` of a cell of three arrays is
  `1-of-3/y`, `2-of-3/y`, `3-of-3/y`; `prefix = "2-of-3/"` selects a part. A part whose arrays have other names states
  them, as in `let = { y = "y_test" }`.
* **Duplicate rows** (same time stamp, same values) are left out and counted. If a stamp repeats with other values, the
  time does not advance: the import is refused, with the keys that correct it."""

_CHANNELS = f"""\
## Channels, names and units

* **Units** are never guessed. A channel without a unit keeps its numbers and has the unit `1`, which is reported. The
  assumed unit of each computed channel is reported, too, and so is a unit that differs from the one in the name of the
  array, such as `N` in the map for `force [kN]`: the map is followed.
  {UNITS_CLAUSE[0].upper()}{UNITS_CLAUSE[1:]}; `lb` and `oz` are masses.
  In headers other spellings are understood (`RPM`, `rad/sec`, `m/sec2`, `m/s²`, `°/s`, `kgf·cm`, `oz-in`, `lbf-in`,
  `force / N`, `force, N`). `ms-2` is m/s^2; `m/s-2` is refused. Numbers in `A rms` or `A (peak)` are kept unchanged,
  which is reported. An error about an unknown unit names the nearest known one.
* **Names** that are understood in headers and in the proposed map: force, load, torque, position, displacement, stroke,
  encoder, angle, theta, speed, velocity, omega, acceleration, voltage, current, temperature, pressure, humidity,
  setting, supply, yaw, pitch, roll, rpm, and their Spanish, German and French equivalents (`velocidad`, `Drehzahl`,
  `vitesse`; not `tension`, which is a force in English). The unit is in brackets or at the end (`displacement_mm`,
  `omega_rad_s`, `torque_Nm`). Words may be joined (`Yaw_Rate`, `motorSpeed`). The proposed map also interprets `cmd`,
  `input`, `output`, `u` together with `y`, and `ref` or `target` (a helper). `hapteq diagnose` accepts a response
  without a unit, with the quantity that its name states.
* **Roles.** Without forces, currents and voltages are commands, or else a signal that is called a command. A signal
  that is neither drive nor motion is a condition. With only a force and a displacement, neither called a command, the
  displacement is the command if it follows ramps or sines and the force does not, as on a testing machine. Otherwise
  the force is the command. Either result is reported, with the way to exchange the roles.
* **Conditions** are recorded circumstances (a temperature, a pressure, a setting): channels with the role `condition`.
* **Free motion.** A recording without a command gets a command of zeros for each axis: `[[computed]]` with
  `role = "command"`, `name = "none"`, `value = "0 * clock_s"`, `unit = "N"` (`"N m"` for angles).
* **Left out** of the proposed map, and reported: columns without any number, and repeated columns of the same time."""

_TIME = f"""\
## Time and rate

* **Dimension.** Time runs along the only dimension of a channel. Of a table of arrays select a row (`y[0]`) or a column
  (`y[:, 0]`).
* **Own time.** Some signals contain their own time: tables of [time, value], and Simulink's structures (`force.time`,
  `force.signals.values`, several as `scope.signals.1.values`). In the proposed map each has a `[[clock]]`; signals of
  the same time share it.
* **Dates and clock times** are read as seconds since the first, which is reported: `2024-03-01T12:00:00.123+01:00`
  (with a blank in place of the T, with or without a zone), `12:00:00.123`, or a date and a clock time in two columns.
  Dates that do not begin with the year are read if all are the same. Clock times without a date may pass midnight. A
  clock that was set back or ahead by an hour, or a counter that restarts, is refused, with the expression that corrects
  it: `time = "t + 3600 * cumsum(diff(t) < 0)"` under `[[clock]]`. Stamps with and without a zone must not be mixed.
* **Rate.** If no column is the time, a single number in hertz with the name of a sample rate is the rate (`fs_Hz`,
  `rate [kHz]`, `sampling frequency [Hz]`, not `excitation rate [Hz]`), or one in seconds (`Ts_s`, `dt [ms]`) is the
  step; this is reported. In a table the number stands in the first row, with nothing below it. The proposed map
  accepts `fs` and `Ts` without a unit, too.
* **Usable band.** `band_hz = [25, 1500]` in `[meta]` states the lowest and the highest frequency (Hz) at which the
  recording is valid, for instance because an accelerometer's noise hides the motion below. Where a diagnosis fits a
  first linear model to frequency responses, it fits it there.
* **Unknown time.** `unknown = true` of the clock numbers the samples, at 1 Hz. `meta/time` states it (`unknown`;
  `stamps` if the rate is that of the file's own time).
* **Uniform stamps.** Stamps are uniform in two cases: each lies within 2 % of a step of its grid point, or all lie
  within the rounding of their last decimal (such as whole milliseconds at 400 Hz). Stamps are also uniform if steps
  occasionally differ from the usual step by a single unit of a fine last decimal (at most 2 % of a step), such as 9.9
  and 10.1 among 10.0 ms, and no stamp is half a step from the grid. A change of rate is not uniform. If all steps are
  multiples of the shortest, and at most 2 % are longer, rows were skipped; if more are longer, as after one gap in a
  table of 40 rows, the stamps are not uniform. The deviation of stamps from the grid is reported.
* **Missing samples** are NaN. Rows that a uniform logger skipped, and gaps in non-uniform stamps, become NaN; the
  samples next to them are unchanged. If nothing is missing between distant stamps, as in a log of changes, `gap_s` of
  the clock states the step from which on there is a gap; the channels then need `resample`.
* **Resampling** is done only if the map requests it.
    * `held`: a command that stays until the next one.
    * `band-limited`: a signal that was sampled behind a filter. The response is flat to {PASSBAND:.0%} of the lower
      Nyquist frequency; components above the new Nyquist frequency are removed.
    * `linear`: straight lines between samples.
    * Accuracy of `band-limited` (tested with sinusoids): between uniform rates, 1e-4 of the amplitude up to four fifths
      of the lower Nyquist frequency; from non-uniform stamps, 5e-5 up to a tenth and 2e-3 up to a fifth of their mean
      rate.
* **Several loggers.** Their clocks are aligned to the first clock by `offset_s`, by a trigger that both recorded, or by
  cross-correlation of one motion that both recorded. The offset is reported. If nothing agrees, or if two offsets agree
  equally well, the import is refused.
* **Hold.** With `hold = "zero-order"`, `command[k]` is held from t_k to t_(k+1), and `response[k]` is sampled just
  before `command[k]`. With `"band-limited"` or `"linear"`, both are samples of the same instant."""

_PARTS_AND_EXAMPLE = """\
## Parts and segments

* **Parts.** Several files, or several groups of arrays in one file (`prefix`), follow one another in the recording; the
  state of the device jumps between them. `meta/parts` states where each begins and ends. If names of arrays begin alike
  (`run1__u`, `run1__y`, `run2__u`, ...; `run1/force`, ...), the proposed map has a part for each run.
* **Segments.** Without segments in the map, or without a map, each part whose command repeats exactly, three times or
  more, becomes a segment with that period and its level, which is reported. If nothing repeats, there are no segments.

## An example

Two loggers write a table each: `drive_3.csv` with the columns `t,counts,current`, `daq_3.csv` with
`time [s],velocity [mm/s],load cell [V]`."""
"""Section on parts and segments, and the introduction of the example."""

INTRODUCTION = "\n\n".join((_COMMANDS_AND_RESULT, _FILES, _CHANNELS, _TIME, _PARTS_AND_EXAMPLE))
"""Text of the page up to the example of a map."""

EXPRESSIONS = (
    "An expression may contain numbers, names of arrays, `+ - * / ** %`, comparisons (1 where true, 0 where not), "
    "parts of arrays as in `u[:10]`, `u[::2]`, `y[0]`, and the functions below. `pi` is a constant. `array('NAME')` is "
    "an array whose name is not an identifier. A column `fx [N]` is also available as `fx`, unless there are several. "
    "Matlab structures are `array('data.u')`, HDF5 datasets `array('run1/force')`. In computed channels `clock_s` is "
    "the reference time and `rate_hz` the rate. An array has precedence over a definition (`let`) of its name, which "
    "is reported. Other syntax is refused: an expression cannot run code.",
    "Limits for all expressions of an import together, definitions included: "
    f"{HELD_NUMBERS:.0e} numbers at once, plus {HELD_PER_NUMBER} for each number in the files (at most "
    f"{MAX_HELD_NUMBERS:.0e}); {COMPUTED_NUMBERS:.0e} computed numbers, plus {COMPUTED_PER_NUMBER} for each number in "
    f"the files; {MAX_EXPRESSION_DEPTH} levels of nesting. Expressions beyond these limits are refused, by name.",
)
"""Paragraphs on expressions, above the table of functions."""

NOT_READ = (
    "* **Special files.** Only regular files are read: no pipes, devices or folders.\n"
    "* **Size.** The declared size of a file's contents is checked against its size on disk before memory is "
    f"allocated. It may be {MIN_LIMIT_BYTES // 2**20} MiB for any file, and for larger contents {MAX_EXPANSION} times "
    f"the bytes on disk, at most {MAX_LIMIT_BYTES // 2**30} GiB (an hour of nine channels at 10 kHz is 2.6 GB). If a "
    "file is refused for this reason, compress it less or cut the recording. Tables may have "
    f"{MAX_TABLE_BYTES // 2**20} MiB and {MAX_ROWS:.0e} rows.\n"
    "* **HDF5.** No external storage, no virtual datasets, no links to other files. The attributes `scale_factor` and "
    "`add_offset` of netCDF are not applied, which is reported; the map's `value` can state them.\n"
    "* **NPY and NPZ.** Versions 1.0 and 2.0, stored or deflated; no Python objects.\n"
    "* **MAT.** Versions 5 to 7.3 (Matlab's -v6, -v7, -v7.3). Texts, sparse matrices, objects (timeseries, tables) and "
    "cells of unlike arrays (in -v7.3 all cells) are left out. The import names them, and the Matlab command to use "
    "instead."
)
"""Section on files that are refused, and contents that are left out."""

SHIPPED_MAPS = "Maps for public recordings; they contain no data. `--map NAME` selects a map."
"""Sentence above the table of the shipped maps."""
