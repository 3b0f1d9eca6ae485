"""Methods section of a study report: task, stimulus, schedule, levels, threshold and statistics as paragraphs.

`compose_methods_text` generates the text from the protocol. Sources of the statistical methods are in
docs/statistics.md.
"""

from analysis.psychophysics.thresholds import CUT_PROBABILITY
from analysis.wording import conjoin, format_newtons, typeset
from protocols.definition.preparation import DemoSettings, PracticeSettings
from protocols.definition.staircase_rule import StaircaseRule, StepChange
from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.psi import LAPSE_RATE
from protocols.procedure.schedule import BALANCED_BLOCK_TRIALS

_ORDER_PHRASES = {
    "random": "in random order",
    "williams": "in an order balanced for carry-over (Williams)",
    "as_listed": "in this order",
}
"""Text for the order of the frequencies, by `schedule.order` of the protocol."""
_DIRECTION_PHRASES = {
    "independent": "drawn independently for every trial",
    "balanced": f"drawn so that both occurred equally often within every {BALANCED_BLOCK_TRIALS} trials",
}
"""Text for the choice of the direction, by `schedule.directions`."""
_LEVEL_SENTENCES = {
    "commanded_force": "The level of a trial is the amplitude of the commanded force.",
    "delivered_acceleration": "Stimuli were accelerations of the handle, equal for both directions, commanded through "
    "an identified model of the device. The level of a trial is the highest force that either direction needs for that "
    "acceleration; the table of trials has the target and the measured acceleration.",
}
"""Meaning of the level of a trial, by `stimulus.quantity`."""
_STIMULUS_NOUNS = {"commanded_force": "sinusoidal force", "delivered_acceleration": "sinusoidal vibration"}
"""Noun for the stimulus, by `stimulus.quantity`."""
_STEP_CHANGE_PHRASES = {
    StepChange.AFTER_REVERSAL: "the reversal that completed a phase still moved by that phase's step",
    StepChange.AT_REVERSAL: "the reversal that completed a phase already moved by the next step",
    StepChange.AT_NEXT_REVERSAL: "a phase's step stayed in force for one reversal more",
}
"""Text for the time at which the step size changes, by `staircase.step_change`."""
_STATISTICS_PARAGRAPH = (
    "All answers of the test runs enter one hierarchical psychometric model (docs/statistics.md): threshold in dB by "
    "frequency, person, and person x frequency; slope and criterion by person; one lapse rate; persons integrated out "
    "by adaptive quadrature; intervals by persons, with n - 1 degrees of freedom. "
    "Frequencies are compared as published, by one-way analysis of variance between groups with Tukey-Kramer pairs "
    "and Hochberg-Tamhane comparison intervals (those that MATLAB's multcompare draws), and, because every "
    "participant took every frequency, within participants: analysis of variance with the Greenhouse-Geisser "
    "and the Huynh-Feldt correction, and Friedman's test on ranks. Thresholds that the cap cut enter as plain numbers; "
    "intervals and effect sizes that include them have no stated coverage."
)
"""The same for every study."""
_SENSITIVITY_SENTENCE = (
    "Sensitivity d' and criterion are those of one-interval identification over all trials of a run, with the "
    "log-linear correction; the criterion is positive for a bias towards the answer 2."
)
"""Last sentence on the threshold, for staircases and for Psi."""


def compose_methods_text(protocol: StudyProtocol) -> tuple[str, ...]:
    """Compose a paragraph each on task, stimulus, schedule, levels, threshold, further procedures (if any) and
    statistics."""
    rule = protocol.staircase
    return (
        _describe_task(protocol),
        _describe_stimulus(protocol),
        _describe_schedule(protocol),
        _describe_level_rule(rule),
        _describe_threshold(rule),
        *_describe_further_procedures(protocol),
        _STATISTICS_PARAGRAPH,
    )


def _describe_task(protocol: StudyProtocol) -> str:
    """Describe the directions, the answer, feedback, void trials and swapped numbers."""
    trial, directions = protocol.trial, protocol.directions
    first_angle, second_angle, symmetry_angle = (
        typeset(f"{directions.symmetry_deg + offset_deg:g}") for offset_deg in (45, -45, 0)
    )
    limit_text = f"within {trial.time_limit_s:g} s" if trial.time_limit_s else "without a limit of time"
    feedback_text = "was told" if trial.feedback == "after_answer" else "was not told"
    return (
        f"Every trial played one {_STIMULUS_NOUNS[protocol.stimulus.quantity]} along one of two orthogonal directions, "
        f"at {first_angle}° (1) and {second_angle}° (2) in the {directions.plane} plane, mirrored about the linkage's "
        f"line of symmetry at {symmetry_angle}°. The direction was {_DIRECTION_PHRASES[protocol.schedule.directions]}. "
        f"The participant said which of the two it was, {limit_text}, and {feedback_text} whether that was right. A "
        "void trial was presented again with the same stimulus: after pauses and faults, and where the participant "
        f"asked for it, at most {trial.repeats_per_run} times in a run. (Sessions begun before this rule drew a new "
        "one.)"
        + (
            " For every second participant the numbers 1 and 2 changed places; the table of trials has the angle."
            if protocol.schedule.labels == "swapped_for_half"
            else ""
        )
    )


def _describe_stimulus(protocol: StudyProtocol) -> str:
    """Describe the envelope, polarity, quantity and roving of the stimulus, and the virtual spring."""
    stimulus = protocol.stimulus
    polarity_text = "to either side at random" if stimulus.onset_polarity == "random" else "always to the same side"
    return (
        f"The amplitude rose over {stimulus.fade_in_s:g} s ({stimulus.fade_shape.replace('_', ' ')}), was held until "
        f"the answer, and fell over {stimulus.fade_out_s:g} s; the first half-wave went {polarity_text}. "
        + _LEVEL_SENTENCES[stimulus.quantity]
        + (
            f" Each amplitude was drawn, evenly in dB, from a range of {stimulus.rove_db:g} dB around the level of the "
            "staircase, independently of the direction (roving). Thresholds by reversals are those of the staircase's "
            "levels, the model of all answers takes the amplitudes that were played."
            if stimulus.rove_db
            else ""
        )
        + (
            f" A virtual spring of {protocol.spring.natural_frequency_hz:g} Hz kept the handle near the centre."
            if protocol.spring.natural_frequency_hz
            else ""
        )
    )


def _describe_schedule(protocol: StudyProtocol) -> str:
    """Describe the frequencies, their order, rests and training."""
    frequencies_text = conjoin([f"{frequency:g}" for frequency in protocol.stimulus.frequencies_hz])
    training_text = conjoin([f"{frequency:g} Hz" for frequency in protocol.training.frequencies_hz])
    rest_text = f", at least {protocol.rests.after_run_s:g} s apart" if protocol.rests.after_run_s else ""
    return (
        f"The frequencies were {frequencies_text} Hz, one whole {_name_run(protocol.staircase)} each, "
        f"{_ORDER_PHRASES[protocol.schedule.order]}{rest_text}. "
        + (
            f"Training came first ({training_text}) and enters no result."
            if training_text
            else "There was no training."
        )
    )


def _describe_level_rule(rule: StaircaseRule) -> str:
    """Describe how levels are chosen (staircase or Psi) and when a run ends. A 1-up m-down staircase converges where m
    right answers in a row have the probability 1/2, that is at a proportion correct of 0.5^(1/m)."""
    if rule.is_bayesian:
        spread_text = f", or once its standard deviation was below {rule.bayesian.spread_db:g} dB"
        return (
            f"The level began at {rule.start_n:g} N; each later level was the one that was expected to give the most "
            "information on threshold and slope, given all previous answers of the run (Psi: Kontsevich and Tyler "
            f"1999; Weibull curve, {100 * LAPSE_RATE:g} % lapses, flat prior). It never passed {rule.cap_n:g} N. A run "
            f"ended after {rule.bayesian.trials} trials{spread_text if rule.bayesian.spread_db else ''}."
        )
    phases_text = conjoin([f"{phase.step_db:g} dB for {phase.reversals} reversals" for phase in rule.steps])
    up_rule = "every wrong answer" if rule.up_after_wrong == 1 else f"{rule.up_after_wrong} wrong answers in a row"
    down_rule = (
        "every right answer" if rule.down_after_right == 1 else f"{rule.down_after_right} right answers in a row"
    )
    sentences = [
        f"The level began at {rule.start_n:g} N, rose after {up_rule} and fell after {down_rule}, by {phases_text}; "
        f"{_STEP_CHANGE_PHRASES[rule.step_change]}.",
        f"It never passed {rule.cap_n:g} N; a push against this cap moved nothing and was no reversal.",
        f"A reversal is a change of the level's direction, and the run ended at once with reversal {rule.reversals}"
        + (f", or without a threshold after {rule.trial_limit} trials." if rule.trial_limit else "."),
    ]
    if rule.initial_one_up_one_down:
        sentences.insert(1, "Until the first reversal it moved after every answer.")
    if rule.up_after_wrong == 1:
        sentences.append(f"Such a run converges where {100 * 0.5 ** (1 / rule.down_after_right):.1f} % are right.")
    return " ".join(sentences)


def _describe_threshold(rule: StaircaseRule) -> str:
    """Describe the threshold of a run, the mark for a threshold cut by the cap, and the measures of response bias."""
    if rule.is_bayesian:
        return (
            "The threshold is the mean of its posterior in dB, at most the cap. It was recomputed from the answers, "
            "and every level on record was checked against the rule. It is marked as cut by the cap where it lies "
            f"above it with a probability over {CUT_PROBABILITY:g}. {_SENSITIVITY_SENTENCE}"
        )
    return (
        f"The threshold is the arithmetic mean, in newtons, of the levels at the last {rule.averaged_reversals} "
        "reversals. It was recomputed from the answers, and every level on record was checked against the rule. It "
        "is marked as cut by the cap when at least one of these reversals is a peak at the cap, which a stronger "
        f"device would have let rise further; it is not a bound of the true threshold. {_SENSITIVITY_SENTENCE}"
    )


def _describe_further_procedures(protocol: StudyProtocol) -> tuple[str, ...]:
    """Describe demonstration, start position (gate), practice, catch trials and detection in one paragraph, as far as
    the protocol has them; empty without any."""
    demo, practice, catch, detection = protocol.demo, protocol.practice, protocol.catch, protocol.detection
    sentences = []
    if demo.level_n:
        sentences.append(
            f"Before the first answer, both directions were played at every frequency, labelled, for {demo.seconds:g} "
            f"s each at {describe_levels(demo)}."
        )
    if protocol.gate.radius_mm:
        sentences.append(f"A trial began with the handle within {protocol.gate.radius_mm:g} mm of its place.")
    if practice.frequencies_hz:
        level_article = "" if practice.rove_db else "a fixed level of "
        feedback_preposition = "with" if practice.feedback == "after_answer" else "without"
        sentences.append(
            f"Practice at {_format_frequencies(practice.frequencies_hz)} was at "
            f"{level_article}{describe_levels(practice)}, {feedback_preposition} feedback, until "
            f"{practice.right_needed} of the last {practice.of_last} answers were right or "
            f"{practice.trial_limit} trials were over. It excluded no participant and enters no result."
        )
    if catch.one_in:
        sentences.append(
            f"One in {catch.one_in} trials of a test run, at a place drawn by lot, was a catch trial at "
            f"{protocol.staircase.cap_n:g} N. It changed no level of the {_name_run(protocol.staircase)} and enters no "
            "threshold."
        )
    if detection.frequencies_hz:
        sentences.append(
            f"Detection was tested after the test runs, at {_format_frequencies(detection.frequencies_hz)}: one of two "
            f"intervals of {detection.interval_s:g} s, {detection.gap_s:g} s apart, held a stimulus, and the "
            f"participant said which. The rule of the levels was the same, from {detection.start_n:g} N."
        )
    return (" ".join(sentences),) if sentences else ()


def _name_run(rule: StaircaseRule) -> str:
    """Name a run in the text: "staircase", or under Psi "run"."""
    return "run" if rule.is_bayesian else "staircase"


def describe_levels(settings: DemoSettings | PracticeSettings) -> str:
    """Describe the fixed level, or the range in N from which each level was drawn: half of `rove_db` to either side."""
    if not settings.rove_db:
        return f"{settings.level_n:g} N"
    half_range_ratio = 10.0 ** (settings.rove_db / 40.0)
    return (
        f"levels drawn evenly in dB from {format_newtons(settings.level_n / half_range_ratio)} "
        f"to {format_newtons(settings.level_n * half_range_ratio)} N"
    )


def _format_frequencies(frequencies_hz: tuple[float, ...]) -> str:
    """Format frequencies as a list with the unit at its end."""
    return f"{conjoin([f'{frequency:g}' for frequency in frequencies_hz])} Hz"
