"""Names are the field's words, those of docs/glossary.md; no class name stands twice."""

from pathlib import Path

import pytest
import rule_book as rules
import word_rules
from rule_book import Source


def test_names_are_the_words_of_the_field() -> None:
    breaches = [b for source in rules.package_sources() for b in word_rules.word_breaches(source)]
    assert not breaches, "\n" + "\n".join(breaches)


def test_no_class_name_stands_twice() -> None:
    breaches = list(word_rules.doubled_classes(rules.package_sources()))
    assert not breaches, "\n" + "\n".join(breaches)


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("report/glances.py", "class Glance: ..."),
        ("slam/glance.py", ""),
        ("slam/a.py", "def _glance_of(): ..."),
        ("slam/a.py", "class A:\n    def strike(self): ..."),
        ("slam/a.py", "class Means: ..."),
        ("soup/a.py", ""),
        ("slam/rows.py", ""),
    ],
)
def test_a_name_that_is_not_the_fields_is_noticed(path: str, text: str, tmp_path: Path) -> None:
    """A file put into a copy of the package's tree, read as the rule reads the package."""
    file = tmp_path / path
    file.parent.mkdir(parents=True)
    file.write_text(text, encoding="utf-8")
    source = Source(path, file.read_text(encoding="utf-8"))
    assert list(word_rules.word_breaches(source))


@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("slam/a.py", "class LandmarkTable: ..."),
        ("slam/visible_rows.py", "def rows(): ..."),
        ("ris/bookkeeping.py", ""),
    ],
)
def test_the_fields_words_pass(path: str, text: str) -> None:
    assert not list(word_rules.word_breaches(Source(path, text)))


def test_a_class_name_that_stands_twice_is_noticed() -> None:
    first, second = Source("slam/a.py", "class Leg: ..."), Source("channel/b.py", "class Leg: ...")
    assert list(word_rules.doubled_classes([first, second]))
    assert not list(word_rules.doubled_classes([first, Source("report/c.py", "class Bone: ...")]))


def test_every_file_says_what_it_is_named_for() -> None:
    breaches = [b for source in rules.package_sources() for b in word_rules.subject_breaches(source)]
    assert not breaches, "\n" + "\n".join(breaches)
    assert list(word_rules.subject_breaches(Source("slam/prune.py", '"""Death of landmarks: those that fail."""')))
    assert not list(word_rules.subject_breaches(Source("slam/prune.py", '"""Pruning of landmarks."""')))


def test_every_word_has_one_that_stands_in_its_place() -> None:
    words = word_rules.listed("Not the field's words") | word_rules.listed("Not alone")
    assert len(words) > 40
    assert all(words.values())
    assert not any(good == bad for bad, good in words.items())
    banned = word_rules.listed("Not the field's words")
    assert not [good for good in words.values() if set(word_rules.words_of(good)) & set(banned)]
