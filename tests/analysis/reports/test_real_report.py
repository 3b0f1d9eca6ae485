import pytest

from analysis.reports.real_report import UnusableInput, render_real_report


@pytest.mark.parametrize("count", [1, 2])
def test_the_page_counts_what_could_not_be_used_in_sentences_for_any_number(count):
    unusable = [UnusableInput(f"rig{number}", "It holds no recording.") for number in range(count)]
    html = render_real_report([], unusable, [], {}, {}, "now")
    assert f"Folders or files that could not be used: {count}. The reasons are below." in html
    assert "Recordings of real devices that were compared with simple models: 0." in html
