"""Data classes of an import map: which arrays of a file are channels of a recording, with unit, clock and use.

An import map is a TOML document; every key of it is a field here, and docs/importing.md is generated from the
descriptions. `map_toml` parses and validates a document, `study.importing.build_recording` applies it.
"""

from dataclasses import field
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

TABLE_CONFIG = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Validation of every table of a map: unknown keys, NaN and infinity are refused."""

LONGEST_CHANNEL_NAME = 64
"""Longest name of a channel (characters). Chosen."""
Resampling = Literal["", "held", "band-limited", "linear"]
"""Interpolation of samples at the times of the recording's grid; empty: the samples must lie on the grid."""
SignalRole = Literal["command", "response", "position", "excitation", "condition", "helper"]
"""Role of a channel in the recording; a helper is used by computed channels only and is not written."""
ExcitationKind = Literal["multisine", "sweep", "sine", "slow", "noise", "binary", "step", "impact", "free", "rest"]
"""Kind of the excitation of a segment."""


@dataclass(frozen=True, config=TABLE_CONFIG)
class CsvMap:
    """Notation of a text table or workbook, where it is not detected from the file."""

    skip_lines: Annotated[int, Field(ge=0, description="Number of lines before the header. Default 0.")] = 0
    delimiter: Annotated[str, Field(description="Separator of the fields. Default: detected.")] = ""
    decimal: Annotated[Literal["", ".", ","], Field(description="Decimal sign. Default: detected.")] = ""
    encoding: Annotated[
        str,
        Field(description='Encoding, such as "gb18030", "shift_jis", "cp1251". Default: UTF-8, UTF-16, or detected.'),
    ] = ""
    sheet: Annotated[
        str,
        Field(
            description="Name of the only sheet of a workbook to be read. Default: all that contain rows of numbers."
        ),
    ] = ""
    names: Annotated[
        tuple[str, ...], Field(description="Names of the columns of a table without a header. Default: none.")
    ] = ()


@dataclass(frozen=True, config=TABLE_CONFIG)
class ClockMap:
    """Clock of one data logger. The first clock of a map is the reference, to which the others are aligned."""

    name: Annotated[str, Field(description='Name by which channels refer to the clock. Default "clock".')] = "clock"
    file: Annotated[
        str, Field(description="Pattern of the file that contains the clock, where several files make one recording.")
    ] = ""
    time: Annotated[str, Field(description="Expression that gives the time stamps.")] = ""
    time_unit: Annotated[str, Field(description="Unit of the stamps; needed with `time`.")] = ""
    rate_hz: Annotated[float, Field(ge=0, description="Rate of a clock without stamps.")] = 0.0
    rate: Annotated[str, Field(description="Rate as an expression, in hertz, for a rate that the file contains.")] = ""
    unknown: Annotated[
        bool,
        Field(description="Whether the time is unknown. Samples are then numbered, at 1 Hz, and `meta` states it."),
    ] = False
    gap_s: Annotated[
        float,
        Field(
            ge=0, description="Time between stamps above which there is a gap. Default: three times the median step."
        ),
    ] = 0.0
    offset_s: Annotated[
        float, Field(description="Added to this clock's time to give that of the first clock. Default 0.")
    ] = 0.0
    trigger: Annotated[
        str, Field(description="Expression on this clock; its first crossing of `trigger_level` is the trigger.")
    ] = ""
    trigger_level: Annotated[float, Field(description="Level of `trigger`. Default 0.")] = 0.0
    reference_trigger: Annotated[str, Field(description="Expression on the first clock with the same trigger.")] = ""
    reference_level: Annotated[float, Field(description="Level of `reference_trigger`. Default 0.")] = 0.0
    align: Annotated[
        str,
        Field(description="Expression on this clock for the same motion as `align_to`; the two are cross-correlated."),
    ] = ""
    align_to: Annotated[str, Field(description="Expression on the first clock for the motion of `align`.")] = ""
    align_within_s: Annotated[
        float, Field(gt=0, description="Largest offset searched, beyond `offset_s`. Default 1.")
    ] = 1.0


@dataclass(frozen=True, config=TABLE_CONFIG)
class ChannelMap:
    """One channel, from an array or an expression with arrays; all its samples are on one clock."""

    role: Annotated[
        SignalRole,
        Field(
            description="Role of the channel. A `condition` is a circumstance (temperature, pressure, a setting); a "
            "`helper` is used by computed channels only and is not written."
        ),
    ]
    name: Annotated[
        str, Field(min_length=1, max_length=LONGEST_CHANNEL_NAME, description="Name of the channel in the recording.")
    ]
    value: Annotated[str, Field(description="Name of an array, or an expression with arrays.")]
    unit: Annotated[
        str, Field(description="Unit of `value`; converted to SI. Default `1`: not stated, a plain number.")
    ] = ""
    quantity: Annotated[
        str, Field(description='"force", "acceleration", ... Default: the usual word for the unit.')
    ] = ""
    clock: Annotated[str, Field(description="Name of the channel's clock. Default: the first.")] = ""
    resample: Annotated[
        Resampling,
        Field(
            description="Resampling; needed where the samples do not lie on the recording's grid. `held` for a "
            "command that stays until the next one, `band-limited` for a signal sampled behind a filter, `linear`."
        ),
    ] = ""


@dataclass(frozen=True, config=TABLE_CONFIG)
class ComputedMap:
    """One channel that is computed from other channels on the grid of the recording, in the units of the map."""

    role: Annotated[SignalRole, Field(description="As for a channel.")]
    name: Annotated[
        str, Field(min_length=1, max_length=LONGEST_CHANNEL_NAME, description="Name of the channel in the recording.")
    ]
    value: Annotated[str, Field(description="Expression with channels, by name; `clock_s` is the reference time.")]
    unit: Annotated[str, Field(description="Unit of `value`. Default `1`: not stated, a plain number.")] = ""
    quantity: Annotated[str, Field(description="As for a channel.")] = ""


@dataclass(frozen=True, config=TABLE_CONFIG)
class PartMap:
    """A part of the recording, from one file. Without any entry, each file is one part, in the given order, or all
    files are one part where clocks state their `file`."""

    file: Annotated[str, Field(description='Pattern; each file that matches is one part, in order. Default "*".')] = "*"
    prefix: Annotated[
        str, Field(description="Beginning of the names of this part's arrays; expressions omit it. Default: none.")
    ] = ""
    start_s: Annotated[float, Field(ge=0, description="Begin, after the first sample. Default 0.")] = 0.0
    stop_s: Annotated[
        float, Field(ge=0, description="End, after the first sample. Default 0: the end of the file.")
    ] = 0.0
    let: Annotated[dict[str, str], Field(description="Expressions by name, for this part only.")] = field(
        default_factory=dict
    )


@dataclass(frozen=True, config=TABLE_CONFIG)
class SegmentMap:
    """Excitation and use of a range of samples, counted on the grid of the recording within each matching part."""

    kind: Annotated[ExcitationKind, Field(description="Kind of the excitation.")]
    file: Annotated[str, Field(description='Pattern of the file names of the parts. Default "*".')] = "*"
    prefix: Annotated[str, Field(description='Pattern of the prefixes of the parts. Default "*".')] = "*"
    start: Annotated[int, Field(description="First sample. Default 0. Negative: counted from the end.")] = 0
    stop: Annotated[
        int, Field(description="The sample after the last. Default 0: the end; negative: counted from the end.")
    ] = 0
    start_s: Annotated[float, Field(ge=0, description="Begin in seconds, in place of `start`.")] = 0.0
    stop_s: Annotated[float, Field(ge=0, description="End in seconds, in place of `stop`.")] = 0.0
    every: Annotated[
        int, Field(ge=0, description="Number of samples from one segment to the next. Default 0: a single segment.")
    ] = 0
    length: Annotated[
        int, Field(ge=0, description="Number of samples of each of these segments. Default 0: as long as `every`.")
    ] = 0
    amplitude: Annotated[
        float,
        Field(ge=-1, description="Peak of the excitation, in the command's unit in the map. Default -1: measured."),
    ] = -1.0
    period: Annotated[int, Field(ge=0, description="Samples per period. Default 0: not periodic.")] = 0
    role: Annotated[Literal["", "fit", "test"], Field(description="Use of the samples. Default: empty.")] = ""
    split: Annotated[
        dict[str, float],
        Field(
            description='Shares of the segment by role, in order, as in `{ fit = 0.5, test = 0.5 }`; "" excludes a '
            "share."
        ),
    ] = field(default_factory=dict)


@dataclass(frozen=True, config=TABLE_CONFIG)
class PairMap:
    """Two files of the same device, recorded before and after a change of the device."""

    before: Annotated[str, Field(min_length=1, description="Pattern of the file from before the change.")]
    after: Annotated[str, Field(min_length=1, description="Pattern of the file from after the change.")]
    changed: Annotated[str, Field(min_length=1, description="The change, in words.")]


@dataclass(frozen=True, config=TABLE_CONFIG)
class DiagnosisMap:
    """Information for `hapteq real` in addition to the samples: model, tests, pairs, known parameters."""

    model: Annotated[
        str,
        Field(
            description="A mechanical model in the map's folder, or a shipped one. Default: a linear model is fitted."
        ),
    ] = ""
    tests: Annotated[
        str, Field(description="Name of the map whose model these recordings only test. They are then not diagnosed.")
    ] = ""
    skip: Annotated[
        str, Field(description="Reason why these recordings are not diagnosed. Default: they are diagnosed.")
    ] = ""
    volume_free: Annotated[
        bool,
        Field(description="Whether the level of such a test is unknown; a single gain is then fitted. Default false."),
    ] = False
    nominal: Annotated[
        dict[str, float],
        Field(description="Parameters of the device known by other means: mass, damping, stiffness, in SI units."),
    ] = field(default_factory=dict)
    pair: Annotated[
        tuple[PairMap, ...],
        Field(description="Pairs of files from before and after a change, where each file is a separate recording."),
    ] = ()
    objections: Annotated[
        tuple[str, ...], Field(description="Limitations that an expert would point out, one sentence each.")
    ] = ()


@dataclass(frozen=True, config=TABLE_CONFIG)
class ImportMap:
    """An import map: how one kind of file of a laboratory becomes a recording."""

    channel: Annotated[tuple[ChannelMap, ...], Field(min_length=1, description="Channels, one [[channel]] each.")]
    device: Annotated[str, Field(min_length=1, max_length=200, description="Name of the recorded device.")]
    title: Annotated[str, Field(description="Title of the recording. Default: empty.")] = ""
    files: Annotated[
        tuple[str, ...],
        Field(min_length=1, description='Patterns of the file names that the map is for, in order. Default ["*"].'),
    ] = ("*",)
    separate: Annotated[
        bool, Field(description="Whether every file is a separate recording. Default false: all files make one.")
    ] = False
    rate_hz: Annotated[
        float,
        Field(
            ge=0, description="Rate of the recording. Default 0: that of its fastest clock; needed for uneven stamps."
        ),
    ] = 0.0
    hold: Annotated[
        Literal["zero-order", "band-limited", "linear"],
        Field(description='Course of the command between the recording\'s samples. Default "zero-order".'),
    ] = "zero-order"
    let: Annotated[dict[str, str], Field(description="Expressions by name, for use in all others.")] = field(
        default_factory=dict
    )
    numbers: Annotated[
        dict[str, str], Field(description="Numbers from the file, such as gains, stored in `meta` for each part.")
    ] = field(default_factory=dict)
    clock: Annotated[tuple[ClockMap, ...], Field(min_length=1, description="Clocks, one [[clock]] each.")] = (
        ClockMap(),
    )
    computed: Annotated[tuple[ComputedMap, ...], Field(description="Computed channels, one [[computed]] each.")] = ()
    part: Annotated[tuple[PartMap, ...], Field(description="Parts, one [[part]] each.")] = ()
    segment: Annotated[tuple[SegmentMap, ...], Field(description="Segments, one [[segment]] each.")] = ()
    csv: Annotated[CsvMap, Field(description="Notation of tables.")] = field(default_factory=CsvMap)
    diagnosis: Annotated[
        DiagnosisMap, Field(description="Information for `hapteq real` in addition to the samples.")
    ] = field(default_factory=DiagnosisMap)
    meta: Annotated[
        dict[str, Any],
        Field(description="Further information: place_m, feedback (gains), sensor, grip, operator, notes; band_hz."),
    ] = field(default_factory=dict)
