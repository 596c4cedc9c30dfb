"""Reading of untrusted XML: no document type definitions, bounded size, depth and number of elements."""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers import expat

from labgym.documents import read_bytes
from labgym.errors import DocumentError

MAX_BYTES = 8 * 1024**2
MAX_DEPTH = 40
MAX_ELEMENTS = 20_000


def read_xml(path: Path) -> Element:
    """Return the root element of a file.

    Raises:
        DocumentError: the file is missing, too large, not XML, nested too deeply, in an unsupported encoding, or has a
            document type definition.
    """
    return _Reader(path).read(read_bytes(path, MAX_BYTES))


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
        except DocumentError:
            raise
        except (LookupError, ValueError):
            # expat raises ValueError for multi-byte encodings such as gb18030 and shift_jis.
            raise DocumentError(self.path, "", "in an encoding that is not supported; save it as UTF-8") from None
        return self.tree.close()

    def _refuse(self, *_: object) -> None:
        raise DocumentError(self.path, "", "has a document type definition, which is not allowed; remove it")

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
