from dataclasses import replace

import pytest

from analysis.diagnosis.document import Diagnosis, Errors, Estimate, Fit, Mismatch, NamedEffect, NextExperiment, Rival
from analysis.diagnosis.effect_words import EFFECT_WORDS, format_parameters, format_place, get_noun
from analysis.diagnosis.result.candidate_wording import DeviceWording
from analysis.diagnosis.result.error_wording import describe_black_box
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.result.retuned_parameters import MovedParameter, describe_raised_error
from analysis.diagnosis.result.wording import (
    describe_confirmation,
    describe_effect,
    describe_equivalents,
    describe_next_experiment,
    describe_remainder,
    describe_rivals,
    describe_share,
    describe_verdict,
    format_effect_title,
)
from equalizer.effects.catalogue import CATALOGUE
from equalizer.plant.effect_vocabulary import EFFECT_ENTRIES, EFFECTS_BY_NAME
from equalizer.signals.unit_system import LINEAR

PLACE = Mismatch("ax", "fx", (8.0, 16.0), 0.5, "near v = 0", 0.8, 1e-9)

ERRORS = Errors(0.5, 0.36, 0.0266, 0.0265)

RIVALS = (
    Rival("stribeck_friction", 0.3, True, ""),
    Rival("viscous_damping", 0.002, False, "it leaves 4.1 times the noise"),
)

DRY = NamedEffect(
    "coulomb_friction", "mechanism", "x", 0.9, 0.68, {"level": Estimate(0.211, "N", (0.20, 0.22))}, RIVALS
)

MOVED = MovedParameter("damping fx", 0.35, "N s/m", 2.1)


def make_diagnosis(verdict, effects=(), mismatch=(PLACE,), remainder=(), errors=ERRORS, next_=None):
    return Diagnosis(verdict, mismatch, effects, {}, remainder, Fit(errors, errors), "free simulation", next_)


def test_an_effect_is_named_with_its_place_number_and_signature():
    sentence = describe_effect(DRY, "the missing force flips its sign with the velocity")
    assert sentence == (
        "Dry friction on the x drive, 0.21 N [0.20, 0.22]: the missing force flips its sign with the velocity."
    )


@pytest.mark.parametrize("name", EFFECT_ENTRIES, ids=lambda each: each.name)
def test_every_effect_of_the_vocabulary_has_a_name_that_people_use_and_reads_out_its_main_number(name):
    assert name.name in EFFECT_WORDS
    assert "_" not in get_noun(name.name)
    numbers = {p.name: Estimate(0.1234, p.find_unit(LINEAR, "m/s^2")) for p in name.parameters}
    effect = NamedEffect(name.name, name.place, "x", 1.0, 1.0, numbers)
    sentence = describe_effect(effect, "this is seen")
    assert "12" in sentence.split(":")[0]
    assert "_" not in sentence
    assert "{" not in sentence
    assert sentence.endswith("this is seen.")


def test_words_are_only_for_effects_and_numbers_that_there_are():
    for name, words in EFFECT_WORDS.items():
        known = {p.name for p in EFFECTS_BY_NAME[name].parameters}
        assert {*words.parameters, *words.shares} <= known


def test_nouns_are_distinguished():
    nouns = [words.noun for words in EFFECT_WORDS.values()]
    assert len(set(nouns)) == len(nouns)


@pytest.mark.parametrize("effect", CATALOGUE, ids=lambda each: each.name)
def test_a_signature_of_the_catalogue_ends_the_sentence_that_names_it(effect):
    assert not effect.signature.endswith(".")
    assert effect.signature[:1].islower()


def test_an_effect_without_words_is_called_by_its_own_name():
    effect = NamedEffect("odd_thing", "mechanism", None, 1.0, 1.0, {"size": Estimate(0.5, "N")})
    assert describe_effect(effect) == "Odd thing on all drives, 0.500 N."


@pytest.mark.parametrize(
    ("place", "axis", "single", "words"),
    [
        ("mechanism", "x", False, "on the x drive"),
        ("mechanism", None, False, "on all drives"),
        ("mechanism", None, True, "on the drive"),
        ("actuator", "y", False, "in the y actuator"),
        ("sensor", "ax", False, "in the ax channel"),
        ("sensor", None, False, "in all channels"),
        ("hand", None, False, "at the handle"),
    ],
)
def test_places_are_said_as_people_say_them(place, axis, single, words):
    assert format_place(place, axis, single) == words


def test_several_numbers_are_each_explained():
    numbers = {"coulomb": Estimate(0.15, "N"), "static": Estimate(0.21, "N"), "speed": Estimate(0.0045, "m/s")}
    assert format_parameters("stribeck_friction", numbers) == (
        "0.150 N in motion, 0.210 N at rest, a transition over 4.50 mm/s"
    )


def test_a_share_of_samples_is_read_as_per_cent():
    assert (
        format_parameters("lost_samples", {"fraction": Estimate(0.02, "1", (0.018, 0.022))})
        == "2.0 % [1.8, 2.2] of all"
    )


def test_a_stop_on_the_far_side_of_zero_says_from_where_it_is_reached():
    numbers = {"position": Estimate(-0.0035, "m", None), "stiffness": Estimate(1e4, "N/m", None)}
    plain = format_parameters("end_stop", numbers)
    for side, way in ((1.0, "positive"), (-1.0, "negative")):
        said = format_parameters("end_stop", numbers | {"side": Estimate(side, "1", None)})
        assert said == f"{plain}, reached in the {way} direction"


def test_the_verdict_names_what_is_missing_and_what_it_brings():
    assert describe_verdict(make_diagnosis("explained", (DRY,))) == (
        "Missing in the model: dry friction on the x drive. The error on held-out data falls from 36 % of the signal "
        "(re-tuned without it) to 2.66 % (with it), 1.00 times what noise alone would leave (2.65 %)."
    )


def test_the_verdict_says_where_more_is_missing():
    said = describe_verdict(make_diagnosis("partly_explained", (DRY,), remainder=(PLACE,)))
    assert said.startswith("Missing in the model: dry friction on the x drive, but that is not all.")
    assert said.endswith("and a mismatch remains.")


def test_no_mismatch_remains_where_none_is_reported():
    noise = replace(PLACE, p_value=0.4)
    left = make_diagnosis("partly_explained", (DRY,), remainder=(noise,), errors=Errors(0.5, 0.36, 0.0026, 0.0114))
    said = describe_verdict(left)
    assert describe_remainder(left) == "No significant mismatch remains."
    assert "a mismatch remains" not in said
    assert "not all" not in said
    assert said.endswith("only repeated periods of the excitation could show that nothing else is missing.")


def test_an_error_is_not_counted_in_noise_that_no_repeats_show():
    device = DeviceWording(True, LINEAR, "quiet band")
    said = describe_verdict(make_diagnosis("partly_explained", (DRY,), remainder=(PLACE,)), device=device)
    assert "times" not in said
    assert "noise at the level measured above the driven band would leave 2.65 %" in said
    unknown = describe_verdict(make_diagnosis("unexplained"), device=DeviceWording(True, LINEAR, "unknown"))
    assert "what noise alone would leave is not known" in unknown


def test_wrong_parameters_are_another_answer_than_missing_physics():
    said = describe_verdict(make_diagnosis("parameters"), (MOVED,))
    assert said.startswith(
        "No physics is missing; parameters of the model are wrong: damping fx +0.350 N s/m (2.1 standard deviations)."
    )
    assert "falls from 50 % of the signal (as given) to 36 % (re-tuned)" in said


def test_without_a_mismatch_the_model_is_confirmed():
    clean = Errors(0.027, 0.027, 0.027, 0.0265)
    assert describe_verdict(make_diagnosis("no_mismatch", mismatch=(), errors=clean)) == (
        "The model agrees with the device: as given, its error on held-out data is 2.7 % of the signal, 1.02 times "
        "what noise alone would leave (2.65 %)."
    )


def test_a_mismatch_without_a_name_gets_none():
    said = describe_verdict(make_diagnosis("unexplained"))
    assert said.startswith("Model and device disagree, and no effect of the catalogue explains it.")
    assert not any(words.noun in said for words in EFFECT_WORDS.values())
    for noise_method in ("quiet band", "rest", "unknown"):  # the rest may be noise in the driven band
        said = describe_verdict(make_diagnosis("unexplained"), device=DeviceWording(True, LINEAR, noise_method))
        assert said.startswith("Model and recording differ, and no effect")
        assert "only repeated periods" in said


def test_unknown_errors_and_unknown_noise_are_reported():
    unknown = Errors(None, None, None, None)
    assert "is not known" in describe_verdict(make_diagnosis("explained", (DRY,), errors=unknown))
    assert "is not known" in describe_verdict(make_diagnosis("no_mismatch", mismatch=(), errors=unknown))
    quiet = replace(ERRORS, noise=None)
    assert describe_verdict(make_diagnosis("explained", (DRY,), errors=quiet)).endswith(
        "; what noise alone would leave is not known."
    )


def test_an_error_that_does_not_fall_is_not_said_to():
    worse = Errors(0.3, 0.3, 0.31, 0.02)
    assert "goes from 30 % of the signal" in describe_verdict(make_diagnosis("explained", (DRY,), errors=worse))


def test_rivals_come_with_why_they_were_passed_over():
    assert describe_rivals(DRY) == ("Viscous damping (probability < 0.01): it leaves 4.1 times the noise.",)


def test_of_two_that_cannot_be_told_apart_both_are_named():
    assert describe_equivalents(DRY) == (
        "These data do not distinguish dry friction from friction that is larger at rest (Stribeck): both are named "
        "(probabilities: dry friction 0.68, friction that is larger at rest (Stribeck) 0.30)."
    )
    assert describe_equivalents(replace(DRY, rivals=())) == ""


def test_share_and_probability_are_reported():
    assert describe_share(DRY) == (
        "It accounts for 90 % of the mismatch after re-tuning; the probability that this effect is the cause is 0.68."
    )


def test_what_is_left_is_named_by_its_first_places():
    assert describe_remainder(make_diagnosis("explained", (DRY,))) == "No significant mismatch remains."
    places = tuple(replace(PLACE, share=share) for share in (0.8, 0.1, 0.3, 0.2, 0.05))
    said = describe_remainder(make_diagnosis("partly_explained", (DRY,), remainder=places))
    assert said.startswith(
        "Still unexplained: ax at 8 to 16 Hz, driven by fx at 0.5, near v = 0: 80 % of the mismatch (p < 0.0001); "
    )
    assert said.endswith("; and 2 smaller places.")


def test_the_next_recording_says_what_it_would_tell_apart():
    wanted = NextExperiment("hapteq record slow.toml --out slow.h5", ("coulomb_friction", "stribeck_friction"),
                            "only slow motion shows the hump")  # fmt: skip
    assert describe_next_experiment(make_diagnosis("explained", (DRY,), next_=wanted)) == (
        "The recording that would distinguish dry friction from friction that is larger at rest (Stribeck): hapteq "
        "record slow.toml --out slow.h5. Only slow motion shows the hump."
    )
    assert describe_next_experiment(make_diagnosis("explained", (DRY,))) == (
        "No further recording was found that would distinguish what these data do not."
    )
    assert describe_next_experiment(make_diagnosis("explained", (replace(DRY, rivals=()),))) == ""


@pytest.mark.parametrize(
    ("test", "physics", "end"),
    [
        (0.02, 0.05, "The black box predicts better: the data contain structure that no named effect explains."),
        (0.05, 0.02, "The physics predicts better."),
        (0.05, 0.05, "the physics has 5 %: the black box does not predict better."),
    ],
)
def test_a_black_box_that_beats_the_physics_is_said_to(test, physics, end):
    said = describe_black_box(BlackBox("ARX", 12, test, physics), is_effect_named=True)
    assert said.startswith("A black box (ARX, 12 parameters), fitted to the same samples, has an error of")
    assert said.endswith(end)
    assert "(ARX, 1 parameter), fitted" in describe_black_box(BlackBox("ARX", 1, test, physics), is_effect_named=True)
    assert "the re-tuned model has" in describe_black_box(BlackBox("ARX", 12, test, physics), is_effect_named=False)


def test_held_out_data_that_do_not_confirm_are_said_not_to():
    fit = Errors(0.5, 0.36, 0.027, 0.0265)
    assert describe_confirmation(fit, ERRORS) == ""
    assert describe_confirmation(fit, replace(ERRORS, after=0.4)).startswith("The held-out data do not confirm this")
    assert describe_confirmation(fit, replace(ERRORS, after=0.06)) == (
        "The held-out data confirm this only in part: the error is 2.26 times the noise there and 1.02 times the "
        "noise on the fitted data."
    )
    assert describe_confirmation(fit, Errors(None, None, None, None)) == ""


def test_the_title_of_an_effect_stands_alone():
    assert format_effect_title(DRY) == "dry friction on the x drive"


def test_faults_of_a_whole_sensor_need_no_place():
    turned = NamedEffect("sensor_misalignment", "sensor", None, 1.0, 0.98, {"degrees": Estimate(8.7, "deg")})
    assert format_effect_title(turned) == "a misaligned sensor"
    assert format_effect_title(replace(turned, effect="sensor_gain", parameters={"gain": Estimate(1.1, "1")})) == (
        "a wrong sensor gain in all channels"
    )


def test_numbers_that_are_off_by_little_are_said_to_be():
    said = describe_verdict(make_diagnosis("parameters"))
    assert said.startswith(
        "No physics is missing; parameters of the model are wrong, each by less than its tolerance. The"
    )


def test_no_name_shines_beside_a_model_that_re_tuning_made_worse():
    worse = Errors(0.158, 0.321, 0.016, 0.01)
    assert "from 32.1 % to" not in describe_raised_error(worse)
    assert "from 15.8 % to 32.1 %" in describe_raised_error(worse)
    assert describe_raised_error(Errors(0.321, 0.158, 0.016, 0.01)) == ""
