"""The decimal sign of a table and the sign between its thousands, from all of its numbers.

``1.000`` alone may be 1 or 1000; ``0.3``, ``2.5e3``, ``1,234.5`` and ``1.234.567`` tell which sign
is which, and one such number tells it for the whole table.
"""

import re
from collections.abc import Iterable
from typing import Literal, NamedTuple

from mumacro.inputs.decoding import TextError

Decimal = Literal[".", ",", ""]
#: what may stand between thousands, by the name that an option has
THOUSANDS = {".": ".", ",": ",", "space": " ", "'": "'", "none": ""}
_BLANKS = re.compile("[ \u00a0\u2009\u202f]")
_DIGITS = re.compile(r"\s*[+\-−]?([\d.,]*)(?:[ '’\u00a0\u2009\u202f]\d{3})*([.,]\d+)?([eEdD])?")
_NUMBER = re.compile(r"\d[\d.,]*")
_GROUPED = re.compile(r"[1-9]\d{0,2}([.,])\d{3}(?:\1\d{3})*")


class Cell(NamedTuple):
    """A cell and its place."""

    line: int
    name: str
    text: str


def evidence(cell: str) -> tuple[Decimal, bool]:
    """Return the decimal sign that a number shows, and whether that is sure; "" where it shows
    none.

    >>> evidence("0,3"), evidence("1.000"), evidence("1.000.000"), evidence("7")
    ((',', True), ('.', False), (',', True), ('', False))
    """
    match = _DIGITS.match(cell.partition("..")[0])
    if match is None or cell.startswith("#", match.end()):  # 1.#QNAN
        return "", False
    digits = match[1] + (match[2] or "")
    if not digits.strip(".,"):
        return "", False
    sign: Decimal = "." if digits.rfind(".") > digits.rfind(",") else ","
    other: Decimal = "," if sign == "." else "."
    if sign not in digits:
        return "", False
    has_thousands = not match[2] and _GROUPED.fullmatch(digits)
    if digits.count(sign) > 1:
        return (other, True) if has_thousands else ("", False)
    return sign, not has_thousands or other in digits or match[3] is not None


class Signs:
    """What the numbers of a table tell about its decimal sign, as far as they were seen.

    ``decimal`` and ``thousands`` are those given, or None; :attr:`decimal` stays empty while no
    number has a sign.  Where commas separate the cells, a point is the decimal sign, unless another
    number shows that it is not.
    """

    def __init__(
        self, decimal: str | None, thousands: str | None, sep: str = "", dashes: str = "--"
    ) -> None:
        self.decimal, self.thousands = decimal or "", thousands
        if not decimal and thousands in (".", ","):
            self.decimal = "," if thousands == "." else "."
        if self.decimal and self.decimal == thousands:
            options = f"{dashes}decimal and {dashes}thousands"
            raise TextError(f"{options} are both {thousands!r}; give one of them")
        self._sep, self._dashes = sep, dashes
        self.grouped = ""  #: the sign between thousands, once a number has shown it
        self._cells: dict[tuple[Decimal, bool], Cell] = {}

    def see(self, cells: Iterable[Cell]) -> None:
        """Look at numbers, to know what their signs are.

        TextError where they contradict each other, or may be read in two ways.
        """
        cells_by_sign = self._cells
        for cell in cells:
            if "." in cell.text or "," in cell.text:
                sign, sure = evidence(cell.text)
                sure = sure or self.thousands is not None  # which is neither of the two here
                if sign:
                    cells_by_sign.setdefault((sign, sure), cell)
        if not self.decimal:
            surely = [sign for sign in (".", ",") if (sign, True) in cells_by_sign]
            if len(surely) == 2:
                raise self._contradiction(cells_by_sign[".", True], cells_by_sign[",", True])
            if not surely and self._sep == "," and (".", False) in cells_by_sign:
                surely = ["."]
            if not surely and cells_by_sign:
                raise self._ambiguity(*cells_by_sign.values())
            self.decimal = surely[0] if surely else ""
        other: Decimal = "," if self.decimal == "." else "."
        if self.decimal and (other, False) in cells_by_sign:
            self.grouped = other

    def _contradiction(self, point: Cell, comma: Cell) -> TextError:
        first, second = sorted((point, comma))
        words = {point: "a decimal point", comma: "a decimal comma"}
        return TextError(
            f"line {first.line}: {first.name} {first.text.strip()[:40]!r} has {words[first]}, line "
            f"{second.line}: {second.name} {second.text.strip()[:40]!r} {words[second]}: write "
            f"them alike, or give {self._dashes}decimal"
        )

    def _ambiguity(self, cell: Cell, *_others: Cell) -> TextError:
        sign, _ = evidence(cell.text)
        other = "," if sign == "." else "."
        match = _NUMBER.search(cell.text)
        digits = match[0] if match else cell.text
        part, whole = f"{float(digits.replace(sign, '.')):g}", digits.replace(sign, "")
        option = f"{self._dashes}decimal"
        return TextError(
            f"line {cell.line}: {cell.name} {cell.text.strip()[:40]!r} may be {part} or {whole}: "
            f"give {option} {sign} ({part}) or {option} {other} ({whole})"
        )

    def check(self, text: str) -> None:
        """Raise ValueError where a cell has a sign that is neither the given thousands sign nor the
        decimal sign."""
        if self.thousands is None:
            return
        text = _BLANKS.sub(" ", text.replace("’", "'"))
        for sign, name in ((".", "point"), (",", "comma")):
            if sign in text and sign not in (self.decimal, self.thousands) and ".." not in text:
                raise ValueError(
                    f"has a {name}, which is neither the decimal separator nor between thousands"
                )

    def with_points(self, text: str) -> str:
        """Return a text whose numbers have decimal points and no other signs; ValueError where a
        sign is neither the decimal one nor between thousands."""
        if not self.decimal:
            return text
        return "..".join(_NUMBER.sub(self._with_point, part) for part in text.split(".."))

    def _with_point(self, match: re.Match[str]) -> str:
        other = "," if self.decimal == "." else "."
        whole, sign, rest = match[0].partition(self.decimal)
        if other in rest or (other in whole and not _GROUPED.fullmatch(whole)):
            raise ValueError(f"must be a number such as 0{self.decimal}5")
        return whole.replace(other, "") + "." * bool(sign) + rest
