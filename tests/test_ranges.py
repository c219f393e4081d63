"""Ranges of settings, said by the types of a record's fields."""

from dataclasses import dataclass
from typing import Annotated, Literal

import pytest
from annotated_types import Ge, Lt

from rislam_rt.errors import ConfigError, SceneError
from rislam_rt.ranges import Count, Positive, check_ranges


@dataclass(frozen=True)
class Record:
    kind: Literal["one", "other"] = "one"
    size: Positive | None = None
    share: Annotated[float, Ge(0.0), Lt(1.0)] = 0.0
    number: Count = 1
    free: float = -1.0

    def __post_init__(self) -> None:
        check_ranges("record", self)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("kind", "none", "record.kind: 'none' received; give one of one, other"),
        ("size", 0.0, "record.size: 0.0 received; give more than 0"),
        ("size", float("inf"), "record.size: inf received; give more than 0"),
        ("share", 1.0, "record.share: 1.0 received; give at least 0 and less than 1"),
        ("share", float("nan"), "record.share: nan received; give at least 0 and less than 1"),
        ("number", 0, "record.number: 0 received; give at least 1"),
        ("size", "10e9", "record.size: '10e9' received; give a number"),
    ],
)
def test_what_is_out_of_range_is_refused(name, value, said):
    with pytest.raises(ConfigError) as refused:
        Record(**{name: value})
    assert str(refused.value) == said


def test_what_is_in_range_or_left_out_passes():
    Record(kind="other", size=1e-9, share=0.999, number=10**9)
    Record()


def test_the_error_is_the_caller_s():
    record = Record()
    object.__setattr__(record, "number", 0)
    with pytest.raises(SceneError, match=r"scene\.number"):
        check_ranges("scene", record, SceneError)
