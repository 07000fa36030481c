"""Lines of tables and keys in the text of a scene file, for errors.

The TOML reader returns values without lines, so lines are searched in the text. A table such as [[bodies]] is found by
its header, and a key between this header and the next one. Errors in inline tables, ``bodies = [{...}]``, name the line
of the list.
"""

from __future__ import annotations

import re

# Header of a table; a row of numbers in an array of several lines does not match.
HEADER = re.compile(r"\s*\[\[?\s*[A-Za-z_\"'][^,]*\]\s*(#.*)?$")


class Places:
    """Places in a scene's plain data, for errors: the names of lists and tables, and indices.

    Parameters
    ----------
    source : str
        Name of the data in messages; "": messages do not name it.
    """

    def __init__(self, source: str = ""):
        self._source = source

    def error(self, name: str | None, index: int, key: str | None, message: str) -> ValueError:
        """Make an error about a key of the table number `index` of the list `name`, or of the head (None)."""
        return self._told(message if name is None else f"{name}[{index}]: {message}")

    def error_in_table(self, name: str, key: str | None, message: str) -> ValueError:
        """Make an error about a key of the table `name`, such as ``environment.goal``, or about the table."""
        return self._told(f"{name}: {message}")

    def error_of_scene(self, lists: dict[str, list], message: str) -> ValueError:
        """Make an error about the whole scene."""
        return self._told(message)

    def _told(self, message: str) -> ValueError:
        return ValueError(f"{self._source}: {message}" if self._source else message)


class SourceLines(Places):
    """Text of a scene file in which errors find their lines.

    Parameters
    ----------
    text : str
        Text of the file.
    source : str
        Name of the file in messages.
    """

    def __init__(self, text: str, source: str):
        super().__init__(source)
        self._lines = text.splitlines()

    def error(self, name: str | None, index: int, key: str | None, message: str) -> ValueError:
        """Make an error about a key of the table [[name]] number `index`; `name` None: of the head of the file.

        `key` None makes an error about the whole table.
        """
        start = self._table_line(name, index)
        if name is not None and not start:
            line = self._key_line(0, name) or 1
        else:
            line = self._key_line(start, key) or start or 1
        place = "" if name is None else f"{name}[{index}]: "
        return ValueError(f"{self._source}, line {line}: {place}{message}")

    def error_in_table(self, name: str, key: str | None, message: str) -> ValueError:
        """Make an error about a key of the table [name], such as ``environment.goal``; `key` None: about the table."""
        return ValueError(f"{self._source}, line {self._line_in_table(name, key)}: {name}: {message}")

    def _line_in_table(self, name: str, key: str | None) -> int:
        """Line of a key in the table [name], or of the table around it where that is written inline."""
        parts = [*name.split("."), key]
        for depth in range(len(parts) - 1, 0, -1):
            dotted = r"\s*\.\s*".join(rf"[\"']?{re.escape(part)}[\"']?" for part in parts[:depth])
            header = re.compile(rf"\s*\[\s*{dotted}\s*\]")
            found = [k for k, line in enumerate(self._lines, 1) if header.match(line)]
            if found:
                return self._key_line(found[0], parts[depth]) or found[0]
        return self._key_line(0, parts[0]) or 1

    def error_of_scene(self, lists: dict[str, list], message: str) -> ValueError:
        """Make an error from a message about a whole scene, with the line of the table that the message names.

        The message names a table by its number, as in ``bodies[2]``, or by the class of an effect. `lists` holds the
        scene's bodies, walls and effects.
        """
        told = re.search(r"\b(bodies|walls|effects|sensors)\[(\d+)\]", message)
        if told:
            return self._error_at(told.group(1), int(told.group(2)), message)
        names = [type(effect).__name__ for effect in lists["effects"]]
        found = [(place.start(), name) for name in names if (place := re.search(rf"\b{name}\b", message))]
        if found:
            last = len(names) - 1 - names[::-1].index(min(found)[1])
            return self._error_at("effects", last, message)
        return self._told(message)

    def _error_at(self, name: str, index: int, message: str) -> ValueError:
        line = self._table_line(name, index) or self._key_line(0, name) or 1
        return ValueError(f"{self._source}, line {line}: {message}")

    def _table_line(self, name: str | None, index: int) -> int:
        """Line of the header of table number `index` of the list [[name]]; 0 for the file's head and inline tables."""
        if name is None:
            return 0
        header = re.compile(rf"\s*\[\[\s*[\"']?{name}[\"']?\s*\]\]")
        found = [k for k, line in enumerate(self._lines, 1) if header.match(line)]
        return found[index] if index < len(found) else 0

    def _key_line(self, start: int, key: str | None) -> int | None:
        """Line of a key of the table whose header is on line `start` (0: of any table); None if it is not found."""
        if key is None:
            return None
        wanted = re.compile(rf"\s*(\[\[?\s*)?[\"']?{re.escape(key)}[\"']?\s*[.=\]]")
        for k, line in enumerate(self._lines[start:], start + 1):
            if wanted.match(line):
                return k
            if start and HEADER.match(line):
                return None
        return None
