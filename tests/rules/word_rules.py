"""The words of the glossary, and where in the package a name is not one of the field's."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator

from rule_book import ROOT, Source

GLOSSARY = ROOT / "docs" / "glossary.md"


def listed(section: str, text: str | None = None) -> dict[str, str]:
    """Words of a section's table and what stands in their place."""
    page = GLOSSARY.read_text(encoding="utf-8") if text is None else text
    body = page.partition(f"\n## {section}\n")[2].partition("\n## ")[0]
    rows = [line.strip("|").split("|") for line in body.splitlines() if line.startswith("|")][2:]
    return {word.strip(): good.strip() for words, good in rows for word in words.split(",")}


def words_of(name: str) -> list[str]:
    """The words of an identifier in lower case: `_PathTruth` and `path_truth` are `path`, `truth`."""
    return [word.lower() for word in re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+", name)]


def names_of(source: Source) -> Iterator[tuple[str, str, bool]]:
    """Place, name, and whether the name is one of a class or a file."""
    for part in source.path.removesuffix(".py").split("/"):
        yield source.path, part, True
    for node in ast.walk(source.tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield f"{source.path}:{node.lineno}", node.name, isinstance(node, ast.ClassDef)


def word_breaches(source: Source) -> Iterator[str]:
    """Names with a word that is not the field's."""
    parts, wholes = listed("Not the field's words"), listed("Not alone")
    for place, name, is_whole in names_of(source):
        words = words_of(name)
        for word in words:
            if word in parts:
                yield f"{place}: '{name}': say {parts[word]} (docs/glossary.md)"
        if is_whole and words and "_".join(words) in wholes:
            yield f"{place}: '{name}' alone: say {wholes['_'.join(words)]} (docs/glossary.md)"


def doubled_classes(sources: Iterable[Source]) -> Iterator[str]:
    """Class names that stand twice."""
    places = defaultdict(list)
    for source in sources:
        for node in ast.walk(source.tree):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                places[node.name].append(source.path)
    for name, files in places.items():
        if len(files) > 1:
            yield f"class {name} stands in {', '.join(files)}"


def subject_breaches(source: Source) -> Iterator[str]:
    """Whether the first lines of a file's docstring lack the words of its name: what a reader looks for by."""
    stem = source.path.rpartition("/")[2].removesuffix(".py")
    said = re.findall(r"[a-z]+", (ast.get_docstring(source.tree) or "").partition("\n\n")[0].lower())
    words = [word for word in words_of(stem) if word.isalpha()]
    alike = (word.startswith(one[:4]) or (len(word) > 2 and one.startswith(word)) for word in said for one in words)
    if not stem.startswith("__") and words and not any(alike):
        yield f"{source.path}: its docstring's first line says nothing of '{stem}'; name what the file is about"
