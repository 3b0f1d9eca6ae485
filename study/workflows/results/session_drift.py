"""Drifts of the device and of the hand during a session, from the recordings of its probes, as sentences.

A probe is a short periodic excitation between trials with the hand on the handle; a reference is a longer one with the
handle free. Changes of friction, gain, delay, and of the hand's mass, damping and stiffness are estimated by
`analysis.device_change.probe_drift`; this module reads the recordings and decides which are compared.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from analysis.device_change.compare_devices import ChangeLimits
from analysis.device_change.probe_drift import Drift, TimedProbe, find_drifts
from analysis.device_change.probe_lines import probe_lines
from equalizer.signals.recording import Recording
from protocols.definition.probes import PERIOD_S
from study.errors import StudyError
from study.session.watching.followed_session import PlayedProbe
from study.session.watching.watch_view import DriftLine
from study.store.formats.recording_file import read_recording
from study.store.sessions.archive import SessionFolder

LIMITS = ChangeLimits()
"""Limits of the daily device check."""
ALLOWED = {
    "friction": LIMITS.friction_n,
    "gain": LIMITS.share,
    "delay": 1e-3,
    "mass": 0.05,
    "damping": 3.0,
    "stiffness": 75.0,
}
"""Changes above which a threshold may move by more than the finest step of a staircase: friction in N, relative gain,
delay in s, and of the hand mass in kg, damping in N s/m, stiffness in N/m. Friction and gain as in the daily check;
delay: one tick of the control loop; hand: about half of a light grip."""

WITHOUT_HAND = ("friction", "gain", "delay")
"""Quantities in which references, recorded without a hand, are compared."""


@dataclass(frozen=True, slots=True, eq=False)
class _ProbeLines:
    """Spectral lines from the recording of a probe or reference."""

    rate_hz: float
    """Sample rate of the recording."""
    timed_probes: tuple[TimedProbe, ...]
    """One element for a probe, two for a reference: its two halves."""


class DriftReader:
    """Estimates the drifts of one session. Results are cached: each update reads and compares new probes only."""

    def __init__(self, folder: SessionFolder) -> None:
        self._folder = folder
        self._read: list[tuple[PlayedProbe, _ProbeLines]] = []
        self._read_count = 0
        self._since_s: dict[tuple[str, str, str], float] = {}
        self._lines_by_kind: dict[str, tuple[DriftLine, ...]] = {}

    def look(self, probes: tuple[PlayedProbe, ...]) -> tuple[DriftLine, ...]:
        """The present drifts: of device and hand within the sitting, from probes; of the device alone over the session,
        from references. probes: all probes of the session so far, in their order."""
        for probe in probes[self._read_count :]:
            read = self._read_probe(probe)
            if read is not None and probe.kind in ("hand", "reference"):
                self._read.append((probe, read))
                self._lines_by_kind[probe.kind] = tuple(self._drift_lines(probe.kind, self._compare(probe)))
        self._read_count = len(probes)
        return tuple(line for lines in self._lines_by_kind.values() for line in lines)

    def _compare(self, newest: PlayedProbe) -> tuple[Drift, ...]:
        """The newest probe compared with earlier ones: a reference with the session's first reference, a probe with a
        hand with those of the same sitting. Empty where there are too few."""
        if newest.kind == "reference":
            references = [read for probe, read in self._read if probe.kind == "reference"]
            first, last = references[0], references[-1]
            return (
                find_drifts((*first.timed_probes, last.timed_probes[-1]), _period(last), WITHOUT_HAND)
                if last is not first
                else ()
            )
        same_sitting = [read for probe, read in self._read if (probe.kind, probe.sitting) == ("hand", newest.sitting)]
        return find_drifts(
            [timed_probes for read in same_sitting for timed_probes in read.timed_probes], _period(same_sitting[-1])
        )

    def _drift_lines(self, kind: str, present_drifts: tuple[Drift, ...]) -> Iterator[DriftLine]:
        """Drifts as lines for the experimenter, each with the time at which it was first found."""
        drifts_by_key = {(kind, drift.number, drift.axis): drift for drift in present_drifts}
        # A drift that has disappeared is forgotten: if it returns, its time is that of its return.
        self._since_s = {key: s for key, s in self._since_s.items() if key[0] != kind or key in drifts_by_key}
        for key, drift in drifts_by_key.items():
            since_s = self._since_s.setdefault(key, drift.time_s)
            words = sentence(replace(drift, time_s=since_s))
            yield DriftLine(since_s, f"without a hand, {words}" if kind == "reference" else words, exceeds_limit(drift))

    def _read_probe(self, probe: PlayedProbe) -> _ProbeLines | None:
        """Read a probe's recording; None where none was kept, or it cannot be used."""
        if not probe.recording or probe.trouble:
            return None
        try:
            recording = read_recording(self._folder.path / probe.recording)
            parts = _halves(recording) if probe.kind == "reference" else (recording,)
            timed_probes = tuple(
                TimedProbe(probe.started_s, probe.level_n, probe_lines(part, PERIOD_S)) for part in parts
            )
        except (StudyError, ValueError):
            return None
        return _ProbeLines(recording.sample_rate_hz, timed_probes)


def sentence(drift: Drift) -> str:
    """A drift in words with its unit and time, such as "friction along x 0.12 -> 0.20 N at minute 14"."""
    minute = f"at minute {drift.time_s / 60:.0f}"
    axis_text = f" along {drift.axis}" if drift.axis else ""
    rivals_text = f" (or {' or '.join(drift.rivals)}: the probes cannot distinguish them)" if drift.rivals else ""
    if drift.initial_value is not None:
        return (
            f"friction{axis_text} {drift.initial_value:.2f} -> {max(0.0, drift.initial_value + drift.change):.2f} N "
            f"{minute}{rivals_text}"
        )
    if drift.number == "gain":
        return f"gain{axis_text} {100 * drift.change:+.0f} % {minute}{rivals_text}"
    if drift.number == "delay":
        return f"delay {1000 * drift.change:+.2f} ms {minute}{rivals_text}"
    quantity = "friction" if drift.number == "friction" else f"grip: {drift.number}"
    return f"{quantity}{axis_text} {drift.change:+.3g} {drift.unit} {minute}{rivals_text}"


def exceeds_limit(drift: Drift) -> bool:
    """Whether the change exceeds its limit in `ALLOWED`."""
    return abs(drift.change) > ALLOWED[drift.number]


def _halves(recording: Recording) -> tuple[Recording, Recording]:
    """The two segments of a reference at full level, as two recordings."""
    return replace(recording, segments=recording.segments[:1]), replace(recording, segments=recording.segments[1:2])


def _period(read: _ProbeLines) -> int:
    """Period of the probe's excitation in samples."""
    return round(PERIOD_S * read.rate_hz)
