"""Texts for the participant in the language of the protocol (`Words`): heading and progress of a trial, outline of a
sitting, demonstration, void trials, exclusion, forms."""

from typing import Literal

from protocols.trial import Phase
from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.facts.void_reasons import ACCELERATION_MISSING, SCREEN_UNRESPONSIVE, is_computer_busy
from study.session.views.form_views import Form, NumberLimits
from study.session.views.participant_views import DemoMenu, Progress, Question, Task, Welcome


def format_heading(question: Question, words: Words = ENGLISH_WORDS) -> str:
    """Format the heading of a trial: kind and number of its run, number of the trial, and whether it is presented
    again."""
    heading_values = {
        "run": words[choose_run_key(question)],
        "number": question.run_number,
        "runs": question.runs_in_phase,
        "trial": question.trial_number,
    }
    return words.fill("heading_again" if question.repeated else "heading", heading_values)


def choose_run_key(question: Question) -> str:
    """Choose the key (in `Words`) of the text that names the kind of run: practice, interval, training or test."""
    if question.practice:
        return "run_practice"
    if question.task is Task.INTERVAL:
        return "run_interval"
    return "run_training" if question.phase is Phase.TRAINING else "run_test"


def describe_progress(progress: Progress, words: Words = ENGLISH_WORDS) -> str:
    """Describe the share of the session that is done, rounded to whole percent, and the minutes left where they are
    known."""
    share_percent, minutes_left = round(100 * progress.share_done), progress.minutes_left
    if minutes_left is None:
        return words.fill("done", {"share": share_percent})
    return words.fill(
        "done_left_1" if minutes_left == 1 else "done_left_n", {"share": share_percent, "count": minutes_left}
    )


def describe_plan(welcome: Welcome, words: Words = ENGLISH_WORDS) -> str:
    """Describe the sitting: its number of runs, and whether training is among them; without runs, training only. After
    earlier sittings: the number of runs that are left, training included."""
    if welcome.resumed_after:
        return words.fill_count("runs_left", welcome.runs + welcome.training_runs)
    if not welcome.runs:
        return words["plan_training"]
    return words.fill_count("plan_training_runs" if welcome.training_runs else "plan_runs", welcome.runs)


def describe_felt_directions(menu: DemoMenu, vibration: int, words: Words = ENGLISH_WORDS) -> str:
    """Describe which of the two directions were felt at a vibration in the demonstration. vibration: its number, from
    1."""
    felt_numbers = [str(number) for number in (1, 2) if (vibration, number) in menu.played_pairs]
    if not felt_numbers:
        return words["demo_none"]
    joined_numbers = words.fill("demo_and", {"first": felt_numbers[0], "second": felt_numbers[-1]})
    return words.fill("demo_felt", {"numbers": joined_numbers if len(felt_numbers) == 2 else felt_numbers[0]})


def describe_void_trial(reason: str, words: Words = ENGLISH_WORDS) -> str:
    """Describe why a trial was void. reason: as in the session log; a reason without a text for the participant is
    stated itself, translated where `words` has a translation."""
    if is_computer_busy(reason):
        return words["void_busy"]
    if reason == SCREEN_UNRESPONSIVE:
        return words["void_screen"]
    if reason.endswith(ACCELERATION_MISSING):
        return words["void_sensor"]
    return words.fill("void_because", {"reason": words.translate_fact(reason)})


def describe_refusal(outcome: Literal["refused", "excluded"], words: Words = ENGLISH_WORDS) -> tuple[str, ...]:
    """Describe the end of a session for a person who does not take part: the last text, and a sentence on which data
    are kept."""
    return words[outcome], words[f"{outcome}_kept"]


def describe_form_origin(form: Form, words: Words = ENGLISH_WORDS) -> str:
    """Describe the version of a form and the number of its ethics approval; empty where the form states neither."""
    version_text = words.fill("form_version", {"version": form.version}) if form.version else ""
    ethics_text = words.fill("form_ethics", {"number": form.ethics_id}) if form.ethics_id else ""
    return " ".join(filter(None, (version_text, ethics_text)))


def describe_number_limits(limits: NumberLimits, words: Words = ENGLISH_WORDS) -> str:
    """Describe the range of the numbers that a field of a form accepts."""
    return words.fill("form_number", {"lowest": f"{limits.lowest:g}", "highest": f"{limits.highest:g}"})
