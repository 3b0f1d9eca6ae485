"""Forms of a session, made from its protocol, and the evaluation of a filled form.

Consent, exclusion criteria, questionnaires before and after the trials, set-up, and release of the handle. The data
classes are those of `form_views`. Begin with `make_form` and `judge_form`.
"""

from dataclasses import dataclass

from protocols.definition.participant_text import Question
from protocols.definition.preparation import ConsentSettings, SetupSettings
from protocols.definition.probes import ProbeSettings
from protocols.definition.study_protocol import StudyProtocol
from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.form_views import Form, FormField, FormKind, FormReply, NumberLimits, encode_answers

YES_NO = ("yes", "no")
"""Codes of the two answers as they are logged; the text that is shown depends on the language."""
HEARING = {
    "ear plugs": "hearing_plugs",
    "ear muffs": "hearing_muffs",
    "masking noise": "hearing_noise",
    "plugs and noise": "hearing_both",
    "nothing": "hearing_nothing",
}
"""Hearing protection, a question of the set-up form: logged code, and key of the text that the participant reads."""
GRIPS = {"pen grip": "grip_pen", "whole hand": "grip_hand", "finger tips": "grip_tips", "other": "grip_other"}
"""Grips of the handle, a question of the set-up form: logged code, and key of the text."""
HANDS = {"right": "hand_right", "left": "hand_left"}
"""Hand on the handle, a question of the set-up form: logged code, and key of the text."""


@dataclass(frozen=True, slots=True)
class FormOutcome:
    """Evaluation of a filled form: whether the participant may continue, and what is logged."""

    passed: bool
    kept: dict[str, str]
    """Answers that go into the log, in codes that do not depend on the language."""
    reminder: str = ""
    """Differences between set-up and requirements, as an English sentence for the log (`_describe_deviations`); empty
    without any."""


def make_words(protocol: StudyProtocol) -> Words:
    """Make the texts that participants read, in the language of the protocol."""
    return Words(protocol.text.words)


def make_form(protocol: StudyProtocol, kind: FormKind) -> Form | None:
    """Make the form of this kind; None if the protocol has no questions of this kind."""
    words = make_words(protocol)
    match kind:
        case FormKind.CONSENT:
            return (
                _make_consent_form(protocol, words)
                if protocol.consent.statements or protocol.probes.is_enabled
                else None
            )
        case FormKind.EXCLUSION:
            return _make_exclusion_form(protocol.consent, words) if protocol.consent.exclusions else None
        case FormKind.QUESTIONNAIRE:
            return _make_question_form(kind, "questions", protocol.before, words) if protocol.before else None
        case FormKind.SETUP:
            return _make_setup_form(protocol.setup, words) if protocol.setup.ask else None
        case FormKind.DEBRIEF:
            return _make_question_form(kind, "debrief", protocol.debrief, words) if protocol.debrief else None
        case FormKind.HANDLE:
            return _make_release_form(protocol, words) if protocol.probes.reference_s > 0 else None


def judge_form(protocol: StudyProtocol, form: Form, reply: FormReply) -> FormOutcome:
    """Judge whether the form is passed, and select which of its answers are logged."""
    answers = encode_answers(form, reply)
    match form.kind:
        case FormKind.CONSENT:
            has_consented = all(answer == "yes" for answer in answers.values())
            # Of a person who refuses, only the refusal is logged.
            return FormOutcome(has_consented, answers if has_consented else {})
        case FormKind.EXCLUSION:
            # Which question excludes the person concerns the person's health and is not needed by the study.
            return FormOutcome(all(answer == "no" for answer in answers.values()), {})
        case FormKind.SETUP:
            return FormOutcome(True, answers, _describe_deviations(protocol.setup, answers))
        case FormKind.QUESTIONNAIRE | FormKind.DEBRIEF:
            return FormOutcome(True, {key: answer for key, answer in answers.items() if answer})
        case FormKind.HANDLE:
            return FormOutcome(answers.get("free") == "yes", {})


def make_confirmation(form: Form, reply: FormReply, words: Words = ENGLISH_WORDS) -> Form:
    """Make the form that asks to confirm a refused consent or an exclusion before it becomes final, with the questions
    concerned."""
    is_consent, answers = form.kind is FormKind.CONSENT, encode_answers(form, reply)
    quoted_questions = [
        words.fill("quoted", {"text": field.label})
        for field in form.fields
        if answers[field.key] != ("yes" if is_consent else "no")
    ]
    return Form(
        form.kind,
        words["confirm_title"],
        words.fill("confirm_no" if is_consent else "confirm_yes", {"questions": " ".join(quoted_questions)}),
        (_make_yes_no_field("right", words["confirm_refused" if is_consent else "confirm_excluded"], words),),
        form.version,
        form.ethics_id,
    )


def is_confirmed(confirmation: Form, reply: FormReply) -> bool:
    """Whether the answers were confirmed by yes; otherwise the form is filled in again."""
    return encode_answers(confirmation, reply)["right"] == "yes"


def _make_yes_no_field(key: str, label: str, words: Words) -> FormField:
    """Make a question to be answered by yes or no."""
    return _make_choice_field(key, label, {code: code for code in YES_NO}, words)


def _make_choice_field(key: str, label: str, choices: dict[str, str], words: Words) -> FormField:
    """Make a question with choices. choices: key of the text by logged code."""
    return FormField(key, label, tuple(words[word_key].strip() for word_key in choices.values()), codes=tuple(choices))


def _make_consent_form(protocol: StudyProtocol, words: Words) -> Form:
    """Make the consent form: the statements of the protocol and, where it has probes, a statement on these, which no
    protocol can leave out."""
    settings = protocol.consent
    statements = (*settings.statements, *list_probe_statements(protocol.probes, words))
    fields = tuple(
        _make_yes_no_field(f"statement_{number}", statement, words)
        for number, statement in enumerate(statements, start=1)
    )
    version_and_ethics_id = settings.version, settings.ethics_id
    return Form(FormKind.CONSENT, words["consent_title"], words["consent_intro"], fields, *version_and_ethics_id)


def list_probe_statements(probes: ProbeSettings, words: Words = ENGLISH_WORDS) -> tuple[str, ...]:
    """List the statements of consent to the probes between trials; empty where the protocol has no probes."""
    if not probes.levels_n:
        return ()
    probe_texts = {"seconds": f"{probes.interval_s:g}", "newtons": f"{max(probes.levels_n):g}"}
    return (words.fill("consent_probes", probe_texts),)


def _make_release_form(protocol: StudyProtocol, words: Words) -> Form:
    """Make the form that asks the participant to release the handle for the reference probe. The duration shown is
    `reference_s` plus an allowance of 5 s, chosen."""
    probes = protocol.probes
    reference_texts = {"seconds": f"{probes.reference_s + 5:.0f}", "newtons": f"{probes.reference_n:g}"}
    answers = {"yes": "yes", "not now": "let_go_not_now"}
    return Form(
        FormKind.HANDLE,
        words["let_go_title"],
        words.fill("let_go_intro", reference_texts),
        (_make_choice_field("free", words["let_go_free"], answers, words),),
    )


def make_take_handle_form(words: Words = ENGLISH_WORDS) -> Form:
    """Make the form that asks the participant to take the handle again, after a reference probe."""
    held_field = _make_choice_field("held", words["take_held"], {"yes": "yes"}, words)
    return Form(FormKind.HANDLE, words["take_title"], words["take_intro"], (held_field,))


def _make_exclusion_form(settings: ConsentSettings, words: Words) -> Form:
    """Make the form of the exclusion criteria: yes to any question excludes the participant."""
    fields = tuple(
        _make_yes_no_field(f"question_{number}", question, words)
        for number, question in enumerate(settings.exclusions, start=1)
    )
    version_and_ethics_id = settings.version, settings.ethics_id
    return Form(FormKind.EXCLUSION, words["exclusion_title"], words["exclusion_intro"], fields, *version_and_ethics_id)


def _make_setup_form(settings: SetupSettings, words: Words) -> Form:
    """Make the set-up form. Where the protocol has a requirement, the question states it."""

    def format_question(key: str, is_required: bool) -> str:
        """Format the question with this key of its text, with the requirement if there is one."""
        return f"{words[key]} {words[f'{key}_wanted']}" if is_required else words[key]

    return Form(
        FormKind.SETUP,
        words["setup_title"],
        words["setup_intro"],
        (
            _make_choice_field("hearing", format_question("setup_hearing", settings.hearing_masked), HEARING, words),
            _make_yes_no_field("hand_hidden", format_question("setup_hidden", settings.hand_hidden), words),
            _make_yes_no_field("arm_supported", format_question("setup_arm", settings.arm_supported), words),
            _make_choice_field("grip", words.fill("setup_grip", {"grip": settings.grip}), GRIPS, words),
            _make_choice_field("hand", words["setup_hand"], HANDS, words),
        ),
    )


def _describe_deviations(setup: SetupSettings, answers: dict[str, str]) -> str:
    """Describe differences between set-up and requirements (hearing, hidden hand, supported arm; not grip and hand) in
    an English sentence for the log; empty without any."""
    checked_requirements = (
        (setup.hearing_masked and answers.get("hearing") == "nothing", "the device can be heard"),
        (setup.hand_hidden and answers.get("hand_hidden") == "no", "the hand can be seen"),
        (setup.arm_supported and answers.get("arm_supported") == "no", "the arm is not supported"),
    )
    deviation_text = ", ".join(deviation for is_violated, deviation in checked_requirements if is_violated)
    return f"The set-up is not the protocol's: {deviation_text}." if deviation_text else ""


def _make_question_form(kind: FormKind, name: str, questions: tuple[Question, ...], words: Words) -> Form:
    """Make a form of voluntary questions: participation does not depend on their answers."""
    fields = tuple(_make_question_field(question, words) for question in questions)
    return Form(kind, words[f"{name}_title"], words[f"{name}_intro"], fields)


def _make_question_field(question: Question, words: Words) -> FormField:
    """Make the field of a question of the protocol; the meaning of a scale's ends is added to the question."""
    label = question.question
    if question.ends:
        meaning = {"low_end": question.ends[0], "high_end": question.ends[1]}
        steps = {"lowest": question.scale[0], "highest": question.scale[1]}
        label = f"{label} ({words.fill('form_scale', {**steps, **meaning})})"
    limits = NumberLimits(*question.number) if question.number else None
    choices = tuple(choice.strip() for choice in question.choices or question.steps)  # as answers are
    return FormField(question.key, label, choices, needed=False, codes=question.codes, limits=limits)
