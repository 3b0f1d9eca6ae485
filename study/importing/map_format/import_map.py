"""The import map: which array is which channel, in which unit, on which clock, and the role of samples.

Every key of a map's TOML is a field here; docs/importing.md is made from these descriptions.
"""

from dataclasses import field
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field
from pydantic.dataclasses import dataclass

STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)
"""Of every table of a map: no unknown keys, no NaN or infinity."""

Resampling = Literal["", "held", "band-limited", "linear"]
"""How samples are put onto the recording's grid; empty: they must lie on it."""
SignalRole = Literal["command", "response", "position", "excitation", "condition", "helper"]
"""What a channel is in the recording; a helper is not written."""
Kind = Literal["multisine", "sweep", "sine", "slow", "noise", "binary", "step", "impact", "free", "rest"]
"""Kind of the excitation of a segment."""


@dataclass(frozen=True, config=STRICT)
class CsvMap:
    """Notation of tables, where it cannot be detected from the file itself."""

    skip_lines: Annotated[int, Field(ge=0, description="Number of lines before the header. Default 0.")] = 0
    delimiter: Annotated[str, Field(description="Separator of fields. Default: detected.")] = ""
    decimal: Annotated[Literal["", ".", ","], Field(description="Decimal sign. Default: detected.")] = ""
    encoding: Annotated[
        str,
        Field(description='Encoding, such as "gb18030", "shift_jis", "cp1251". Default: UTF-8, UTF-16, or detected.'),
    ] = ""
    sheet: Annotated[
        str, Field(description="The only sheet of a workbook to be read. Default: all that hold rows of numbers.")
    ] = ""
    names: Annotated[
        tuple[str, ...], Field(description="Names of the columns of a table without a header. Default: none.")
    ] = ()


@dataclass(frozen=True, config=STRICT)
class ClockMap:
    """One logger's time. The first clock is the reference; the others are aligned to it."""

    name: Annotated[str, Field(description='Channels refer to it. Default "clock".')] = "clock"
    file: Annotated[
        str, Field(description="Which of the files it is in, as a pattern, where several files make one recording.")
    ] = ""
    time: Annotated[str, Field(description="Expression that gives the time stamps.")] = ""
    time_unit: Annotated[str, Field(description="Unit of the stamps; needed with `time`.")] = ""
    rate_hz: Annotated[float, Field(ge=0, description="Rate of a clock without stamps.")] = 0.0
    rate: Annotated[str, Field(description="The same as an expression, in hertz, for a rate that is in the file.")] = ""
    unknown: Annotated[
        bool, Field(description="Whether no time is known: samples are numbered, at 1 Hz, and meta says so.")
    ] = False
    gap_s: Annotated[
        float,
        Field(ge=0, description="Stamps further apart are a gap. Default: three times the median step."),
    ] = 0.0
    offset_s: Annotated[float, Field(description="Added to its time to give that of the first clock. Default 0.")] = 0.0
    trigger: Annotated[
        str, Field(description="Expression on this clock whose first passage through `trigger_level` is the trigger.")
    ] = ""
    trigger_level: Annotated[float, Field(description="See `trigger`. Default 0.")] = 0.0
    reference_trigger: Annotated[
        str, Field(description="Expression on the first clock that shows the same trigger.")
    ] = ""
    reference_level: Annotated[float, Field(description="See `reference_trigger`. Default 0.")] = 0.0
    align: Annotated[
        str, Field(description="Expression on this clock that shows the same motion as `align_to`: cross-correlated.")
    ] = ""
    align_to: Annotated[str, Field(description="Expression on the first clock.")] = ""
    align_within_s: Annotated[
        float, Field(gt=0, description="Largest offset that is searched, beyond `offset_s`. Default 1.")
    ] = 1.0


@dataclass(frozen=True, config=STRICT)
class ChannelMap:
    """One channel, from an array or an expression over arrays; all its samples are on one clock."""

    role: Annotated[
        SignalRole,
        Field(
            description="What it is. A `condition` is a circumstance (temperature, pressure, a setting); a `helper` is "
            "used by computed channels only and is not written."
        ),
    ]
    name: Annotated[str, Field(min_length=1, max_length=64, description="Of the channel in the recording.")]
    value: Annotated[str, Field(description="Name of an array, or an expression over arrays.")]
    unit: Annotated[str, Field(description="Of `value`; converted to SI. Default `1`: not stated, a plain number.")] = (
        ""
    )
    quantity: Annotated[
        str, Field(description='"force", "acceleration", ... Default: the usual word for the unit.')
    ] = ""
    clock: Annotated[str, Field(description="Its clock, by name. Default: the first.")] = ""
    resample: Annotated[
        Resampling,
        Field(
            description="Needed where its samples do not lie on the recording's: `held` for a command that stays "
            "until the next, `band-limited` for a signal sampled behind a filter, `linear`."
        ),
    ] = ""


@dataclass(frozen=True, config=STRICT)
class ComputedMap:
    """One channel computed on the recording's own grid from other channels, in the units of the map."""

    role: Annotated[SignalRole, Field(description="As for a channel.")]
    name: Annotated[str, Field(min_length=1, max_length=64, description="Of the channel in the recording.")]
    value: Annotated[str, Field(description="Expression over channels, by name; `clock_s` is the reference time.")]
    unit: Annotated[str, Field(description="Of `value`. Default `1`: not stated, a plain number.")] = ""
    quantity: Annotated[str, Field(description="As for a channel.")] = ""


@dataclass(frozen=True, config=STRICT)
class PartMap:
    """A stretch of the recording, from one file. Without any, every file is one part, in the order given."""

    file: Annotated[str, Field(description='Pattern; each file that fits is one part, in order. Default "*".')] = "*"
    prefix: Annotated[str, Field(description="Arrays of this part begin so; expressions omit it. Default: none.")] = ""
    start_s: Annotated[float, Field(ge=0, description="Where to begin, after the first sample. Default 0.")] = 0.0
    stop_s: Annotated[float, Field(ge=0, description="Where to end, after the first sample. Default 0: the end.")] = 0.0
    let: Annotated[dict[str, str], Field(description="Expressions by name, for this part only.")] = field(
        default_factory=dict
    )


@dataclass(frozen=True, config=STRICT)
class SegmentMap:
    """What samples are, counted on the recording's grid within each part that fits."""

    kind: Annotated[Kind, Field(description="Of the excitation.")]
    file: Annotated[str, Field(description='Parts from files that fit this pattern. Default "*".')] = "*"
    prefix: Annotated[str, Field(description='Parts whose prefix fits this pattern. Default "*".')] = "*"
    start: Annotated[int, Field(description="First sample. Default 0. Negative: counted from the end.")] = 0
    stop: Annotated[int, Field(description="The sample after the last. Default 0: the end; negative: from it.")] = 0
    start_s: Annotated[float, Field(ge=0, description="In place of `start`.")] = 0.0
    stop_s: Annotated[float, Field(ge=0, description="In place of `stop`.")] = 0.0
    every: Annotated[int, Field(ge=0, description="A new segment every so many samples. Default 0: one.")] = 0
    length: Annotated[int, Field(ge=0, description="Of each of these. Default 0: as long as `every`.")] = 0
    amplitude: Annotated[
        float, Field(ge=-1, description="Peak, in the command's unit in the map. Default -1: measured.")
    ] = -1.0
    period: Annotated[int, Field(ge=0, description="Samples per period. Default 0: not periodic.")] = 0
    role: Annotated[Literal["", "fit", "test"], Field(description="Default: empty.")] = ""
    split: Annotated[
        dict[str, float],
        Field(description='Shares by role, in order, as in `{ fit = 0.5, test = 0.5 }`; "" leaves a share out.'),
    ] = field(default_factory=dict)


@dataclass(frozen=True, config=STRICT)
class PairMap:
    """The same device before and after something was changed on it."""

    before: Annotated[str, Field(min_length=1, description="Pattern of the file from before.")]
    after: Annotated[str, Field(min_length=1, description="Pattern of the file from after.")]
    changed: Annotated[str, Field(min_length=1, description="What was changed, in words.")]


@dataclass(frozen=True, config=STRICT)
class DiagnosisMap:
    """What `hapteq real` uses of a recording beside its samples: model, tests, pairs, known parameters."""

    model: Annotated[
        str,
        Field(description="A mechanical model in the map's folder, or a shipped one. Default: a linear one is fitted."),
    ] = ""
    tests: Annotated[
        str, Field(description="Name of the map whose model these recordings only test; they are not diagnosed.")
    ] = ""
    skip: Annotated[str, Field(description="Why these recordings are not to be diagnosed. Default: they are.")] = ""
    volume_free: Annotated[
        bool,
        Field(description="Whether the level of such a test is unknown: a single gain is fitted to it. Default false."),
    ] = False
    nominal: Annotated[
        dict[str, float],
        Field(description="Parameters of the device that are known by other means: mass, damping, stiffness, in SI."),
    ] = field(default_factory=dict)
    pair: Annotated[
        tuple[PairMap, ...], Field(description="Before and after, where each file is a recording of its own.")
    ] = ()
    objections: Annotated[tuple[str, ...], Field(description="What an expert would object, a sentence each.")] = ()


@dataclass(frozen=True, config=STRICT)
class ImportMap:
    """One kind of recording of a laboratory."""

    channel: Annotated[tuple[ChannelMap, ...], Field(min_length=1, description="Channels, one [[channel]] each.")]
    device: Annotated[str, Field(min_length=1, max_length=200, description="What was recorded.")]
    title: Annotated[str, Field(description="What the recording is. Default: empty.")] = ""
    files: Annotated[
        tuple[str, ...],
        Field(min_length=1, description='Patterns of the file names that it is for, in order. Default ["*"].'),
    ] = ("*",)
    separate: Annotated[
        bool, Field(description="Whether every file is a recording of its own. Default false: all make one.")
    ] = False
    rate_hz: Annotated[
        float, Field(ge=0, description="Of the recording. Default 0: of its fastest clock; needed for uneven stamps.")
    ] = 0.0
    hold: Annotated[
        Literal["zero-order", "band-limited", "linear"],
        Field(description='How the command moves between the recording\'s samples. Default "zero-order".'),
    ] = "zero-order"
    let: Annotated[dict[str, str], Field(description="Expressions by name, for all others to use.")] = field(
        default_factory=dict
    )
    numbers: Annotated[
        dict[str, str], Field(description="Numbers from the file, such as gains, kept in meta for each part.")
    ] = field(default_factory=dict)
    clock: Annotated[tuple[ClockMap, ...], Field(min_length=1, description="Clocks, one [[clock]] each.")] = (
        ClockMap(),
    )
    computed: Annotated[tuple[ComputedMap, ...], Field(description="Computed channels, one [[computed]] each.")] = ()
    part: Annotated[tuple[PartMap, ...], Field(description="Parts, one [[part]] each.")] = ()
    segment: Annotated[tuple[SegmentMap, ...], Field(description="Segments, one [[segment]] each.")] = ()
    csv: Annotated[CsvMap, Field(description="How tables are written.")] = field(default_factory=CsvMap)
    diagnosis: Annotated[DiagnosisMap, Field(description="What `hapteq real` uses in addition to the samples.")] = (
        field(default_factory=DiagnosisMap)
    )
    meta: Annotated[
        dict[str, Any], Field(description="Anything: place_m, feedback (gains), sensor, grip, operator, notes.")
    ] = field(default_factory=dict)
