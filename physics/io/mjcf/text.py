"""Parser of MJCF texts: XML elements that know their lines, and errors that name them."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from xml.parsers import expat


class Element(ET.Element):
    """XML element with `line`, the number of the line on which it starts."""

    line = 0


class ModelError(ValueError):
    """Error about an element that a scene cannot hold.

    Parameters
    ----------
    message : str
        Message of the error.
    line : int
        Line of the element; 0 if unknown.
    """

    def __init__(self, message: str, line: int = 0):
        super().__init__(message)
        self.line = line

    @property
    def place(self) -> str:
        """Line of the element in words, as "line 3"; "" if unknown."""
        return f"line {self.line}" if self.line else ""


def parse(text: str) -> Element:
    """Parse an MJCF text; return its root element.

    Raises
    ------
    ValueError
        The text is no XML, or has a document type. A document type declares entities, which could grow without bound,
        or name other files.
    """
    parser = expat.ParserCreate("utf-8")
    builder = ET.TreeBuilder(element_factory=Element)

    def start(tag: str, attributes: dict[str, str]) -> None:
        builder.start(tag, attributes).line = parser.CurrentLineNumber

    parser.StartElementHandler = start
    parser.EndElementHandler = builder.end
    parser.StartDoctypeDeclHandler = _refuse_doctype
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        raise ValueError(f"{error}; allowed is XML") from None
    return builder.close()


def _refuse_doctype(name: str, *_: object) -> None:
    raise ValueError(f"<!DOCTYPE {name}> is not read; allowed is MJCF without it")


def label(tag: str, name: str | None) -> str:
    """Label of an element in messages, with its name if it has one: ``<geom 'floor'>``."""
    return f"<{tag} {name!r}>" if name else f"<{tag}>"
