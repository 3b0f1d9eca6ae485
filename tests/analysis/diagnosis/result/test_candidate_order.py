"""In which order what a force balance does not name is told."""

from dataclasses import replace

from analysis.diagnosis.balance.judged_law import JudgedLaw
from analysis.diagnosis.balance.law import Law
from analysis.diagnosis.result.candidates import _rank


def weighed(effect, gain, low, share=0.5, linear=False):
    law = Law(effect, 0, (), lambda m, n: m.position, lambda w, n, mass: None, linear)
    return JudgedLaw(0, law, {}, gain, low, share, (), 0.0, "it is not named")


def test_what_is_sure_to_gain_comes_before_what_gains_more_by_chance_or_cannot_be():
    sure = weighed("coulomb_friction", 0.1, 0.05)
    chance = weighed("gravity_torque", 0.4, -0.1)
    impossible = replace(weighed("cogging", 0.5, 0.3), possible=False)
    linear = weighed("extra_mode", 0.6, 0.5, linear=True)
    little = weighed("end_stop", 0.2, 0.1, share=0.01)
    order = sorted([little, linear, impossible, chance, sure], key=_rank)
    assert [each.law.effect for each in order] == [
        "coulomb_friction", "cogging", "gravity_torque", "extra_mode", "end_stop",
    ]  # fmt: skip
