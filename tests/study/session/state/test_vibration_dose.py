import math
from types import SimpleNamespace

import pytest

from study.session.state.sitting_state import estimate_amplitude_mps2
from study.session.state.vibration_dose import (
    NO_DOSE,
    Dose,
    add_sinusoid,
    compute_a8_mps2,
    compute_hand_arm_weight,
)

ISO_5349_1 = {
    6.3: 0.727, 8: 0.873, 10: 0.951, 12.5: 0.958, 16: 0.896, 20: 0.782, 25: 0.647, 31.5: 0.519, 40: 0.411, 50: 0.324,
    63: 0.256, 80: 0.202, 100: 0.160, 125: 0.127, 160: 0.101, 200: 0.0799, 250: 0.0634, 315: 0.0503, 400: 0.0398,
    500: 0.0314, 630: 0.0245, 800: 0.0186, 1000: 0.0135, 1250: 0.00894,
}  # fmt: skip
"""Factors of the standard, table A.2, by nominal one-third-octave frequency."""


@pytest.mark.parametrize(("nominal_hz", "factor"), ISO_5349_1.items())
def test_the_filter_gives_the_tabulated_factor_of_each_third_octave(nominal_hz: float, factor: float) -> None:
    exact_hz = 10 ** (round(10 * math.log10(nominal_hz)) / 10)
    assert compute_hand_arm_weight(exact_hz) == pytest.approx(factor, rel=0.005)


def test_below_the_standard_the_filter_continues_falling() -> None:
    assert compute_hand_arm_weight(5.0) == pytest.approx(0.545, abs=0.01)
    assert compute_hand_arm_weight(2.0) < compute_hand_arm_weight(4.0) / 3.5


@pytest.mark.parametrize("frequency_hz", [0.0, -5.0])
def test_without_a_frequency_there_is_no_weight(frequency_hz: float) -> None:
    with pytest.raises(ValueError, match="above 0 Hz"):
        compute_hand_arm_weight(frequency_hz)


def test_eight_hours_give_the_weighted_rms_itself() -> None:
    dose = add_sinusoid(NO_DOSE, 12.5, 4.0, 8 * 3600.0)
    assert compute_a8_mps2(dose) == pytest.approx(compute_hand_arm_weight(12.5) * 4.0 / math.sqrt(2))


def test_a_quarter_of_the_time_halves_the_exposure() -> None:
    whole, quarter = (add_sinusoid(NO_DOSE, 35.0, 10.0, seconds) for seconds in (1200.0, 300.0))
    assert compute_a8_mps2(quarter) == pytest.approx(compute_a8_mps2(whole) / 2)


def test_time_without_a_measured_amplitude_is_distinguished() -> None:
    dose = add_sinusoid(add_sinusoid(NO_DOSE, 25.0, None, 7.0), 25.0, 0.0, 3.0)
    assert dose == Dose(squared_s=0.0, vibrated_s=10.0, unmeasured_s=7.0)


def test_a_negative_time_is_refused() -> None:
    with pytest.raises(ValueError, match="0 s or longer"):
        add_sinusoid(NO_DOSE, 25.0, 1.0, -1.0)


def test_the_estimate_for_a_void_trial_has_the_acceleration_along_and_across() -> None:
    measured = SimpleNamespace(frequency_hz=25.0, level_n=2.0, delivered_mps2=3.0, off_axis_mps2=4.0)
    unmeasured = SimpleNamespace(frequency_hz=25.0, level_n=2.0, delivered_mps2=None, off_axis_mps2=None)
    assert estimate_amplitude_mps2((measured, unmeasured), 25.0, 1.0) == pytest.approx(2.5)
    assert estimate_amplitude_mps2((measured,), 35.0, 1.0) is None
