"""What is written as TOML is read back the same, whatever stands in it."""

import math

from hypothesis import given
from hypothesis import strategies as st

from rislam_rt.toml import parse_toml, toml_bytes

TEXT = st.text(st.characters(blacklist_categories=("Cs",)), max_size=20)
WHOLE = st.integers(-(2**63), 2**63 - 1)
SCALARS = TEXT | WHOLE | st.booleans() | st.floats(allow_nan=False)
VALUES = SCALARS | st.lists(SCALARS, max_size=3) | st.dictionaries(TEXT, SCALARS, max_size=3)
TABLES = st.dictionaries(TEXT, VALUES, max_size=4)


@given(st.dictionaries(TEXT, VALUES | TABLES | st.lists(TABLES, min_size=1, max_size=2), max_size=5))
def test_it_reads_back_equal(table):
    assert parse_toml(toml_bytes(table).decode()) == table


def test_quotes_newlines_and_what_is_no_number():
    table = {"description": 'the "demo"\nof 3\' \\ "" and """ \x7f\x00', "x": math.inf, "y": 1e-300, "n": 7}
    assert parse_toml(toml_bytes(table).decode()) == table
    assert math.isnan(parse_toml(toml_bytes({"x": math.nan}).decode())["x"])


def test_a_byte_order_mark_does_no_harm():
    assert parse_toml("\ufeffname = 'a'") == {"name": "a"}
