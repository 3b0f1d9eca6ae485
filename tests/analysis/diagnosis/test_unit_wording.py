import pytest

from analysis.diagnosis.unit_wording import choose_scale, format_percent, format_share, format_value


@pytest.mark.parametrize(
    ("value", "unit", "interval", "text"),
    [
        (0.21, "N", (0.20, 0.22), "0.21 N [0.20, 0.22]"),
        (0.211, "N", (0.19, 0.23), "0.21 N [0.19, 0.23]"),
        (54.3e-6, "m", (49e-6, 60e-6), "54 µm [49, 60]"),
        (0.012, "m", None, "12.0 mm"),
        (0.00136, "s", None, "1.36 ms"),
        (0.051, "kg", (0.047, 0.055), "51 g [47, 55]"),
        (2.5e-6, "kg m^2", None, "25.0 g cm²"),
        (1.7886e-3, "kg m^2", None, "17.9 kg cm²"),
        (0.1, "kg m^2", None, "0.100 kg m²"),
        (1.79, "kg m^2", (1.7, 1.88), "1.79 kg m² [1.70, 1.88]"),
        (-2.94e-5, "s^2 rad/rad", None, "−2.94e−05 s² rad/rad"),
        (3.1e-7, "m^2/s^3", None, "3.1e−07 m²/s³"),
        (2.0e5, "V^2", None, "200000 V²"),
        (3.1e-4, "N/m^3", None, "310 µN/m³"),
        (604132.5, "N/m^3", (5.9e5, 6.2e5), "604 kN/m³ [590, 620]"),
        (134.84, "N/m", None, "135 N/m"),
        (43.34, "Hz", (43.1, 43.6), "43.3 Hz [43.1, 43.6]"),
        (8.677, "deg", (8.5, 8.9), "8.7° [8.5, 8.9]"),
        (-0.034, "N", (-0.05, -0.01), "−0.03 N [−0.05, −0.01]"),
        (22.17, "ppm", (21.0, 23.0), "22 ppm [21, 23]"),
        (1.07, "1", (1.06, 1.08), "1.07 [1.06, 1.08]"),
        (0.0, "N", None, "0.00 N"),
        (2.8, "N s/m", None, "2.80 N s/m"),
        (0.001, "1/(m/s^2)^2", None, "0.00100 per (m/s²)²"),
    ],
)
def test_values_are_written_as_people_write_them(value, unit, interval, text):
    assert format_value(value, unit, interval) == text


def test_an_interval_that_is_a_point_takes_three_digits():
    assert format_value(0.21, "N", (0.21, 0.21)) == "0.210 N [0.210, 0.210]"


def test_a_share_is_read_as_per_cent_with_its_interval():
    assert format_percent(0.3, (0.25, 0.35)) == "30 % [25, 35]"
    assert format_percent(0.02) == "2.00 %"


def test_a_share_has_two_digits_and_no_powers_of_ten():
    assert [format_share(each) for each in (0.0123, 0.4, 0.994, 0.999, 1.0, 25.4)] == [
        "1.2 %", "40 %", "99 %", "100 %", "100 %", "2540 %",
    ]  # fmt: skip


def test_a_scale_takes_a_value_there_and_back():
    scale = choose_scale("m", 54e-6)
    assert (54e-6 * scale.factor, scale.unit) == (pytest.approx(54.0), "µm")


@pytest.mark.parametrize("unit", ["m", "N", "kg", "s"])
def test_what_is_not_a_number_has_no_prefix(unit):
    assert choose_scale(unit, float("nan")).factor == 1.0
