"""Where forces are compared, parameters still carry the units of the motion that was measured."""

from dataclasses import replace
from types import SimpleNamespace

from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.search_by_simulation import make_search_context


def test_units_are_those_of_the_recording_as_it_was_given(diagnosed):
    recording = diagnosed.recorded(1)
    forces = replace(recording, response=replace(recording.response, quantity="force", unit="N"))
    measure = SimpleNamespace(records=(SimpleNamespace(recording=forces),), shorten=lambda: None)
    look = SimpleNamespace(model=diagnosed.device(1), chosen=SimpleNamespace(measure=measure))
    context = make_search_context(recording, look, DiagnosisSettings(), map)
    assert context.tuning.model.units is None
    wrongly = make_search_context(forces, look, DiagnosisSettings(), map)
    assert wrongly.tuning.model.units is not None
