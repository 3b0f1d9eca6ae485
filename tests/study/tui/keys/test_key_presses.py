from textual.events import Key

from study.tui.keys.key_presses import KeyPressDetector, get_arrival_time_s


def test_a_first_key_is_a_press():
    assert KeyPressDetector().record_event(1, 10.0, armed_s=9.0)


def test_a_key_that_repeats_within_a_fifth_of_a_second_is_held():
    presses = KeyPressDetector()
    presses.record_event(1, 10.0, armed_s=9.0)
    assert not any(presses.record_event(1, 10.0 + 0.1 * i, armed_s=9.0) for i in range(1, 20))


def test_any_other_answer_right_after_one_is_no_press_of_its_own():
    presses = KeyPressDetector()
    presses.record_event(1, 10.0, armed_s=9.0)
    assert not presses.record_event(2, 10.1, armed_s=10.05)


def test_the_first_repetition_comes_late_and_is_none_either():
    presses = KeyPressDetector()
    presses.record_event(1, 10.0, armed_s=9.0)
    assert not presses.record_event(1, 10.6, armed_s=10.4)
    assert presses.record_event(1, 11.4, armed_s=10.4)


def test_the_other_key_may_follow_sooner():
    presses = KeyPressDetector()
    presses.record_event(1, 10.0, armed_s=9.0)
    assert presses.record_event(2, 10.45, armed_s=10.4)


def test_a_stamp_in_the_future_is_replaced_by_now():
    key = Key("1", "1")
    stamped_s = key.time
    assert get_arrival_time_s(key) == stamped_s
    key.time = 1e12
    assert get_arrival_time_s(key) < 1e12


def test_a_key_that_waited_for_long_keeps_the_time_at_which_it_was_read():
    key = Key("1", "1")
    key.time -= 100.0
    assert get_arrival_time_s(key) == key.time
