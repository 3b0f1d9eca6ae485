import pytest

from study.session.form_views import Form, FormField, FormKind, FormReply
from study.tui.screens.form import FormScreen

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


def test_numbers_letters_and_the_space_bar_choose_and_enter_goes_on(filled):
    reply, _ = filled(THREE, "1", "enter", "y", "enter", "right", "right", "space", "enter", "enter")
    assert reply == FormReply({"s1": "yes", "s2": "yes", "s3": "no"})


def test_arrows_and_tab_go_from_question_to_question(filled):
    reply, _ = filled(THREE, "down", "2", "up", "1", "tab", "tab", "1", "down", "enter")
    assert reply == FormReply({"s1": "yes", "s2": "no", "s3": "yes"})


def test_what_is_missing_is_named_and_gets_the_focus(filled):
    reply, words = filled(THREE, "1", "down", "down", "down", "enter")
    assert reply is None
    assert "Please answer 2: “Statement 2, [as it is].” 1 more is open." in words
    reply, _ = filled(THREE, "1", "down", "down", "down", "enter", "n", "down", "n", "down", "enter")
    assert reply == FormReply({"s1": "yes", "s2": "no", "s3": "no"})


def test_two_and_more_gaps_are_counted(filled):
    assert "2 more are open." in filled(THREE, "down", "down", "down", "enter")[1]


def test_nothing_is_agreed_to_by_enter_alone_or_by_moving(filled):
    reply, words = filled(THREE, *["enter"] * 6)
    assert reply is None
    assert "3 of 3 still open" in words
    assert "3 of 3 still open" in filled(THREE, "right", "down", "left")[1]


def test_a_form_says_how_much_is_open_and_when_it_is_done(filled):
    assert "Consent: 2 of 3 still open" in filled(THREE, "1")[1]
    _, words = filled(THREE, "1", "enter", "1", "enter", "1")
    assert "everything is answered" in words and "Go down to Continue" in words


def test_version_and_ethics_id_are_shown(filled):
    assert "Version 2. Ethics approval EC 7." in filled(THREE)[1]


def test_many_choices_lie_below_each_other_and_are_walked_through(filled):
    keys = ["down", "down", "space", "down", "down", "down", "down"]
    _, words = filled(MIXED, *keys)
    assert "2 ● ear muffs" in words
    reply, _ = filled(MIXED, "3", "enter", "3", "enter", *"by feel", "enter", *"pen", "enter", "enter")
    assert reply.answers == {"hearing": "masking noise", "rating": "3", "strategy": "by feel", "grip": "pen"}


def test_a_digit_that_is_a_choice_means_that_choice_and_no_other(filled):
    assert "● 5" in filled(MIXED, "1", "enter", "5")[1]
    assert "●" not in filled(MIXED, "tab", "2")[1]


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
