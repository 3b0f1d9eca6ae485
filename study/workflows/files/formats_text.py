"""Prose of docs/formats.md: the paragraphs between its generated tables, in Markdown.

`format_docs` puts them together with the tables. Limits come from the constants of the code that reads and writes the
files, so that page and code agree.
"""

from equalizer.laws.parse import FUNCTIONS, MAX_CHARACTERS, MAX_NODES, MEMORY_OPERATORS
from equalizer.laws.program import MAX_CELLS, STACK_SIZE
from equalizer.plant.effect_vocabulary import DISCOVERED_LAW
from equalizer.signals.units import UNITS_CLAUSE
from equalizer.tracking.feedforward.trajectory import STEP_TOLERANCE
from study.session.facts import log_chain

GENERATED_PAGE_NOTE = (
    "This page is generated from the code (`python -m study.workflows.files.format_docs docs`): change the code, not "
    "the page."
)
"""Sentence at the beginning of a generated page."""

INTRODUCTION = (
    f"{GENERATED_PAGE_NOTE} `hapteq validate FILE` checks any of these files and lists its problems.",
    "Every HDF5 file and every JSON document states its `format` and `version`. TOML and CSV files are recognised by "
    f"their keys or header. Units: {UNITS_CLAUSE}. `g` is standard gravity. Time is the first dimension of each array.",
)
"""Paragraphs at the beginning of the page."""

SIGNAL_TABLE_NOTE = "Each of `command`, `response`, `position`, `excitation`, `condition` has these attributes:"
"""Sentence above the table of the attributes of a signal."""

SEGMENT_TABLE_NOTE = "A row of `segments` has these fields:"
"""Sentence above the table of the fields of a segment."""

RECORDING_NOTES = (
    "With a plant that has direct feedthrough, `response[k]` depends on `command[k-1]`. If the sensor is faster than "
    "the command, the command's samples repeat. NaN is a missing sample; an analysis that cannot use it reports it. "
    "Segments must not overlap."
)
"""Paragraph below the tables of a recording."""

MECHANICAL_MODEL_NOTES = "Other keys are refused."
"""Paragraph above the table of a mechanical model."""

EFFECTS_NOTES = (
    "Names of physical effects that a model may have or lack. Parameters are listed in order, the main parameter "
    "first. Units are those of translational and of rotational models. A diagnosis may contain further names."
)
"""Paragraph above the table of effects."""

_FUNCTION_NAMES = ", ".join(f"`{name}`" for name in FUNCTIONS if name not in MEMORY_OPERATORS)
"""Names of the functions without memory that a formula may use, in Markdown."""

LAW_SECTION = "\n\n".join(
    (
        f"A law that is not an effect of the catalogue is an effect `{DISCOVERED_LAW}`. A model states its formula:",
        "```toml\n[[effect]]\n"
        f'kind = "{DISCOVERED_LAW}"\naxis = "y"\nacts_on = "force"\nexpression = "-4.1*abs(vy)**1.5*sign(vy)"\n'
        "```",
        "In a diagnosis the formula is the effect's `law`, with `expression`, `variables`, `acts_on` and `axis`. A law "
        "with `acts_on` = `force` is added to the force on its axis. A law with `command` or `response` replaces the "
        "command or response of its axis.",
        f"**Syntax.** A formula has Python's syntax and SI numbers: `+ - * / **`, parentheses, `pi`, and the functions "
        f"{_FUNCTION_NAMES}. Comparisons do not exist: `maximum(x - 0.01, 0)` is a stop, `(1 + sign(vx))/2` is 1 "
        "during upward motion.",
        "**Functions with memory.** `lag(s, tau_s)` is one pole. `play(s, half_width)` follows s with play. "
        f"`delay(s, seconds)` interpolates between stored instants, of which every second one is at least seconds / "
        f"{MAX_CELLS} later. `integral(s)` integrates over time. A second argument must be constant. In a law of a "
        "force or response, the initial state is that of signals which have always had their first values. In a law of "
        "a command, it is that of zero signals.",
        "**Signals.** `x`, `vx`, `ax`, `fx` are position, velocity, acceleration and command of the x axis; y and z "
        "likewise. `t` is the time from the first sample, in seconds. The recording's own channel names are allowed, "
        "too, unless they are one of these names; in a law of a response, a channel's own name comes first. If channel "
        "names do not end in x, y, z, the axes are named x, y, z in their order. A law of the force may also use the "
        "recording's conditions. They are named `c1`, `c2`, … if a condition's channel is not a valid name, or has "
        "another meaning. A law of a command may use commands and `t`; a law of a response may use responses and `t`.",
        "**Free parameters.** Numbers with a point or an exponent (`4.1`, `1e-3`) are free parameters: a fit may "
        f"change them. Whole numbers (`2`) are part of the form. A formula has at most {MAX_CHARACTERS} characters, "
        f"{MAX_NODES} parts, and {STACK_SIZE} numbers at once.",
    )
)
"""Section on laws that are no effect of the catalogue: syntax, functions, signals and parameters of their formulas."""

FORCE_TABLE_NOTES = (
    f"The rate is constant (each step within {STEP_TOLERANCE:.0%} of the mean step) and equals the rate of the model. "
    "The rows of forces correspond to the rows of the trajectory."
)
"""Paragraph below the table of headers of trajectories and forces."""

TRIALS_NOTES = (
    "One row per presentation; further columns may follow. `felt` is false if a person answered while no device moved, "
    "and empty for simulated participants. `direction_shown` and `answer` are numbers on the screen; `angle_deg` is "
    "the direction. In the phase `detection` they are numbers of intervals. In the phase `catch` the level is the cap, "
    "and the trial does not move a staircase. `run`, `trial` and `attempt` count from 0, as in the log and the names "
    "of recordings, in all tables; `hapteq show` and `hapteq watch` count from 1, and the participant's screen counts "
    "the runs of each phase from 1."
)
"""Paragraph above the columns of `trials.csv`."""

THRESHOLDS_NOTES = (
    "One row per run. `threshold_n` is the arithmetic mean of the averaged levels, in newtons. `threshold_db` is the "
    "mean of the same levels in dB re 1 N. With the Psi method both are the posterior mean, taken in dB. "
    "`threshold_mps2` and `threshold_mm` are the same threshold as delivered acceleration in m/s² and as displacement "
    "in mm. `detection.csv` has the same columns, one row per detection run; its `d_prime` is that of two intervals."
)
"""Paragraph above the columns of `thresholds.csv`."""

SESSION_LOG_NOTES = (
    "One JSON object per line. Lines are appended and never changed. Each line is an event of the schema "
    "`session_event.json`. Times are ISO 8601 with date and UTC offset, durations are in seconds, and file names are "
    "relative to the session's folder.",
    "**Hash chain.** A line ends with the field `chain`: the first "
    f"{log_chain.CHECKSUM_DIGITS} hexadecimal digits of a SHA-256. The hashed bytes are the checksum of the previous "
    "line, a line feed, and the line without this field, without the comma before it and without the line end. For the "
    "first line the previous checksum is "
    f"{log_chain.CHECKSUM_DIGITS} zeros. Lines of older versions have no `chain`, but are hashed too. If such a log is "
    "continued, its first checksum therefore covers the lines before it.",
    "**Seal.** When a session is closed, `seal.json` is written once. It contains the session's name, the number of "
    "lines and of bytes, the last checksum, and the SHA-256 of these bytes. It distinguishes a log whose end was cut "
    "off from a log that was interrupted. Notes that are added after the end are covered by `seal-2.json`, "
    "`seal-3.json`, and so on.",
    "**Check.** Each reader of a session checks chain and seals; `hapteq validate` names the damaged line. A damaged "
    "session is excluded from an analysis, with the reason.",
    "**Limits.** Checksums and seal have no key. They detect damage, and edits without recomputed checksums. They do "
    "not prove who wrote a log, and do not protect against forgery. A copy in another place does.",
)
"""Paragraphs on the session log, its hash chain and its seal."""

REPEATS_DESCRIPTION = (
    "next to a table of forces found by repetition: errors of each play, and the trajectory, model and device that the "
    "forces belong to"
)
"""What the file of a repetition contains, in the list of JSON documents."""

LIVE_STATE_DESCRIPTION = "`live.json`, the present state of a running session; replaced several times a second"
"""What the file of the live state contains, in the same list."""

REQUEST_DESCRIPTION = (
    "a file in a session's folder `requests/`: a request of another program to the session, removed when it is read, a "
    "note when it is in the log. A file name that begins with `stop` is a request to stop, with any content"
)
"""What the file of a request contains, in the same list."""
