"""Parsing of untrusted XML, which may mean harm: a tree without entities, declarations or references."""

from collections.abc import Iterator
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from rislam_rt.scene.findings import Fault, one_line

MAX_XML_BYTES = 50_000_000
"""Most bytes of an XML scene file; Sionna's largest city has 1 MB."""
MAX_DEPTH = 50
"""Most elements within each other in an XML scene file; a scene needs five."""
MAX_DEFAULTS = 1000
"""Most `<default>` elements of an XML scene file whose names are replaced by their values."""


def parse_xml(content: bytes) -> Element:
    """Parse an untrusted XML file into its root element, `$name` replaced by the values of its `<default>` elements.

    A document type is refused before any of it is read: entities, whether they grow without end or name files, are
    declared there and nowhere else.

    Raises
    ------
    Fault
        Not XML, or XML with a document type, or nested too deeply.
    """
    if len(content) > MAX_XML_BYTES:
        raise Fault(f"{len(content)} bytes are too many for a scene", f"keep it below {MAX_XML_BYTES}")
    root = _tree(content)
    defaults = {e.get("name", ""): e.get("value", "") for e in root.findall("default")[:MAX_DEFAULTS]}
    names = sorted(filter(None, defaults), key=len, reverse=True)  # so that `$name` is not taken for `$na`
    for element in root.iter() if names else ():
        for key, value in element.attrib.items():
            name = next((name for name in names if f"${name}" in value), None) if "$" in value else None
            if name is not None:  # replaced once
                element.attrib[key] = value.replace(f"${name}", defaults[name])
    return root


def children(element: Element, *tags: str) -> Iterator[Element]:
    """Direct children of an XML element with one of the tags, in order."""
    return (child for child in element if child.tag in tags)


def _tree(content: bytes) -> Element:
    """Parse untrusted XML into a tree, without types, entities and depths that could do harm."""
    builder, parser = TreeBuilder(), expat.ParserCreate()
    depth = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            raise Fault(f"more than {MAX_DEPTH} elements within each other", "export the scene again")
        builder.start(tag, attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag)

    def refuse(name: str, *_: object) -> None:
        raise Fault(f"a document type '{one_line(name)[:40]}'", "delete the line <!DOCTYPE ...>: a scene needs none")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.StartDoctypeDeclHandler = refuse
    parser.buffer_text = True
    try:
        parser.Parse(content, True)
        return builder.close()
    except expat.ExpatError as error:
        raise Fault(f"not XML: {one_line(str(error))[:80]}", "give a Mitsuba or Sionna scene file") from None
    except (ValueError, LookupError) as error:  # an encoding that nobody knows
        raise Fault(f"not readable XML ({one_line(str(error))[:60]})", "save it in UTF-8") from None
