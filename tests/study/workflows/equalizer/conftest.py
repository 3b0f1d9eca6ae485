"""A model of the simulated omega.3 as a lab would make it: sweeps along each axis, identified from 5 to 35 Hz."""

from dataclasses import replace

import pytest

from equalizer.identification.frequency_response.transfer_estimate import estimate_transfer
from equalizer.identification.state_space.identify import identify
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.plant.identified_model import IdentifiedModel
from protocols.definition.apparatus import SafetySettings
from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.recording_segments import SweepSegment
from study.store.formats.recording_file import read_recording
from study.workflows.recording.record_device import RecordingPlan, record_device


@pytest.fixture(scope="session")
def lab_model(tmp_path_factory) -> IdentifiedModel:
    path = tmp_path_factory.mktemp("lab") / "band.h5"
    sweeps = tuple(SweepSegment("sweep", 4.5, 37.0, 2.0, axis, duration_s=15.0, periods=2) for axis in ("x", "y", "z"))
    safety = SafetySettings(stimulus_cap_n=3.0, total_cap_n=4.5)
    protocol = RecordingProtocol(
        name="band", kind="recording", title="Band", segments=sweeps, safety=safety, rest_s=0.5
    )
    record_device(RecordingPlan(protocol, "simulated", (0.0, 0.0, 0.0), 3, path), lambda _: None)
    recording = read_recording(path)
    settings = IdentificationSettings(draws=3, longer_horizons=(0,), record_horizons=())
    model = identify(estimate_transfer([recording]), settings).model
    facts = {"input": "command", "feedback": recording.meta["feedback"], "hand": ["none"], "amplitude_n": 2.0}
    return replace(model, place_m=(0.0, 0.0, 0.0), provenance=facts)
