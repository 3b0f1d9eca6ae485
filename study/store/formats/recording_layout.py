"""Layout of the file of a recording: the format `hapteq-recording`, version 1 (HDF5).

`recording_file` reads and writes the file; docs/formats.md contains the constants. Sample k is taken at time t_k; the
datasets of samples have the same rate and number n of samples.
"""

from equalizer.signals.recording import SEGMENT_KINDS, Hold
from equalizer.signals.units import NO_UNIT
from study.store.disk.layout import Entry

FORMAT, VERSION = "hapteq-recording", 1
"""Name and version of the format, written into every file."""
KIND = "recording"
"""Name of this kind of file in messages."""

LAYOUT = (
    Entry("format", "attribute, text", f"`{FORMAT}`"),
    Entry("version", "attribute, whole number", f"{VERSION}"),
    Entry("sample_rate_hz", "attribute, number", "sample rate of every dataset: the faster of command and sensor"),
    Entry("device", "attribute, text", "name of the recorded device"),
    Entry(
        "hold",
        "attribute, text",
        "course of the command between samples: " + ", ".join(f"`{hold.value}`" for hold in Hold),
        False,
    ),
    Entry("command", "(n, m) float32 or float64", "input of the plant; `command[k]` is held until t_(k+1)"),
    Entry(
        "response",
        "(n, p) float32 or float64",
        "output of the plant, sampled at t_k just before `command[k]` is written",
    ),
    Entry("position", "(n, d) float32 or float64", "sampled with the response", False),
    Entry(
        "excitation",
        "(n, m) float32 or float64",
        "the part of the command that was determined before the recording",
        False,
    ),
    Entry(
        "condition",
        "(n, q) float32 or float64",
        "recorded circumstances: a temperature, a pressure, a setting",
        False,
    ),
    Entry("time_s", "(n) float32 or float64", "time stamps, if the device recorded them", False),
    Entry(
        "segments",
        "rows of `start, stop, kind, amplitude, period, role`",
        "samples outside of all segments are rest",
        False,
    ),
    Entry(
        "meta",
        "group of attributes, each JSON text",
        "place, sensor, band_hz (lowest and highest usable frequency), feedback, grip, operator, added_mass_kg or "
        "added_inertia_kg_m2 (of a weight on the device), provenance; `time` is `unknown` if the samples "
        "are only numbered (sample_rate_hz is then 1)",
        False,
    ),
)
"""Attributes, datasets and groups of the file. Dimensions: n samples, m commands, p responses, d positions, q
conditions."""
SIGNAL_ATTRIBUTES = (
    Entry("quantity", "attribute, text or list", "one for all channels, or one per channel"),
    Entry(
        "unit",
        "attribute, text or list",
        f"likewise; converted to SI when read; `{NO_UNIT}` if the unit is not known",
    ),
    Entry(
        "channels",
        "attribute, text or list",
        "one name per column; a single text lists the names (`fx, fy, fz`), or is numbered",
    ),
)
"""Attributes of each dataset of samples; not of `time_s`."""
SEGMENT_FIELDS = (
    Entry("start", "whole number", "first sample"),
    Entry("stop", "whole number", "the sample after the last"),
    Entry("kind", "text", ", ".join(f"`{kind}`" for kind in SEGMENT_KINDS)),
    Entry("amplitude", "number", "peak of the excitation, in the command's unit"),
    Entry("period", "whole number", "samples per period, 0 = not periodic"),
    Entry("role", "text", "`fit`, `test`, or empty"),
)
"""Fields of a row of the table `segments`."""
