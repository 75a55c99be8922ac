"""Finished rows of the atlas in one JSON file: each is saved as soon as it is found, and not found a second time."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from reojax.files import check_writable, write_json

Row = dict[str, Any]


class Store:
    """Rows by key, `question/robot/...`; whole file or none at any time."""

    def __init__(self, file: Path, settings: Row) -> None:
        """Read what there is.

        Args:
            file: the JSON file; made at the first row.
            settings: what the rows depend on besides their keys.

        Raises:
            ValueError: if the file is no atlas, or one of other settings, or cannot be written.
        """
        self.file, self.settings = check_writable(file), settings
        self.rows: dict[str, Row] = {}
        if not file.exists():
            return
        try:
            found = json.loads(file.read_text())
            rows, theirs = found["rows"], found["settings"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{str(file)!r} is no atlas of an earlier run: {error!r}. Move it away.") from error
        if theirs != settings:
            raise ValueError(
                f"{str(file)!r} was made with {theirs}, not {settings}: move it away, or use another --out."
            )
        self.rows = rows

    def row(self, key: str, find: Callable[[], Row]) -> Row:
        """The row of a key: the one that is there, or what `find` finds, which is saved at once."""
        if key not in self.rows:
            begun = time.process_time()
            found = find()
            self.rows[key] = found | {"cpu_s": round(time.process_time() - begun, 2)}
            write_json(self.file, {"settings": self.settings, "rows": self.rows})
        return self.rows[key]

    def under(self, question: str) -> dict[str, Row]:
        """Rows of a question, by the rest of their keys."""
        first = f"{question}/"
        return {key.removeprefix(first): row for key, row in self.rows.items() if key.startswith(first)}
