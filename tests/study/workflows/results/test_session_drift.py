"""A session whose device changes in its middle, as who follows it sees it."""

from dataclasses import replace
from pathlib import Path

import pytest

from analysis.device_change.probe_drift import Drift
from protocols.definition.probes import ProbeSettings
from protocols.document.dumping import dump_protocol
from study.devices.safe import SafeDevice
from study.devices.simulated import layout, omega3
from study.session.watching.followed_session import PlayedProbe
from study.store.sessions.archive import SessionFolder
from study.tui.watch.watch_lines import format_view
from study.workflows.results import session_drift
from study.workflows.results.session_drift import DriftReader, describe_drift
from study.workflows.views.watch_session import follow

AFTER = 7
"""Probes with a hand before something changes: two of each level, and one."""


@pytest.fixture
def probed(sitter, monkeypatch):
    """Conducts a session in which the simulated device's friction becomes `times` as large."""

    def session(times: float):
        packed, held, hold = [], [], SafeDevice.hold

        def build(*values, **named):
            rig = build_omega3(*values, **named)
            packed.append(rig.parameters)
            return rig

        def counted(self, stimulus):
            held.extend([1] * (stimulus.fade_in_s == 0.25))
            if len(held) == AFTER + 2:  # and the test of the free handle
                packed[-1][layout.COULOMB_FRICTION] *= times
                held.append(1)
            hold(self, stimulus)

        build_omega3 = omega3.build_omega3
        monkeypatch.setattr("study.devices.rigs_by_name.build_omega3", build)
        monkeypatch.setattr(SafeDevice, "hold", counted)
        probes = ProbeSettings(levels_n=(0.2, 0.4, 0.8), interval_s=15.0, reference_s=5.0)
        kept = replace(sitter.protocol.measurement, keep_s=1.0)
        slow = replace(sitter.protocol.trial, pause_between_s=8.0)
        sitter.protocol = replace(sitter.protocol, probes=probes, measurement=kept, trial=slow)
        sitter.text = dump_protocol(sitter.protocol)
        return sitter.whole().folder

    return session


def view_of(folder):
    return follow(folder.path).look("2030-01-01T00:00:00.000+00:00")


@pytest.mark.slow
def test_more_friction_in_mid_session_is_named_with_number_and_time(probed):
    view = view_of(probed(2.0))
    assert view.probes >= 11
    assert {drift.sentence[:16] for drift in view.drifts} == {f"friction along {axis}" for axis in "xyz"}
    assert all(" N at minute " in drift.sentence for drift in view.drifts)
    assert any(line.startswith("Drift      friction along x 0.") for line in format_view(view))


@pytest.mark.slow
def test_where_nothing_changes_nothing_is_named(probed):
    view = view_of(probed(1.0))
    assert view.probes >= 11
    assert view.drifts == ()
    assert any("none in" in line for line in format_view(view))


@pytest.mark.slow
def test_a_session_without_probes_says_nothing_of_them(sitter):
    view = view_of(sitter.whole().folder)
    assert (view.probes, view.drifts) == (0, ())
    assert not any(line.startswith("Drift") for line in format_view(view))


def test_a_recording_that_is_gone_is_left_out(finished):
    folder = finished.folder
    lost = PlayedProbe(0, "hand", 0.2, 1.0, 0, "recordings/probe-000.h5")
    assert DriftReader(folder).update((lost, replace(lost, number=1, recording=""))) == ()


@pytest.mark.slow
def test_two_references_tell_what_changed_at_the_device_alone(sitter, monkeypatch):
    """Ends after the first trials, and goes on with more friction: between the sittings, and so without a hand too."""
    probes = ProbeSettings(levels_n=(0.4,), interval_s=15.0, reference_s=6.0)
    kept = replace(sitter.protocol.measurement, keep_s=1.0)
    sitter.protocol = replace(sitter.protocol, probes=probes, measurement=kept)
    sitter.text = dump_protocol(sitter.protocol)
    folder = sitter.interrupted(3).folder
    build_omega3 = omega3.build_omega3

    def build(*values, **named):
        rig = build_omega3(*values, **named)
        rig.parameters[layout.COULOMB_FRICTION] *= 2.0
        return rig

    monkeypatch.setattr("study.devices.rigs_by_name.build_omega3", build)
    view = view_of(sitter.resumed(folder).folder)
    alone = [drift.sentence for drift in view.drifts if drift.sentence.startswith("without a hand, ")]
    assert alone
    assert all("friction" in each for each in alone)


def test_references_of_another_sample_rate_are_not_compared(monkeypatch):
    """The device was set to another rate between the sittings: what followed the session ended with an error."""
    rates = iter((1000.0, 2000.0, 1000.0))
    compared = []
    monkeypatch.setattr(
        DriftReader, "_read_probe", lambda reader, probe: session_drift._ProbeLines(next(rates), (probe, probe))
    )
    monkeypatch.setattr(session_drift, "find_drifts", lambda probes, *more: compared.append(probes) or ())
    first, other, last = (PlayedProbe(number, "reference", 0.4, 60.0 * number, number) for number in range(3))
    DriftReader(SessionFolder(Path("P01_001"))).update((first, other, last))
    assert compared == [(first, first, last)]


def test_a_reversed_axis_of_the_accelerometer_is_said_to_be_reversed():
    """The gain fell from 1 to -1."""
    drift = Drift("gain", "gain", "x", 180.0, change=-2.0, error=0.01, initial_value=None)
    text = describe_drift(drift)
    assert text == "gain along x -200 % (reversed sign: of the force, or of this axis of the accelerometer) at minute 3"
    assert describe_drift(replace(drift, change=-0.9)) == "gain along x -90 % at minute 3"
