import asyncio
import random

import pytest
from rich.cells import cell_len
from textual import events

from study.session.views.form_entry import apply_key, make_blank_entry, make_reply
from study.session.views.form_views import Form, FormField, FormKind, FormReply
from study.tui.screens.form import FormScreen
from study.tui.widgets.choice_row import ChoiceRow
from tests.slow_instances import slow, slow_after

YES_NO = ("yes", "no")
HEARING = ("ear plugs", "ear muffs", "masking noise", "plugs and noise", "nothing that covers it")
THREE = Form(
    FormKind.CONSENT,
    "Consent",
    "Read.",
    tuple(FormField(f"s{i}", f"Statement {i}, [as it is].", YES_NO) for i in (1, 2, 3)),
    "2",
    "EC 7",
)
MIXED = Form(
    FormKind.DEBRIEF,
    "Looking back",
    "",
    (
        FormField("hearing", "What covered the sound?", HEARING),
        FormField("rating", "How hard was it?", ("1", "3", "5")),
        FormField("strategy", "How did you decide?", needed=False),
        FormField("grip", "What was your grip?"),
    ),
)


@pytest.fixture
def filled(on_stage):
    def fill(form, *keys):
        seen = []

        async def story(stage):
            await stage.press(*keys)
            seen.append(stage.words)

        heard = on_stage(FormScreen(form), story)
        return (heard[0] if heard else None), seen[0]

    return fill


@pytest.mark.slow
def test_numbers_letters_and_the_space_bar_choose_and_enter_continues(filled):
    reply, _ = filled(THREE, "1", "enter", "y", "enter", "right", "right", "space", "enter", "enter")
    assert reply == FormReply({"s1": "yes", "s2": "yes", "s3": "no"})


@pytest.mark.slow
def test_arrows_and_tab_go_from_question_to_question(filled):
    reply, _ = filled(THREE, "down", "2", "up", "1", "tab", "tab", "1", "down", "enter")
    assert reply == FormReply({"s1": "yes", "s2": "no", "s3": "yes"})


@pytest.mark.slow
def test_what_is_missing_is_named_and_gets_the_focus(filled):
    reply, words = filled(THREE, "1", "down", "down", "down", "enter")
    assert reply is None
    assert "Please answer 2: “Statement 2, [as it is].” 1 more is open." in words
    reply, _ = filled(THREE, "1", "down", "down", "down", "enter", "n", "down", "n", "down", "enter")
    assert reply == FormReply({"s1": "yes", "s2": "no", "s3": "no"})


def test_many_changed_answers_do_not_hide_how_they_are_confirmed(filled):
    form = Form(FormKind.EXCLUSION, "T", "", tuple(FormField(f"k{i}", f"Question {i}?", YES_NO) for i in range(4)))
    keys = [*["1", "enter"] * 4, *["up"] * 4, *["2", "enter"] * 4, "enter"]
    assert "4 is “no”. If that is right, go to Continue once more." in filled(form, *keys)[1]


@pytest.mark.slow
def test_two_and_more_gaps_are_counted(filled):
    assert "2 more are open." in filled(THREE, "down", "down", "down", "enter")[1]


@pytest.mark.slow
def test_nothing_is_agreed_to_by_enter_alone_or_by_moving(filled):
    reply, words = filled(THREE, *["enter"] * 6)
    assert reply is None
    assert "3 of 3 still open" in words
    assert "3 of 3 still open" in filled(THREE, "right", "down", "left")[1]


@pytest.mark.slow
def test_a_form_says_how_much_is_open_and_when_it_is_done(filled):
    assert "Consent: 2 of 3 still open" in filled(THREE, "1")[1]
    _, words = filled(THREE, "1", "enter", "1", "enter", "1")
    assert "everything is answered" in words and "Go down to Continue" in words


def test_optional_questions_without_an_answer_are_not_called_answered(filled):
    form = Form(FormKind.QUESTIONNAIRE, "About you", "", (FormField("age", "How old are you?", needed=False),))
    assert "is answered" not in filled(form)[1]
    assert "About you: everything is answered" in filled(form, *"28")[1]


def test_version_and_ethics_id_are_shown(filled):
    assert "Version 2. Ethics approval EC 7." in filled(THREE)[1]


@pytest.mark.slow
def test_many_choices_lie_below_each_other_and_are_walked_through(filled):
    keys = ["down", "down", "space", "down", "down", "down", "down"]
    _, words = filled(MIXED, *keys)
    assert "2 ● ear muffs" in words
    reply, _ = filled(MIXED, "3", "enter", "3", "enter", *"by feel", "enter", *"pen", "enter", "enter")
    assert reply.answers == {"hearing": "masking noise", "rating": "3", "strategy": "by feel", "grip": "pen"}


@pytest.mark.slow
def test_a_digit_that_is_a_choice_means_that_choice_and_no_other(filled):
    assert "● 5" in filled(MIXED, "1", "enter", "5")[1]
    assert "●" not in filled(MIXED, "tab", "2")[1]


@pytest.mark.slow
def test_free_text_that_is_not_needed_may_stay_empty(filled):
    reply, _ = filled(MIXED, "1", "enter", "1", "enter", "enter", *"x", "enter", "enter")
    assert reply.answers["strategy"] == ""
    reply, words = filled(MIXED, "1", "enter", "1", "enter", "enter", "space", "enter", "enter")
    assert reply is None and "Please answer 4" in words


def test_a_long_question_is_quoted_short(filled):
    form = Form(FormKind.SETUP, "T", "", (FormField("k", "x" * 100, YES_NO),))
    assert f"“{'x' * 47}…”" in filled(form, "down", "enter")[1]


def test_the_mouse_chooses_too(on_stage):
    async def story(stage):
        lines = stage.text.splitlines()
        row = next(i for i, line in enumerate(lines) if "○ no" in line)
        await stage.pilot.click(offset=(lines[row].index("○ no"), row))
        await stage.pilot.pause()
        assert "2 ● no" in stage.words

    on_stage(FormScreen(THREE), story)


def test_the_mouse_chooses_among_wide_characters(on_stage):
    """Each takes two cells of the terminal."""
    row = ChoiceRow(("はい、そうします", "いいえ"))

    async def story(stage):
        screen = stage.app.screen
        await screen.mount(row)
        await stage.pilot.pause()
        width = cell_len(row.render().plain.rstrip())
        assert row.find_choice_at(width - 1, 0) == 1
        assert row.find_choice_at(cell_len(" 1 ○ はい、そうします") - 1, 0) == 0
        assert len(row._place_choices(width + 1)) == 2 and row._place_choices(width)[1][1] == 1

    on_stage(FormScreen(THREE), story)


EXCLUSION = Form(FormKind.EXCLUSION, "Before anything moves", "", THREE.fields)
WALK = ["1", "2", "3", "enter", "enter", "tab", "shift+tab", "up", "down", "left", "right", "space", "y", "n"]
TEXT_KEYS = ["x", "backspace", "delete", "home", "end", "left", "q", "?", "p"]
BURSTS = 10
"""Of each form in the default run; the slow test takes a hundred times as many."""


def test_keys_that_arrive_at_once_answer_the_questions_that_they_were_typed_for(on_stage):
    """From the issue: sent in one burst, both "yes" of the exclusion form were lost."""

    async def story(stage):
        stage.burst("1", "enter", "2", "enter", "1", "enter", "enter")
        await stage.until(lambda: stage.heard)

    assert on_stage(FormScreen(EXCLUSION), story) == [FormReply({"s1": "yes", "s2": "no", "s3": "yes"})]


def test_a_key_without_a_meaning_where_it_was_typed_means_nothing_later(on_stage):
    """At Continue "1" chooses nothing: it must not choose at the question that keys behind it go to."""

    async def story(stage):
        stage.burst("down", "down", "down", "1", "up", "n")
        await stage.until(lambda: stage.app.screen.entry.field_entries[2].answer)
        await stage.pilot.pause(0.2)
        assert [given.answer for given in stage.app.screen.entry.field_entries] == ["", "", "no"]

    on_stage(FormScreen(EXCLUSION), story)


@pytest.mark.parametrize("form", [*slow(EXCLUSION), MIXED], ids=["choices", "mixed"])
@pytest.mark.parametrize("seed", slow_after(1, range(2)))
def test_any_burst_fills_in_what_the_same_keys_fill_in_one_by_one(on_stage, form, seed):
    follow_bursts(on_stage, form, seed, BURSTS)


@pytest.mark.slow
@pytest.mark.parametrize("form", [EXCLUSION, MIXED], ids=["choices", "mixed"])
@pytest.mark.parametrize("seed", range(10, 20))
def test_a_thousand_bursts_fill_in_what_their_keys_fill_in_one_by_one(on_stage, form, seed):
    follow_bursts(on_stage, form, seed, 10 * BURSTS)


def follow_bursts(on_stage, form, seed, bursts):
    """Random keys in bursts, with pauses of any length, against the entry that takes each key by itself."""
    draw = random.Random(seed)
    screen = FormScreen(form)

    async def story(stage):
        rows = list(screen.query("FormQuestion"))
        stacked = [row.stacked for row in rows] + [False]
        wanted = make_blank_entry(form)
        for _ in range(bursts):
            keys = draw.choices(WALK + (TEXT_KEYS if form is MIXED else []), k=draw.randint(2, 15))
            if wanted.cursor == len(form.fields):
                keys[0] = "up"  # so that it goes on for long
            for key in keys:
                character = key if len(key) == 1 else " " if key == "space" else None
                wanted = apply_key(wanted, key, character, stacked[wanted.cursor]) or wanted
                if wanted.is_sent:
                    break
            stage.burst(*keys)
            for _ in range(draw.choice([0, 0, 1, 3, 30])):
                await asyncio.sleep(0)
            if wanted.is_sent:
                break
        if wanted.is_sent:
            await stage.until(lambda: any(isinstance(heard, FormReply) for heard in stage.heard))
            reply = next(heard for heard in stage.heard if isinstance(heard, FormReply))
            assert reply == make_reply(wanted), f"seed {seed}"
            return
        await stage.pilot.pause()
        assert screen.entry == wanted, f"seed {seed}"
        shown = [row.query_one("ChoiceRow").answer for row in rows if row.field.choices]
        assert shown == [
            given.answer for given, row in zip(wanted.field_entries, rows, strict=True) if row.field.choices
        ]
        assert [row.has_class("-at") for row in rows] == [i == wanted.cursor for i in range(len(rows))]

    on_stage(screen, story)


def test_a_click_in_a_burst_of_keys_keeps_its_place(on_stage):
    screen = FormScreen(THREE)

    async def story(stage):
        lines = stage.text.splitlines()
        rows = [i for i, line in enumerate(lines) if "○ no" in line]
        x, y = lines[rows[2]].index("○ no"), rows[2]
        stage.burst("1")
        for kind in (events.MouseDown, events.MouseUp):
            stage.app._driver.send_message(kind(None, x, y, 0, 0, 1, False, False, False, x, y))
        stage.burst("up", "1")
        await stage.pilot.pause()
        assert make_reply(screen.entry).answers == {"s1": "yes", "s2": "yes", "s3": "no"}

    on_stage(screen, story)


@pytest.mark.slow
def test_pasted_text_chooses_nothing_and_sends_nothing(on_stage):
    screen = FormScreen(MIXED)

    async def story(stage):
        stage.app.post_message(events.Paste("1\n2\n\n"))
        await stage.pilot.pause()
        assert screen.entry == make_blank_entry(MIXED)
        await stage.press("1", "enter", "1", "enter")
        stage.app.post_message(events.Paste("by\nfeel"))
        await stage.pilot.pause()
        assert "by feel" in stage.words and screen.entry.cursor == 2

    assert on_stage(screen, story) == []


@pytest.mark.slow
def test_a_changed_answer_to_an_exclusion_is_shown_before_it_is_sent(on_stage):
    async def story(stage):
        await stage.press("1", "2", "enter", "2", "enter", "2", "enter", "enter")
        assert not stage.heard
        assert "Changed: 1 is “no”. If that is right, go to Continue once more." in stage.words
        await stage.press("down", "down", "down", "enter")

    assert on_stage(FormScreen(EXCLUSION), story) == [FormReply({"s1": "no", "s2": "no", "s3": "no"})]


@pytest.mark.slow
def test_a_question_mark_is_written_in_free_text_and_is_help_elsewhere(on_stage):
    screen = FormScreen(MIXED)

    async def story(stage):
        await stage.press("question_mark", "1", "enter", "1", "enter", "question_mark")

    assert on_stage(screen, story) == ["help"]
    assert screen.entry.field_entries[2].answer == "?"
