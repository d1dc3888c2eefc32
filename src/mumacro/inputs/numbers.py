"""Read numbers as people and instruments write them: decimal point or comma, thousands separators,
Fortran's exponent, powers of ten."""

import functools
import re
import unicodedata

#: other characters with the same meaning: minus and dashes of typography, a slash, apostrophes
_SIGNS = str.maketrans("−–‐‑∕⁄’", "----//'")
_SUPERSCRIPTS = dict(zip("⁰¹²³⁴⁵⁶⁷⁸⁹⁺⁻", "0123456789+-", strict=True))
#: a number at the start of a text: digits with separators between them, an exponent
NUMBER = re.compile(
    r"[+-]?(?:\d[\d.,']*|[.,]\d+)(?:(?: \d{3}(?!\d))+(?:[.,]\d+)?)?(?:[eEdD][+-]?\d+)?", re.ASCII
)
_PLAIN = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eEdD][+-]?\d+)?", re.ASCII)
_WORDS = re.compile(r"[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
_POWER = re.compile(r" ?[x×*·⋅] ?10\^?([+-]?\d{1,3})", re.ASCII)
_RAISED = re.compile(r"(?<=10)\^[+-]?\d{1,3}", re.ASCII)
_TEN = re.compile(r"([+-]?)10\^([+-]?\d{1,3})", re.ASCII)
# digits in groups of three after one separator
_GROUPS = re.compile(r"\d{1,3}([.,' ])\d{3}(?:\1\d{3})*", re.ASCII)
TOO_LARGE = "is too large, above 1.8e308"


def tidy(text: str) -> str:
    """Return a text with one character for each meaning, and single blanks.

    Full-width characters, such as ２ and ㎛, become ordinary ones; invisible characters are left
    out.

    >>> tidy(" −1,5 × 10⁻⁶ "), tidy("1.5*10**-6"), tidy("２．５ ㎛")
    ('-1,5 × 10^-6', '1.5*10^-6', '2.5 μm')
    """
    text = text.replace("**", "^")
    if text.isascii():
        return " ".join(text.split())
    in_superscript, out = False, []
    for sign in text:
        if sign in _SUPERSCRIPTS:
            out.append("" if in_superscript else "^")
            in_superscript = True
        else:
            in_superscript = False
        out.append(_plain(sign))
    return " ".join("".join(out).translate(_SIGNS).split())


@functools.cache
def _plain(sign: str) -> str:
    """Return the ordinary form of a character, or nothing for an invisible one.  A fraction such as
    ½ and an index are kept, because they are not digits."""
    if sign in _SUPERSCRIPTS:
        return _SUPERSCRIPTS[sign]
    if unicodedata.category(sign) == "Cf":
        return ""
    if unicodedata.decomposition(sign).startswith(("<fraction>", "<sub>")):
        return sign
    return unicodedata.normalize("NFKC", sign)


def is_number(text: str) -> bool:
    """Return whether a text is a number as a program writes it, such as ``-1.5e3``, ``nan`` or
    ``inf``."""
    return bool(_PLAIN.fullmatch(text) or _WORDS.fullmatch(text))


def read_number(text: str, decimal: str = "") -> float:
    """Return the number in a text.  Raise ValueError with the reason if it is not a number, or may
    mean two numbers.

    ``decimal`` is the decimal separator, if it is known.  Otherwise it is the point, or a comma
    that cannot be a thousands separator.

    >>> read_number("1.0D-3"), read_number("2,5"), read_number("1,234.5"), read_number("1.234,5")
    (0.001, 2.5, 1234.5, 1234.5)
    >>> read_number("1.000", ",")
    1000.0
    >>> read_number("1,000")
    Traceback (most recent call last):
    ValueError: may be 1000 or 1.0: write one of them
    """
    text = tidy(text)
    if (ten := _TEN.fullmatch(text)) is not None:
        return _double(f"{ten[1]}1e{ten[2]}")
    power = ""
    if " " in text or "x" in text or not text.isascii() or "*" in text:
        match = NUMBER.match(text)
        times = _POWER.fullmatch(text, match.end()) if match else None
        if match is not None and times is not None:
            text, power = match[0], f"e{times[1]}"
    if _PLAIN.fullmatch(text) and (decimal != "," or "." not in text):
        return _double(text + power)
    if _WORDS.fullmatch(text):
        return float(text)
    return _double(_with_point(text, decimal) + power)


def _double(text: str) -> float:
    """Return the double of a plain number.  A number with too many digits must not become an
    infinite stiffness."""
    try:
        if not text.isascii():  # float reads digits of every script
            raise ValueError
        value = float(text.replace("D", "e").replace("d", "e").replace("_", "x"))
    except ValueError:
        raise ValueError("must be a number") from None
    if value in (float("inf"), float("-inf")):
        raise ValueError(TOO_LARGE)
    return value


def _with_point(text: str, decimal: str) -> str:
    """Return a number with a decimal point and no other separator between its digits."""
    sign, body = (text[0], text[1:]) if text[:1] in "+-" and text else ("", text)
    digits, exponent = body, ""
    for mark in "eEdD":
        if mark in body:
            digits, _, exponent = body.partition(mark)
            exponent = f"e{exponent}"
            break
    digits = digits.strip()
    for blank in (" ", "'"):  # these can only separate thousands
        if blank in digits:
            whole, point, rest = _split(digits, decimal)
            if not _GROUPS.fullmatch(whole):
                raise ValueError("must be a number")
            digits = f"{whole.replace(blank, '')}{'.' if point else ''}{rest}"
            return f"{sign}{digits}{exponent}"
    if decimal:
        other = "," if decimal == "." else "."
        whole, point, rest = _split(digits, decimal)
        if other in whole:
            if not _GROUPS.fullmatch(whole) or whole.startswith("0"):
                raise ValueError(f"must be a number such as 0{decimal}5")
            whole = whole.replace(other, "")
        if other in rest or decimal in rest:
            raise ValueError(f"must be a number such as 0{decimal}5")
        return f"{sign}{whole}{'.' if point else ''}{rest}{exponent}"
    point = max(".,", key=digits.rfind)
    other = "," if point == "." else "."
    if other in digits:  # 1,234.5: the last separator is the decimal one
        whole, _, rest = digits.rpartition(point)
        if point in whole or not _GROUPS.fullmatch(whole):
            raise ValueError("must be a number")
        return f"{sign}{whole.replace(other, '')}.{rest}{exponent}"
    if digits.count(point) > 1:
        if not _GROUPS.fullmatch(digits):
            raise ValueError("must be a number")
        return f"{sign}{digits.replace(point, '')}{exponent}"
    if point == "," and _GROUPS.fullmatch(digits) and not digits.startswith("0") and not exponent:
        whole, fraction = digits.replace(",", ""), float(digits.replace(",", "."))
        raise ValueError(f"may be {sign}{whole} or {sign}{fraction!r}: write one of them")
    return f"{sign}{digits.replace(point, '.')}{exponent}"


def _split(digits: str, decimal: str) -> tuple[str, str, str]:
    """Return the digits before and after the decimal separator."""
    if decimal:
        return digits.partition(decimal)
    return digits.partition(max(".,", key=digits.rfind))


def split_number(text: str) -> tuple[float, str]:
    """Return the number at the start of a tidy text, and the text after it.  Raise ValueError as
    :func:`read_number` does, and also if the text does not begin with a number.

    >>> split_number("1e6N/m"), split_number("2x10^-6 m"), split_number("1 000 N")
    ((1000000.0, 'N/m'), (2e-06, 'm'), (1000.0, 'N'))
    """
    match = NUMBER.match(text)
    if match is None:
        raise ValueError("must be a number")
    end = match.end()
    power = _POWER.match(text, end) or _RAISED.match(text, end)
    if power is not None:
        end = power.end()
    return read_number(text[:end]), text[end:].strip()
