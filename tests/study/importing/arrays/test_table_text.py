import numpy as np
import pytest

from study.importing.arrays.read_arrays import read_arrays
from study.importing.header_map import make_header_map
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError

ROWS = "\n".join(f"{k / 10},{k % 7},{k % 5}" for k in range(30))


def read(tmp_path, header, encoding, stated=""):
    path = tmp_path / "a.csv"
    path.write_bytes(f"{header}\n{ROWS}\n".encode(encoding))
    return read_arrays(path, CsvMap(encoding=stated))


@pytest.mark.parametrize(
    ("header", "encoding", "found"),
    [
        ("时间(s),载荷(N),位移(mm)", "gbk", "gb18030"),
        ("時間(s),荷重(N),変位(mm)", "shift_jis", "shift_jis"),
        ("時間(s),荷重(N),変位(mm)", "euc_jp", "euc_jp"),
        ("시간(s),하중(N),변위(mm)", "euc_kr", "euc_kr"),
        ("время(s),сила(N),перемещение(mm)", "cp1251", "cp1251"),
    ],
)
def test_a_header_in_an_encoding_of_its_language_is_read_and_understood(tmp_path, header, encoding, found):
    arrays = read(tmp_path, header, encoding)
    assert list(arrays.by_name) == header.split(",")
    assert arrays.notes == (f"Read in the encoding {found}, in which its words are understood.",)
    wanted = make_header_map(arrays)
    assert wanted is not None
    assert [channel.role for channel in wanted.channel] == ["command", "response"]


@pytest.mark.parametrize("header", ["time [µs],force größe [N],angle [°]", "t [s],force été [N],angle ±1 [deg]"])
def test_western_letters_need_no_word(tmp_path, header):
    assert list(read(tmp_path, header, "cp1252").by_name) == header.split(",")


def test_an_encoding_that_is_open_is_refused_with_its_readings_and_the_key_and_read_when_stated(tmp_path):
    header = "项目一(s),项目二(N),项目三(mm)"
    with pytest.raises(ImportRefusedError) as refused:
        read(tmp_path, header, "gbk")
    assert "gb18030: '项目一 项目二 项目三'" in refused.value.happened
    assert 'under [csv], encoding = "gb18030"' in refused.value.happened
    assert list(read(tmp_path, header, "gbk", "gb18030").by_name) == header.split(",")


def test_a_remark_in_another_encoding_does_not_matter(tmp_path):
    found = read(tmp_path, "# 项目一项目二\nt,u,v", "gbk").by_name
    np.testing.assert_array_equal(found["u"], np.arange(30) % 7)


def test_the_first_foreign_words_may_come_after_many_plain_lines(tmp_path):
    path = tmp_path / "a.csv"
    path.write_bytes(b"# plain remark\n" * 6000 + f"时间(s),载荷(N),位移(mm)\n{ROWS}\n".encode("gbk"))
    assert list(read_arrays(path, CsvMap()).by_name) == ["时间(s)", "载荷(N)", "位移(mm)"]


@pytest.mark.parametrize("ahead", ["", "t"])
def test_a_long_table_with_foreign_words_in_each_row_is_read(tmp_path, ahead):
    path = tmp_path / "a.csv"
    rows = "\n".join(f"{k / 10},{k % 7},{k % 5},正常运行" for k in range(6000))
    path.write_bytes(f"{ahead}时间(s),载荷(N),位移(mm),状态\n{rows}\n".encode("gbk"))
    assert "载荷(N)" in read_arrays(path, CsvMap()).by_name


@pytest.mark.parametrize(
    ("stated", "said"), [("klingon", "There is no encoding 'klingon'"), ("ascii", "no whole ascii")]
)
def test_an_encoding_that_cannot_be_is_named(tmp_path, stated, said):
    with pytest.raises(ImportRefusedError, match=said):
        read(tmp_path, "t,µ,v", "cp1252", stated)


@pytest.mark.parametrize(("encoding", "stated"), [("utf-8-sig", "utf-8"), ("utf-16", "utf-16-le")])
def test_a_byte_order_mark_is_no_part_of_a_name_where_the_encoding_is_stated(tmp_path, encoding, stated):
    assert list(read(tmp_path, "t,u,v", encoding, stated).by_name) == ["t", "u", "v"]
