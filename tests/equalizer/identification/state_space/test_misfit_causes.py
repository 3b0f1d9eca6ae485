"""What a misfit is said to come from: only what the lines or the test tell, on devices whose fault is known."""

import numpy as np
import pytest

from equalizer.identification.state_space.held_out_validation import HeldOutValidation
from equalizer.identification.state_space.identify_recordings import identify_recordings
from equalizer.identification.state_space.misfit import Misfit
from equalizer.identification.state_space.misfit_causes import describe_test_error_causes
from equalizer.identification.state_space.settings import IdentificationSettings
from equalizer.signals.recording import Segment

QUICK = IdentificationSettings(order=12, draws=0, longer_horizons=(0,), record_horizons=())
ORDER, NOT_LINEAR, BOUND = "the order 12 may be too low", "the device is not linear", "is at the bound of the decay"


def recorded(plants, synthetic, device, periods=3):
    commands, segments = synthetic.one_after_another(synthetic.axes(plants.sweep(4.5, 37.0, 8.0)), periods)
    return synthetic.recording_of(commands, device.measured(commands, 1), segments)


def modes_of(plants, damping):
    """Three rigid modes, and a resonance at 12 Hz: an order of 8, and 4 of motor and sensor beyond the band."""
    rigid = [(3.5, 1.4, axis / np.sqrt(plants.MASS_KG)) for axis in np.eye(3)]
    return [*rigid, (12.0, damping, np.array([0.5, 0.4, 0.3]))]


def said_of(recording) -> str:
    return " ".join(identify_recordings((recording,), QUICK).identified.remarks)


@pytest.mark.slow
def test_friction_is_distinguished_from_an_order_that_is_too_low(plants, rubbing, synthetic):
    said = said_of(recorded(plants, synthetic, rubbing.rubbing(modes_of(plants, 0.06), 0.2)))
    assert NOT_LINEAR in said and "the lines do not show which" in said
    assert ORDER not in said and BOUND not in said and "relaxed" not in said


@pytest.mark.slow
def test_without_two_counted_periods_friction_and_order_are_not_told_apart(plants, synthetic):
    said = said_of(recorded(plants, synthetic, plants.omega_like(), periods=1))
    assert "or the device is not linear, as with friction" in said and "do not show which" in said


@pytest.mark.slow
def test_an_order_that_is_too_low_is_not_taken_for_friction(plants, synthetic):
    said = said_of(recorded(plants, synthetic, plants.omega_like()))
    assert ORDER in said
    assert NOT_LINEAR not in said and BOUND not in said


def test_a_single_period_relaxes_nothing_and_says_what_to_record(plants, synthetic):
    found = identify_recordings(
        (recorded(plants, synthetic, plants._sampled(modes_of(plants, 0.005)), periods=1),), QUICK
    ).identified
    assert found.relaxed == () and found.slowest_decay_s <= 0.5 * (1 + 1e-6)
    said = " ".join(found.remarks)
    assert BOUND in said and "record three periods of every sweep" in said
    assert ORDER not in said and NOT_LINEAR not in said


@pytest.mark.slow
def test_three_periods_relax_what_rings(plants, synthetic):
    found = identify_recordings((recorded(plants, synthetic, plants._sampled(modes_of(plants, 0.005))),), QUICK)
    assert [pole.frequency_hz for pole in found.identified.relaxed] == [pytest.approx(12.0, rel=1e-3)]


@pytest.mark.parametrize(
    ("level", "told"), [(3.0, "the response may depend on the amplitude"), (1.0, "do not show which")]
)
def test_a_test_that_errs_more_than_the_fit_names_no_more_than_is_known(plants, synthetic, level, told):
    commands = np.random.default_rng(1).standard_normal((8000, 3))
    segments = (Segment(0, 4000, "sweep", 1.0, 2000), Segment(4000, 8000, "multisine", level, 2000, "test"))
    recording = synthetic.recording_of(commands, commands, segments)
    tested = HeldOutValidation(error=0.2, noise=0.01, seconds=2.0)
    (said,) = describe_test_error_causes(tested, 1.0, Misfit(0.01, 0.01, 1.0, None), (recording,))
    assert told in said
    assert (
        describe_test_error_causes(
            HeldOutValidation(0.015, 0.01, 2.0), 1.0, Misfit(0.01, 0.01, 1.0, None), (recording,)
        )
        == ()
    )
