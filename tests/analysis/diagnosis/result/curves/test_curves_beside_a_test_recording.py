"""Of several recordings, one may be for the test alone: curves of effects are drawn from one that was fitted."""

from dataclasses import replace

from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from equalizer.effects.catalogue import CATALOGUE


def test_a_first_recording_that_is_held_out_whole_leaves_the_curve_to_the_second(diagnosed):
    first, second = diagnosed.recorded(1, seed=5), diagnosed.recorded(1)
    held_out = replace(first, segments=tuple(replace(segment, role="test") for segment in first.segments))
    others = tuple(effect.name for effect in CATALOGUE if effect.name not in diagnosed.TRIED)
    found = diagnose(
        [held_out, second], diagnosed.device(1), DiagnosisSettings(without=others), map, lambda said, share: None
    )
    assert [effect.effect for effect in found.diagnosis.effects] == ["coulomb_friction"]
    assert len(found.signatures[0].measured_abscissa) > 10
