"""Names of a live table's columns, which come again where its writer begins anew, perhaps in another order."""

from __future__ import annotations

from elusive.errors import DataError
from elusive.io.sources.cells import cells_of, mark_of


class Header:
    """Puts the cells of lines under the first header, whatever header came since.

    Parameters
    ----------
    text
        First line; one that holds a number names nothing, and all lines are passed on as they are.
    name
        Of the source, for the sentence.
    """

    def __init__(self, text: str, name: str) -> None:
        self._text, self._name = text, name
        self._mark = mark_of(text)
        cells = cells_of(text, self._mark)
        self._names = [] if any(map(is_number, cells)) else cells
        self._order: list[int] | None = None

    def placed(self, number: int, text: str) -> str | None:
        """Return a line as it would stand under the first header; None: it is a header itself.

        Raises
        ------
        DataError
            If the columns are others now.
        """
        if text == self._text:
            self._order = None
            return None
        cells = cells_of(text, self._mark)
        if len(set(cells) & set(self._names)) > 1:
            if sorted(cells) != sorted(self._names):
                raise DataError(
                    f"{self._name}, line {number}: the columns are {text!r:.80} from here on, and were "
                    f"{self._text!r:.80}; begin anew."
                )
            self._order = [cells.index(name) for name in self._names]
            return None
        if self._order is None or len(cells) != len(self._order):
            return text
        return (self._mark or " ").join(cells[k] for k in self._order)


def is_number(cell: str) -> bool:
    """Whether a cell reads as a number."""
    try:
        float(cell)
    except ValueError:
        return False
    return True
