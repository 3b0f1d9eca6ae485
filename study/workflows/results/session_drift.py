"""Drifts of the device and of the hand during a session, from the recordings of its probes, as sentences.

A probe is a short periodic excitation between trials with the hand on the handle; a reference is a longer one with the
handle free. Changes of friction, gain, delay, and of the hand's mass, damping and stiffness are estimated by
`analysis.device_change.probe_drift`; `DriftReader` reads the recordings and decides which are compared.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from analysis.device_change.compare_measurements import ChangeLimits
from analysis.device_change.probe_drift import Drift, TimedProbe, find_drifts
from analysis.device_change.probe_lines import compute_probe_lines
from equalizer.signals.recording import Recording
from protocols.definition.probes import PERIOD_S
from study.errors import StudyError
from study.session.watching.followed_session import PlayedProbe
from study.session.watching.watch_view import DriftRecord
from study.store.formats.recording_file import read_recording
from study.store.sessions.archive import SessionFolder

DAILY_LIMITS = ChangeLimits()
"""Limits of the daily device check."""
MAX_CHANGES = {
    "friction": DAILY_LIMITS.friction_n,
    "gain": DAILY_LIMITS.relative_step,
    "delay": 1e-3,
    "mass": 0.05,
    "damping": 3.0,
    "stiffness": 75.0,
}
"""Largest changes that are not reported as exceeding a limit: friction in N, relative gain, delay in s, and of the hand
mass in kg, damping in N s/m, stiffness in N/m. Beyond them a threshold may change by more than the finest step of a
staircase. Friction and gain as in the daily check; delay: one tick of the control loop; hand: about half the values of
a light grip."""

HAND_FREE_QUANTITIES = ("friction", "gain", "delay")
"""Quantities that are estimated from references, which are recorded without a hand."""


@dataclass(frozen=True, slots=True, eq=False)
class _ProbeLines:
    """Spectral lines from the recording of a probe or reference."""

    rate_hz: float
    """Sample rate of the recording."""
    timed_probes: tuple[TimedProbe, ...]
    """One element for a probe; two for a reference: its fit and its test segment."""


class DriftReader:
    """Estimates the drifts of one session. Results are cached: each update reads and compares new probes only."""

    def __init__(self, folder: SessionFolder) -> None:
        self._folder = folder
        self._usable_probes: list[tuple[PlayedProbe, _ProbeLines]] = []
        self._read_probe_count = 0
        self._first_found_s: dict[tuple[str, str, str], float] = {}
        self._records_by_kind: dict[str, tuple[DriftRecord, ...]] = {}

    def update(self, probes: tuple[PlayedProbe, ...]) -> tuple[DriftRecord, ...]:
        """Read new probes and return the present drifts: of device and hand within the sitting, from probes; of the
        device alone over the session, from references. probes: all probes of the session so far, in their order."""
        for probe in probes[self._read_probe_count :]:
            probe_lines = self._read_probe(probe)
            if probe_lines is not None and probe.kind in ("hand", "reference"):
                self._usable_probes.append((probe, probe_lines))
                self._records_by_kind[probe.kind] = tuple(
                    self._make_drift_records(probe.kind, self._compare_probe(probe))
                )
        self._read_probe_count = len(probes)
        return tuple(record for records in self._records_by_kind.values() for record in records)

    def _compare_probe(self, newest_probe: PlayedProbe) -> tuple[Drift, ...]:
        """Compare the newest probe with earlier ones: the test segment of a reference with both segments of the
        session's first reference at the same sample rate; a probe with a hand with the first probes of the same
        sitting. Empty where there are too few probes (`find_drifts`)."""
        if newest_probe.kind == "reference":
            newest_rate_hz = self._usable_probes[-1][1].rate_hz
            reference_lines = [
                probe_lines
                for probe, probe_lines in self._usable_probes
                if probe.kind == "reference" and probe_lines.rate_hz == newest_rate_hz
            ]
            first_reference, last_reference = reference_lines[0], reference_lines[-1]
            return (
                find_drifts(
                    (*first_reference.timed_probes, last_reference.timed_probes[-1]),
                    _compute_period(last_reference),
                    HAND_FREE_QUANTITIES,
                )
                if last_reference is not first_reference
                else ()
            )
        hand_probe_lines = [
            probe_lines
            for probe, probe_lines in self._usable_probes
            if (probe.kind, probe.sitting) == ("hand", newest_probe.sitting)
        ]
        return find_drifts(
            [timed_probe for probe_lines in hand_probe_lines for timed_probe in probe_lines.timed_probes],
            _compute_period(hand_probe_lines[-1]),
        )

    def _make_drift_records(self, kind: str, present_drifts: tuple[Drift, ...]) -> Iterator[DriftRecord]:
        """Yield the drifts as sentences for the experimenter, each with the time (s) at which it was first found."""
        drifts_by_key = {(kind, drift.parameter, drift.axis): drift for drift in present_drifts}
        # The time of a drift that has disappeared is removed: if it returns, its time is that of its return.
        self._first_found_s = {
            key: found_s for key, found_s in self._first_found_s.items() if key[0] != kind or key in drifts_by_key
        }
        for key, drift in drifts_by_key.items():
            first_found_s = self._first_found_s.setdefault(key, drift.time_s)
            drift_text = describe_drift(replace(drift, time_s=first_found_s))
            yield DriftRecord(
                first_found_s,
                f"without a hand, {drift_text}" if kind == "reference" else drift_text,
                exceeds_limit(drift),
            )

    def _read_probe(self, probe: PlayedProbe) -> _ProbeLines | None:
        """Read the spectral lines of a probe's recording; None where there is no recording, or it cannot be used."""
        if not probe.recording or probe.trouble:
            return None
        try:
            recording = read_recording(self._folder.path / probe.recording)
            segment_recordings = _split_reference(recording) if probe.kind == "reference" else (recording,)
            timed_probes = tuple(
                TimedProbe(probe.started_s, probe.level_n, compute_probe_lines(segment_recording, PERIOD_S))
                for segment_recording in segment_recordings
            )
        except (StudyError, ValueError):
            return None
        return _ProbeLines(recording.sample_rate_hz, timed_probes)


def describe_drift(drift: Drift) -> str:
    """Describe a drift with its unit and time, such as "friction along x 0.12 -> 0.20 N at minute 14"; friction with
    its first and present value where these are known, otherwise with the change. A gain that fell by more than 100 %
    has changed its sign."""
    minute_text = f"at minute {drift.time_s / 60:.0f}"
    axis_text = f" along {drift.axis}" if drift.axis else ""
    rivals_text = f" (or {' or '.join(drift.rivals)}: the probes cannot distinguish them)" if drift.rivals else ""
    if drift.initial_value is not None:
        return (
            f"friction{axis_text} {drift.initial_value:.2f} -> {max(0.0, drift.initial_value + drift.change):.2f} N "
            f"{minute_text}{rivals_text}"
        )
    if drift.parameter == "gain":
        sign_text = " (reversed sign: of the force, or of this axis of the accelerometer)" if drift.change < -1 else ""
        return f"gain{axis_text} {100 * drift.change:+.0f} %{sign_text} {minute_text}{rivals_text}"
    if drift.parameter == "delay":
        return f"delay {1000 * drift.change:+.2f} ms {minute_text}{rivals_text}"
    quantity = "friction" if drift.parameter == "friction" else f"grip: {drift.parameter}"
    return f"{quantity}{axis_text} {drift.change:+.3g} {drift.unit} {minute_text}{rivals_text}"


def exceeds_limit(drift: Drift) -> bool:
    """Whether the absolute change exceeds its limit in `MAX_CHANGES`."""
    return abs(drift.change) > MAX_CHANGES[drift.parameter]


def _split_reference(recording: Recording) -> tuple[Recording, Recording]:
    """Split a reference into two recordings: with its first segment (fit) and with its second (test)."""
    return replace(recording, segments=recording.segments[:1]), replace(recording, segments=recording.segments[1:2])


def _compute_period(probe_lines: _ProbeLines) -> int:
    """Compute the period of the probe's excitation in samples."""
    return round(PERIOD_S * probe_lines.rate_hz)
