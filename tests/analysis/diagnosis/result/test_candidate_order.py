"""In which order what a force balance does not name is told."""

from dataclasses import replace

from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.laws.law import Law
from analysis.diagnosis.result.candidates import _rank_law


def make_judged_law(effect, gain, low, share=0.5, linear=False):
    law = Law(effect, 0, (), lambda m, n: m.position, lambda w, n, mass: None, linear)
    return JudgedLaw(0, law, {}, gain, low, share, (), 0.0, "it is not named")


def test_what_is_sure_to_gain_comes_before_what_gains_more_by_chance_or_cannot_be():
    sure = make_judged_law("coulomb_friction", 0.1, 0.05)
    chance = make_judged_law("gravity_torque", 0.4, -0.1)
    impossible = replace(make_judged_law("cogging", 0.5, 0.3), is_physical=False)
    linear = make_judged_law("extra_mode", 0.6, 0.5, linear=True)
    little = make_judged_law("end_stop", 0.2, 0.1, share=0.01)
    order = sorted([little, linear, impossible, chance, sure], key=_rank_law)
    assert [each.law.effect for each in order] == [
        "coulomb_friction", "cogging", "gravity_torque", "extra_mode", "end_stop",
    ]  # fmt: skip
