"""What arrived of what was wanted."""

from dataclasses import replace

import pytest

from analysis.psychophysics.equalized_delivery import compute_deliveries, make_delivery_warning
from protocols.trial import Phase, Trial, TrialStatus

TRIAL = Trial(
    "P01", "P01_001", 1, 0, 0, Phase.TEST, 25.0, 1.0, 1, 1, True, False, 1.0, 3.0, 0.06, 0.1, 0, True,
    TrialStatus.OK, 135.0, 3.0,
)  # fmt: skip


def test_what_arrives_as_wanted_is_no_warning():
    found = compute_deliveries([TRIAL, replace(TRIAL, direction_shown=2, answer=2, delivered_mps2=2.9)])
    assert [(each.frequency_hz, each.trials) for each in found] == [(25.0, 2)]
    assert found[0].along == pytest.approx((1.0, 2.9 / 3.0))
    assert make_delivery_warning(found) == ""


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"delivered_mps2": 1.8}, "5 Hz (60 % of the target, 3 % off the direction)"),
        ({"off_axis_mps2": 0.9}, "5 Hz (100 % of the target, 30 % off the direction)"),
    ],
)
def test_what_does_not_is_named_with_its_frequency(changes, said):
    found = compute_deliveries([TRIAL, replace(TRIAL, frequency_hz=5.0, **changes)])
    assert said in make_delivery_warning(found)
    assert "25 Hz" not in make_delivery_warning(found)


def test_numbers_that_are_exchanged_between_people_hide_no_difference_between_the_directions():
    strong = replace(TRIAL, angle_deg=135.0, delivered_mps2=3.9)
    weak = replace(TRIAL, angle_deg=45.0, delivered_mps2=2.1)
    found = compute_deliveries(
        [
            replace(strong, direction_shown=1),
            replace(weak, direction_shown=2),
            replace(weak, subject="P02", direction_shown=1),
            replace(strong, subject="P02", direction_shown=2),
        ]
    )
    assert found[0].along == pytest.approx((1.3, 0.7))
    assert "25 Hz (130 % and 70 % of the target" in make_delivery_warning(found)


def test_the_median_counts_and_void_trials_do_not():
    odd = replace(TRIAL, delivered_mps2=0.1)
    void = replace(TRIAL, delivered_mps2=0.2, status=TrialStatus.SPOILED)
    (delivery,) = compute_deliveries([TRIAL, TRIAL, odd, void, void, void])
    assert delivery.trials == 3 and delivery.along == (1.0, None)


def test_commanded_forces_have_nothing_to_compare():
    assert compute_deliveries([replace(TRIAL, wanted_mps2=None)]) == ()
    assert make_delivery_warning(()) == ""
