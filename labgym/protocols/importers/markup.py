"""XML from strangers: no document types, so no entities to expand; bounded in size, depth and number of elements."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from labgym.errors import DocumentError

MAX_BYTES = 8 * 1024**2
MAX_DEPTH = 40
MAX_ELEMENTS = 20_000


def read_xml(path: Path) -> Element:
    """Return the root element of a file.

    Raises:
        DocumentError: missing, too large, not XML, too deep, or with a document type definition.
    """
    try:
        with path.open("rb") as stream:
            content = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise DocumentError(path, "", f"cannot be read ({error.strerror or type(error).__name__})") from None
    if len(content) > MAX_BYTES:
        raise DocumentError(path, "", f"larger than {MAX_BYTES} bytes")
    return _Reader(path).read(content)


class _Reader:
    def __init__(self, path: Path) -> None:
        self.path, self.depth, self.elements = path, 0, 0
        self.tree = TreeBuilder()

    def read(self, content: bytes) -> Element:
        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = self._refuse
        parser.EntityDeclHandler = self._refuse
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parser.CharacterDataHandler = self.tree.data
        try:
            parser.Parse(content, True)
        except expat.ExpatError as error:
            problem = f"not XML, line {error.lineno}: {expat.ErrorString(error.code)}"
            raise DocumentError(self.path, "", problem) from None
        except (LookupError, UnicodeError):
            raise DocumentError(self.path, "", "written in an encoding that is not known") from None
        return self.tree.close()

    def _refuse(self, *_: object) -> None:
        raise DocumentError(self.path, "", "has a document type definition, which could expand without end; remove it")

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        self.elements += 1
        if self.depth > MAX_DEPTH or self.elements > MAX_ELEMENTS:
            problem = f"more than {MAX_DEPTH} levels deep or {MAX_ELEMENTS} elements long"
            raise DocumentError(self.path, "", problem)
        self.tree.start(tag, attributes)

    def _end(self, tag: str) -> None:
        self.depth -= 1
        self.tree.end(tag)
