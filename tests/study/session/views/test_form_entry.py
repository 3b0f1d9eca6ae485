from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.definition.participant_text import Question, TextSettings
from study.session.views.form_entry import (
    MAX_TEXT_CHARACTERS,
    FormEntry,
    apply_key,
    click_choice,
    click_continue,
    make_blank_entry,
    make_reply,
    paste_text,
)
from study.session.views.form_views import (
    Form,
    FormField,
    FormKind,
    FormReply,
    NumberLimits,
    encode_answers,
    find_missing_fields,
)
from study.session.views.forms import judge_form, make_form
from study.store.formats.protocol_files import read_study_protocol

YES_NO = ("yes", "no")
EXCLUSION = Form(FormKind.EXCLUSION, "T", "", tuple(FormField(f"q{i}", f"Question {i}", YES_NO) for i in range(3)))
TEXT = Form(FormKind.DEBRIEF, "T", "", (FormField("free", "Free?", needed=False), FormField("grip", "Grip?")))
LONG = ("ear plugs", "ear muffs", "masking noise")
SETUP = Form(FormKind.SETUP, "T", "", (FormField("hearing", "What?", LONG), FormField("hand", "Which?", YES_NO)))


def typed(form: Form, *keys: str, stacked: bool = False, entry: FormEntry | None = None) -> FormEntry:
    entry = make_blank_entry(form) if entry is None else entry
    for key in keys:
        entry = apply_key(entry, key, key if len(key) == 1 else None, stacked) or entry
    return entry


def test_each_answer_belongs_to_the_question_at_which_its_key_came():
    entry = typed(EXCLUSION, "1", "enter", "2", "enter", "1", "enter", "enter")
    assert entry.is_sent
    assert make_reply(entry).answers == {"q0": "yes", "q1": "no", "q2": "yes"}


def test_enter_alone_answers_nothing_and_sends_nothing():
    assert typed(EXCLUSION, *["enter"] * 9) == make_blank_entry(EXCLUSION)


def test_it_is_not_sent_while_an_answer_is_missing():
    entry = typed(EXCLUSION, "1", "down", "down", "2", "down", "enter")
    assert (entry.is_sent, entry.cursor, entry.missing) == (False, 1, (1,))
    assert typed(EXCLUSION, "n", entry=entry).missing == ()


def test_a_changed_choice_is_looked_at_once_more_before_an_exclusion_is_sent():
    entry = typed(EXCLUSION, "1", "2", "enter", "2", "enter", "2", "enter", "enter")
    assert (entry.is_sent, entry.cursor, entry.unconfirmed) == (False, 0, (0,))
    again = typed(EXCLUSION, "down", "down", "down", "enter", entry=entry)
    assert again.is_sent and make_reply(again).answers == {"q0": "no", "q1": "no", "q2": "no"}
    assert typed(SETUP, "1", "2", "enter", "1", "enter", "enter").is_sent


def test_up_and_down_go_through_choices_below_each_other_first():
    entry = typed(SETUP, "down", "down", stacked=True)
    assert (entry.cursor, entry.field_entries[0].marked) == (0, 1)
    assert typed(SETUP, "down", "down", stacked=True, entry=entry).cursor == 1
    assert typed(SETUP, "up", stacked=True, entry=entry).field_entries[0].marked == 0
    assert typed(SETUP, "down", "down").cursor == 2


def test_free_text_is_edited_at_its_caret():
    entry = typed(TEXT, *"pan", "left", "e", "left", "left", "home", "delete", "end", "s", "backspace", "t")
    assert entry.field_entries[0].answer == "aent"
    assert len(typed(TEXT, *["x"] * (MAX_TEXT_CHARACTERS + 5)).field_entries[0].answer) == MAX_TEXT_CHARACTERS


def test_a_paste_is_text_and_never_keys():
    assert paste_text(make_blank_entry(EXCLUSION), "1\n1\n1\n\n") == make_blank_entry(EXCLUSION)
    assert paste_text(make_blank_entry(TEXT), "two\nlines\x07").field_entries[0].answer == "two lines"


def test_the_mouse_chooses_where_it_clicks_and_the_cursor_follows():
    entry = click_choice(make_blank_entry(EXCLUSION), 2, 1)
    assert entry.cursor == 2 and entry.field_entries[2].answer == "no"
    assert click_continue(entry).missing == (0, 1)


KEYS = st.lists(st.sampled_from(["1", "2", "y", "n", "enter", "tab", "shift+tab", "up", "down", "left", "space", "x"]))


@given(KEYS, st.booleans())
@settings(max_examples=200)
def test_no_key_touches_an_answer_other_than_that_under_the_cursor(keys, stacked):
    entry = make_blank_entry(EXCLUSION)
    for key in keys:
        after = typed(EXCLUSION, key, stacked=stacked, entry=entry)
        changed = [i for i in range(3) if after.field_entries[i] != entry.field_entries[i]]
        assert changed in ([], [entry.cursor])
        assert not after.is_sent or find_missing_fields(EXCLUSION, make_reply(after)) == ()
        assert not entry.is_sent or after == entry
        entry = after


@pytest.mark.parametrize(
    ("typed", "logged"),
    [("123456789012", "123456789012"), ("1234567,875", "1234567.875"), ("007,50", "7.5"), ("+3.", "3")],
)
def test_a_number_is_logged_with_the_digits_that_were_typed(typed, logged):
    form = Form(FormKind.DEBRIEF, "", "", (FormField("n", "Which?", limits=NumberLimits(0.0, 1e14), needed=False),))
    assert encode_answers(form, FormReply({"n": typed})) == {"n": logged}


def test_blanks_around_the_words_of_a_translation_or_a_choice_keep_no_form_from_being_sent():
    """The consent of a person who typed the word for yes was logged as a refusal."""
    protocol = replace(
        read_study_protocol("direction_threshold").protocol,
        text=TextSettings("fr", {"yes": "oui ", "no": " non"}),
        before=(Question("hand", "Which?", choices=("right ", "left")),),
    )
    for kind, key in ((FormKind.CONSENT, "1"), (FormKind.EXCLUSION, "2"), (FormKind.QUESTIONNAIRE, "1")):
        form = make_form(protocol, kind)
        assert form is not None
        entry = typed(form, *[key, "enter"] * len(form.fields), "enter")
        assert entry.is_sent and judge_form(protocol, form, make_reply(entry)).passed
        assert form.fields[0].choices[0] == form.fields[0].choices[0].strip()
