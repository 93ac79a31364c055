"""CSV tables whose every mistake is told with file, row and column."""

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from vrdp_prob.errors import InputError


@dataclass(frozen=True)
class Row:
    """One row of a table: its cells by column name, and where it stands."""

    path: Path
    number: int
    cells: Mapping[str, str]

    @property
    def place(self) -> str:
        """File and row in words, the header being row 1."""
        return f"{self.path}, row {self.number}"

    def text(self, column: str) -> str:
        """Content of a cell that must not be empty."""
        value = self.optional_text(column)
        if value is None:
            raise InputError(f"{self.place}: '{column}' is empty; every row needs it.")
        return value

    def optional_text(self, column: str) -> str | None:
        """Content of a cell, None where the cell is empty or the table has no such column."""
        value = (self.cells.get(column) or "").strip()
        return value or None

    def number_in(self, column: str) -> float:
        """Finite number in a cell that must not be empty."""
        value = self.optional_number(column, "leave the row out where there is no measurement")
        if value is None:
            raise InputError(
                f"{self.place}: '{column}' is empty; give a number, or leave the row out if it is missing."
            )
        return value

    def optional_number(self, column: str, remedy: str = "leave the cell empty where it is not known") -> float | None:
        """Finite number in a cell, None where the cell is empty or the table has no such column.

        `remedy` is said of what is not finite.
        """
        text = self.optional_text(column)
        if text is None:
            return None
        try:
            value = float(text)
        except ValueError as error:
            raise InputError(f"{self.place}: '{column}' is '{text}'; give a number.") from error
        if not math.isfinite(value):
            raise InputError(f"{self.place}: '{column}' is '{text}'; {remedy}.")
        return value


def read_rows(path: Path, required: Sequence[str]) -> Iterator[Row]:
    """Rows of a CSV file with a header.

    Raises
    ------
    InputError
        If the file cannot be read, has no header, lacks a required column, or a row has too few cells.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file)
            header = [name.strip() for name in next(reader, [])]
            if not header:
                raise InputError(f"{path}: the file is empty; it needs a header with {', '.join(required)}.")
            missing = [name for name in required if name not in header]
            if missing:
                other = next((one for one in (";", "\t") if any(one in name for name in header)), None)
                remedy = "add to the header" if other is None else f"cells are parted by {other!r}, part them by commas"
                raise InputError(f"{path}: column{'s' * (len(missing) > 1)} {', '.join(missing)} missing; {remedy}.")
            if twice := [name for name in header if name and header.count(name) > 1]:
                raise InputError(f"{path}: the column {twice[0]} is there twice; keep one.")
            for cells in reader:
                if not any(cell.strip() for cell in cells):
                    continue
                if len(cells) != len(header):
                    raise InputError(
                        f"{path}, row {reader.line_num}: {len(cells)} cells where the header has {len(header)}; "
                        "mend the row."
                    )
                yield Row(path, reader.line_num, dict(zip(header, cells, strict=True)))
    except OSError as error:
        raise InputError(f"{path}: the file cannot be read ({error.strerror}); check the path.") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a CSV text file ({error}); save it as UTF-8 text.") from error
