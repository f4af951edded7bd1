"""XML from users as a tree of elements, parsed by expat with counting handlers.

Prefixes of names stay as written, declared or not, since URDF has no namespaces. A document type is
refused: this excludes entity expansion and external references.
"""

from __future__ import annotations

from collections.abc import Mapping
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from joulepath.models.uploads.limits import LIMITS, Checkpoint, UnreadableFile, unwatched


def xml_tree(
    text: str, checkpoint: Checkpoint = unwatched, most: int = LIMITS.xml_bytes
) -> Element:
    """The root element of an XML document. Raises UnreadableFile, also beyond `most` bytes and
    LIMITS.
    """
    counted = _Counted()
    try:
        # Expat needs the declaration first; some exporters write an empty line before it.
        data = text.lstrip().encode()
        if len(data) > most:
            raise UnreadableFile(f"has more than {most >> 20} MiB.")
        for begin in range(0, len(data), LIMITS.xml_piece):
            checkpoint()
            counted.parser.Parse(data[begin : begin + LIMITS.xml_piece], False)
        counted.parser.Parse(b"", True)
    except (expat.ExpatError, UnicodeEncodeError) as error:
        raise UnreadableFile(f"is not XML: {error}.") from None
    return counted.tree.close()


class _Counted:
    """A tree-building parser; it raises UnreadableFile as soon as a document exceeds LIMITS."""

    def __init__(self) -> None:
        self.tree = TreeBuilder()
        self._depth = self._nodes = 0
        # The text has been decoded already, whatever encoding the document declares.
        self.parser = expat.ParserCreate("utf-8")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self.tree.data
        self.parser.CommentHandler = lambda _: self._count()
        self.parser.ProcessingInstructionHandler = lambda *_: self._count()
        self.parser.StartDoctypeDeclHandler = _refuse_document_type

    def _start(self, tag: str, attributes: Mapping[str, str]) -> None:
        self._count()
        self._depth += 1
        if self._depth > LIMITS.xml_depth:
            raise UnreadableFile(f"has elements on more than {LIMITS.xml_depth} levels.")
        if len(attributes) > LIMITS.xml_attributes:
            raise UnreadableFile(
                f"has an element with more than {LIMITS.xml_attributes} attributes."
            )
        self.tree.start(tag, dict(attributes))

    def _end(self, tag: str) -> None:
        self._depth -= 1
        self.tree.end(tag)

    def _count(self) -> None:
        self._nodes += 1
        if self._nodes > LIMITS.xml_nodes:
            raise UnreadableFile(f"has more than {LIMITS.xml_nodes} elements and comments.")


def _refuse_document_type(*_: object) -> None:
    raise UnreadableFile("has a document type: leave it out.")
