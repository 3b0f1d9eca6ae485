"""The tables of texts: whole, with the same braces, in their own language; and how they enter a protocol."""

import tomllib
from importlib.resources import files

import pytest

from protocols.document.dumping import dump_protocol
from protocols.document.hashing import hash_protocol
from protocols.document.loading import ProtocolError, load_protocol, protocol_from_values
from protocols.wording.english import ENGLISH, LANGUAGES, list_placeholders
from protocols.wording.english_facts import FACTS
from protocols.wording.english_forms import PROTOCOL_TEXTS
from protocols.wording.translation import find_table_problems, translate_protocol
from protocols.wording.words import ENGLISH_WORDS, Words

TRANSLATED = tuple(code for code in LANGUAGES if code != "en")
SAME = {
    "de": {"key_pause", "run_training", "direction", "pause_title", "line_which", "form_scale"},
    "es": {"direction", "end_both", "no", "form_scale", "protocol_no"},
}
"""Words that are the same in both languages."""
STUDIES = ("direction_threshold", "equalized_threshold", "direction_training")


def table_of(code):
    return tomllib.loads(files("protocols").joinpath("wording", f"{code}.toml").read_text("utf-8"))


def text_of(name):
    return files("protocols").joinpath(f"{name}.toml").read_text("utf-8")


@pytest.mark.parametrize("code", TRANSLATED)
def test_a_shipped_table_has_every_text_with_the_braces_of_the_english_one(code):
    assert find_table_problems(table_of(code), require_all=True) == ()


@pytest.mark.parametrize("code", TRANSLATED)
def test_no_text_of_a_shipped_table_is_still_english(code):
    assert {key for key, text in table_of(code).items() if text == ENGLISH[key]} == SAME[code]


@pytest.mark.parametrize("code", ["en", *TRANSLATED])
def test_choices_of_a_form_can_be_told_apart(code):
    words = Words({} if code == "en" else table_of(code))
    groups = (("yes", "no"), ("hearing_plugs", "hearing_muffs", "hearing_noise", "hearing_both", "hearing_nothing"),
              ("grip_pen", "grip_hand", "grip_tips", "grip_other"), ("hand_right", "hand_left"))  # fmt: skip
    for group in groups:
        assert len({words[key].casefold() for key in group}) == len(group)
    assert words["yes"][0].casefold() != words["no"][0].casefold()


@pytest.mark.parametrize(
    ("key", "text", "told"),
    [
        ("rest_titel", "Ruhe", "is no text of hapteq"),
        ("heading", "{run} {number} von {runs}", "each of {number} {run} {runs} {trial}, and no other"),
        ("rest_title", "Ruhe {share}", "no braces"),
        ("done", "{share!r}", "braces that are not in pairs or hold no plain name"),
        ("done", "{share", "braces that are not in pairs or hold no plain name"),
        ("rest_title", "", "is no text"),
        ("rest_title", 3, "is no text"),
    ],
)
def test_a_wrong_text_is_refused(key, text, told):
    (problem,) = find_table_problems({key: text}, require_all=False)
    assert told in str(problem)


def test_every_missing_key_is_named_with_its_english_text():
    table = table_of("de")
    del table["rest_title"], table["yes"]
    assert [problem.key for problem in find_table_problems(table, require_all=True)] == ["rest_title", "yes"]
    assert '"Rest"' in str(find_table_problems(table, require_all=True)[0])


def test_a_fact_is_recognised_and_its_parts_too():
    words = Words({key: f"<{text}>" for key, text in FACTS.items()})
    assert words.translate_fact("Direction 2") == "<Direction 2>"
    assert words.translate_fact("3 trials in a row were void, the last because the device stopped answering") == (
        "<3 trials in a row were void, the last because <the device stopped answering>>"
    )
    assert words.translate_fact("The set-up is not the protocol's: the device can be heard, the hand can be seen.") == (
        "<The set-up is not the protocol's: <the device can be heard>, <the hand can be seen>.>"
    )
    assert words.translate_fact("A probe is not used: too little.") == "A probe is not used: too little."


def test_a_text_whose_braces_do_not_fit_is_shown_in_english():
    assert Words({"done": "fertig {percent}"}).fill("done", {"share": 40}) == "40% of the session is done."


def test_all_braces_of_the_english_texts_are_names():
    assert [key for key, text in ENGLISH.items() if list_placeholders(text) is None] == []
    assert ENGLISH_WORDS.fill_count("runs_left", 1) == "1 run is left."
    assert ENGLISH_WORDS.fill_count("runs_left", 0) == "0 runs are left."


@pytest.mark.parametrize("name", STUDIES)
def test_every_sentence_of_a_shipped_study_is_in_the_tables(name):
    protocol = load_protocol(text_of(name), name)
    sentences = {protocol.title, protocol.setup.grip, *protocol.consent.statements, *protocol.consent.exclusions}
    for question in protocol.debrief:
        sentences |= {question.question, *question.choices}
    assert sentences <= set(PROTOCOL_TEXTS.values())


@pytest.mark.parametrize("code", TRANSLATED)
@pytest.mark.parametrize("name", STUDIES)
def test_a_study_in_another_language_is_the_same_study(name, code):
    values = tomllib.loads(text_of(name))
    english, other = (
        protocol_from_values(values, name),
        protocol_from_values(translate_protocol(values, table_of(code), code), name),
    )
    assert hash_protocol(english) != hash_protocol(other)
    assert not {other.title, *other.consent.statements, *other.consent.exclusions} & set(PROTOCOL_TEXTS.values())
    for asked, told in zip(english.debrief, other.debrief, strict=True):
        assert (told.key, told.codes) == (asked.key, asked.choices)
        assert told.question != asked.question
    for table in ("stimulus", "staircase", "safety", "limits", "practice", "demo", "probes", "schedule"):
        assert getattr(english, table) == getattr(other, table)
    assert load_protocol(dump_protocol(other), "a log") == other


def test_a_text_of_ones_own_wins_and_counts():
    values = {**tomllib.loads(text_of("direction_training")), "text": {"words": {"rest_title": "Kaffee"}}}
    own = protocol_from_values(translate_protocol(values, table_of("de"), "de"), "mine")
    assert own.text.words["rest_title"] == "Kaffee"
    assert own.text.words["pause_free"] == table_of("de")["pause_free"]
    plain = protocol_from_values(translate_protocol({**values, "text": {}}, table_of("de"), "de"), "mine")
    assert hash_protocol(own) != hash_protocol(plain)


def test_english_written_out_is_the_default():
    text = text_of("direction_training")
    assert hash_protocol(load_protocol(text + '\n[text]\nlanguage = "en"\n', "mine")) == hash_protocol(
        load_protocol(text, "mine")
    )


def test_a_language_without_its_texts_is_refused():
    with pytest.raises(ProtocolError) as refused:
        load_protocol(text_of("direction_training") + '\n[text]\nlanguage = "de"\n', "mine")
    assert refused.value.key == "text.language"


@pytest.mark.parametrize(
    ("question", "key"),
    [
        ('choices = ["a", "b"]\nnumber = [1, 2]', "choices"),
        ('choices = ["a", "b"]\ncodes = ["x"]', "codes"),
        ('choices = ["a", "a"]', "choices"),
        ("number = [5, 1]", "number"),
        ("number = [5]", "number"),
        ("scale = [1, 20]", "scale"),
        ("scale = [-1, 3]", "scale"),
        ('ends = ["low", "high"]', "ends"),
        ('scale = [1, 5]\nends = ["low"]', "ends"),
        ('unit = "years"', "unit"),
    ],
)
def test_a_question_of_two_kinds_or_none_is_refused(question, key):
    text = f'{text_of("direction_training")}\n[[before]]\nkey = "age"\nquestion = "How old?"\n{question}\n'
    with pytest.raises(ProtocolError) as refused:
        load_protocol(text, "mine")
    assert refused.value.key == f"before[1].{key}"


@pytest.mark.parametrize("word", ["Rückzug ", "Ru\u0308ckzug", "\tRÜCKZUG"])
def test_a_word_is_typed_in_any_case_with_blanks_and_either_encoding_of_its_accents(word):
    """A participant could not withdraw where the table had a blank after the word."""
    words = Words({"withdraw_word": word})
    assert words.is_typed("withdraw_word", "rückzug") and words.is_typed("withdraw_word", "ru\u0308ckzug ")
    assert not words.is_typed("withdraw_word", "ruckzug") and not words.is_typed("withdraw_word", "")


def test_a_table_with_one_text_for_yes_and_no_is_refused():
    (problem,) = find_table_problems({"no": "Yes "}, require_all=False)
    assert str(problem).startswith("no is the text of yes")
