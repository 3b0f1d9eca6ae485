"""The forms of a sitting, made from its protocol, and the meaning of a filled one."""

from dataclasses import dataclass

from protocols.definition.preparation import ConsentSettings, DebriefQuestion, SetupSettings
from protocols.definition.probes import ProbeSettings
from protocols.definition.study_protocol import StudyProtocol
from study.session.views.form_views import Form, FormField, FormKind, FormReply

YES_NO = ("yes", "no")
HEARING = ("ear plugs", "ear muffs", "masking noise", "plugs and noise", "nothing")


@dataclass(frozen=True, slots=True)
class FormOutcome:
    passed: bool
    kept: dict[str, str]
    """Answers that go into the log."""
    reminder: str = ""
    """Where the set-up differs from the protocol; empty if it agrees."""


def form_of(protocol: StudyProtocol, kind: FormKind) -> Form | None:
    """The form; None if the protocol asks nothing of that kind."""
    match kind:
        case FormKind.CONSENT:
            return _consent(protocol) if protocol.consent.statements or protocol.probes.played else None
        case FormKind.EXCLUSION:
            return _exclusion(protocol.consent) if protocol.consent.exclusions else None
        case FormKind.SETUP:
            return _setup(protocol.setup) if protocol.setup.ask else None
        case FormKind.DEBRIEF:
            return _debrief(protocol.debrief) if protocol.debrief else None
        case FormKind.HANDLE:
            return _let_go(protocol) if protocol.probes.reference_s > 0 else None


def judge_form(protocol: StudyProtocol, kind: FormKind, reply: FormReply) -> FormOutcome:
    """Whether the form is passed, and what of it is kept."""
    answers = {key: answer.strip() for key, answer in reply.answers.items()}
    match kind:
        case FormKind.CONSENT:
            agreed = all(answer == "yes" for answer in answers.values())
            # Of a person who does not take part only that is kept.
            return FormOutcome(agreed, answers if agreed else {})
        case FormKind.EXCLUSION:
            # Which question it was is about the person's health, and no study needs it.
            return FormOutcome(all(answer == "no" for answer in answers.values()), {})
        case FormKind.SETUP:
            return FormOutcome(True, answers, _reminder(protocol.setup, answers))
        case FormKind.DEBRIEF:
            return FormOutcome(True, {key: answer for key, answer in answers.items() if answer})
        case FormKind.HANDLE:
            return FormOutcome(answers.get("free") == "yes", {})


def confirmation_of(form: Form, reply: FormReply) -> Form:
    """Confirmation form before a refused consent or an exclusion becomes final."""
    consent = form.kind is FormKind.CONSENT
    given, other = ("no", "yes") if consent else ("yes", "no")
    told = [f"“{field.label}”" for field in form.fields if reply.answers.get(field.key, "").strip() != other]
    end = "you do not take part in the study" if consent else "you cannot take part in the study"
    return Form(
        form.kind,
        "Please check your answer",
        f"You answered {given} to: {' '.join(told)}",
        (FormField("right", f"With this answer {end}, and nothing is played. Is that right?", YES_NO),),
        form.version,
        form.ethics_id,
    )


def is_confirmed(reply: FormReply) -> bool:
    """Whether the answers were confirmed; otherwise the form is filled in again."""
    return reply.answers.get("right", "").strip() == "yes"


def _consent(protocol: StudyProtocol) -> Form:
    """Probes are consented to by a statement of their own, which no protocol can leave out."""
    settings = protocol.consent
    statements = (*settings.statements, *probe_statements(protocol.probes))
    fields = tuple(
        FormField(f"statement_{number}", statement, YES_NO) for number, statement in enumerate(statements, start=1)
    )
    return Form(
        FormKind.CONSENT,
        "Consent",
        "Please read each statement. The study begins only if you agree to all of them.",
        fields,
        settings.version,
        settings.ethics_id,
    )


def probe_statements(probes: ProbeSettings) -> tuple[str, ...]:
    """What a participant agrees to beside the trials."""
    if not probes.levels_n:
        return ()
    often = f"at most once in {probes.interval_s:g} seconds"
    return (
        f"Between trials, {often}, the handle may shake weakly for under two seconds (at most {max(probes.levels_n):g} "
        "newtons), so that the device and my grip can be measured. Nothing is asked about it.",
    )


def _let_go(protocol: StudyProtocol) -> Form:
    probes = protocol.probes
    return Form(
        FormKind.HANDLE,
        "Let go of the handle",
        f"Take the hand off the handle and keep it away. It will shake for {probes.reference_s + 5:.0f} seconds, "
        f"with at most {probes.reference_n:g} newtons.",
        (FormField("free", "Is the handle free, and does nothing touch it?", ("yes", "not now")),),
    )


def take_the_handle() -> Form:
    """After a reference."""
    return Form(
        FormKind.HANDLE,
        "Take the handle again",
        "The measurement without a hand is over.",
        (FormField("held", "Do you hold the handle as before?", ("yes",)),),
    )


def _exclusion(settings: ConsentSettings) -> Form:
    fields = tuple(
        FormField(f"question_{number}", question, YES_NO)
        for number, question in enumerate(settings.exclusions, start=1)
    )
    return Form(
        FormKind.EXCLUSION,
        "Before anything moves",
        "With one yes you cannot take part today. Your answers are not kept, only whether you can take part.",
        fields,
        settings.version,
        settings.ethics_id,
    )


def _setup(settings: SetupSettings) -> Form:
    wanted = "The protocol asks for {}."
    return Form(
        FormKind.SETUP,
        "How you sit",
        "Arrange these with the experimenter; they are kept with the data.",
        (
            FormField("hearing", _add_wish("What covers the sound of the device?", wanted.format(
                "ear protection or masking noise (hapteq noise makes a file)"), settings.hearing_masked), HEARING),
            FormField("hand_hidden", _add_wish("Is the hand hidden from your eyes?", wanted.format("a hidden hand"),
                                            settings.hand_hidden), YES_NO),
            FormField("arm_supported", _add_wish(
                "Does your forearm rest on a support?", wanted.format("a supported arm"),
                settings.arm_supported), YES_NO),
            FormField("grip", f"How do you hold the handle? Asked for: {settings.grip}.",
                      ("pen grip", "whole hand", "finger tips", "other")),
            FormField("hand", "Which hand holds it?", ("right", "left")),
        ),
    )  # fmt: skip


def _add_wish(question: str, wish: str, wished: bool) -> str:
    return f"{question} {wish}" if wished else question


def _reminder(setup: SetupSettings, answers: dict[str, str]) -> str:
    differing = (
        (setup.hearing_masked and answers.get("hearing") == "nothing", "the device can be heard"),
        (setup.hand_hidden and answers.get("hand_hidden") == "no", "the hand can be seen"),
        (setup.arm_supported and answers.get("arm_supported") == "no", "the arm is not supported"),
    )
    told = ", ".join(what for differs, what in differing if differs)
    return f"The set-up is not the protocol's: {told}." if told else ""


def _debrief(questions: tuple[DebriefQuestion, ...]) -> Form:
    return Form(
        FormKind.DEBRIEF,
        "Looking back",
        "A few questions to end with. Free text may stay empty.",
        tuple(
            FormField(question.key, question.question, question.choices, needed=bool(question.choices))
            for question in questions
        ),
    )
