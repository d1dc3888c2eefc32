"""Layouts that rigs, oscilloscopes, loggers, spreadsheets and programs export, made after their
public descriptions: each is read as it is meant, or refused with its line and the remedy."""

import random
import re
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest

from mumacro.errors import TextError
from mumacro.fits.measured_points import read_points
from mumacro.inputs import decoding
from mumacro.inputs.layout import Dialect
from tests.support.comparing import close

V0 = [1e-3, 2e-3, 5e-3, 1e-2]
MU = [0.069, 0.097, 0.174, 0.221]


class Refused(NamedTuple):
    """Where a table is refused, and the remedy that is told."""

    line: int
    remedy: str


def rows(form: str, comma: bool = False) -> str:
    """Return four rows in a form that has v and m, the speed in mm/s and the friction; i counts."""
    lines = []
    for i, (v, m) in enumerate(zip((1, 2, 5, 10), MU, strict=True), 1):
        number = f"{m}".replace(".", ",") if comma else f"{m}"
        lines.append(form.format(v=v, m=number, i=i) + "\n")
    return "".join(lines)


PLAIN, SEMICOLON, TAB = rows("{v},{m}"), rows("{v};{m}", comma=True), rows("{v}\t{m}")
HEAD = "v0 [mm/s],mu_macro\n"
LABVIEW = (
    "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tNo\n"
    "***End_of_Header***\t\nChannels\t2\nSamples\t4\t4\nY_Unit_Label\tmm/s\t-\nDelta_X\t1,0\t1,0\n"
    "***End_of_Header***\t\nX_Value\tv0\tmu_macro\tComment\n"
)
INTERVALS = (
    "Interval:\t1\n\nInterval data:\tPoint No.\tv0\tmu_macro\n\t\t[mm/s]\t[1]\n\t1\t1\t0.069\n\n"
    "Interval:\t2\n\nInterval data:\tPoint No.\tv0\tmu_macro\n\t\t[mm/s]\t[1]\n\t1\t2\t0.097\n"
)
TOA5 = '"TOA5","rig","CR1000"\n"TIMESTAMP","RECORD","v0","mu_macro"\n"TS","RN","mm/s",""\n'
BEGIN, MIDDLE = "1,0.069\n2,0.097\n", "5,0.174\n10,0.221\n"

#: what is read
READ: dict[str, str | bytes] = {
    "blanks beside quotes": '"v0 [mm/s]" , "mu_macro"\n' + rows(' "{v}" , "{m}" '),
    "blank lines whose cells are in quotes": HEAD + '"",""\n' + PLAIN + '" ",\n',
    "TDMS as text, units in the list of channels": (
        "Group\tChannels\nFriction\t2\n\nChannel\tDatatype\tUnit\tLength\n"
        "v0\tDBL\tmm/s\t4\nmu_macro\tDBL\t-\t4\n\nv0\tmu_macro\n" + TAB
    ),
    "LabVIEW with a decimal comma": LABVIEW + rows("\t{v}\t{m}\t", comma=True),
    "tribometer, units in brackets in the second line": "v0,mu_macro\n[mm/s],[-]\n" + PLAIN,
    "tribometer with time": "Time,v0,mu_macro\n(sec),(mm/s),\n" + rows("0.{i},{v},{m}"),
    "rheometer, names behind a label": (
        "Interval:\t1\nNumber of Data Points:\t4\n\nInterval data:\tPoint No.\tv0\tmu_macro\n"
        "\t\t\t\n\t\t[mm/s]\t[1]\n" + rows("\t{i}\t{v}\t{m}")
    ),
    "data acquisition, all in quotes": (
        '"Channel name","v0","mu_macro"\n"Unit","mm/s",""\n' + rows('"{i}","{v}","{m}"')
    ),
    "worksheet with labels of its rows": "Long Name\tv0\tmu_macro\nUnits\tmm/s\t\n"
    + rows("\t{v}\t{m}"),
    "numerical program, units in apostrophes": "v0,mu_macro\n'mm/s','-'\n" + PLAIN,
    "dynamometer with settings above": (
        "measurement;run 7\ndate;29.11.2026\nchannel;v0;mu_macro\nunit;mm/s;-\n"
        + rows("{i};{v};{m}", comma=True)
    ),
    "spreadsheet in German, Windows-1252": (
        "v0 [mm/s];mu_macro;Prüfer\n" + rows("{v};{m};Jäger", comma=True)
    ).encode("cp1252"),
    "spreadsheet, Unicode text": ("v0 [mm/s]\tmu_macro\r\n" + TAB).encode("utf-16"),
    "UTF-16 without a mark": ("v0 [mm/s]\tmu_macro\r\n" + TAB).encode("utf-16-be"),
    "line ends of an old Mac": (HEAD + PLAIN).replace("\n", "\r"),
    "names in quotes between tabs": '"v0 [mm/s]"\t"mu_macro"\n' + TAB,
    "names and units in comments": "% rig 7\n% v0 mu_macro\n% mm/s -\n" + rows("{v} {m}"),
    "thousands with a blank": "v0 [um/s];mu_macro\n" + rows("{v} 000;{m}", comma=True),
    "thousands with an apostrophe": "v0 [um/s];mu_macro\n" + rows("{v}’000;{m}"),
    "separators at the ends": "v0 [mm/s],mu_macro,,\n" + rows("{v},{m},,"),
    "comment at the end": HEAD + PLAIN + "# end of data, 4 rows\n",
    "blank lines between segments": HEAD + BEGIN + "\n\n" + MIDDLE,
    "blocks of a plotting program": (
        "# v0 mu_macro\n# mm/s -\n1 0.069\n2 0.097\n\n\n"
        "# v0 mu_macro\n# mm/s -\n5 0.174\n10 0.221\n"
    ),
    "header and units again": f"v0,mu_macro\nmm/s,-\n{BEGIN}v0,mu_macro\nmm/s,-\n{MIDDLE}",
    "units again that begin with 1": (
        "mu_macro,v0\n1,mm/s\n0.069,1\n0.097,2\nmu_macro,v0\n1,mm/s\n0.174,5\n0.221,10\n"
    ),
    "header twice, then units": "v0,mu_macro\nv0,mu_macro\nmm/s,-\n" + PLAIN,
    "files joined with their marks": f"\ufeff{HEAD}{BEGIN}\ufeff{HEAD}{MIDDLE}",
    "pages": f"{HEAD}{BEGIN}\f{HEAD}{MIDDLE}",
    "oscilloscope with a preamble": (
        "Model,MSO\nHorizontal Units,s\nSample Interval,1e-3\n\n\nv0,mu_macro\nmm/s,\n" + PLAIN
    ),
    "oscilloscope with x": "x-axis,v0,mu_macro\nsecond,mm/s,\n" + rows("0.{i},{v},{m}"),
    "oscilloscope with segments": (
        "Segments,1,SegmentSize,4\nSegment,TrigTime,TimeSinceSegment1\n#1,29-Nov-2026,0\n"
        + HEAD
        + PLAIN
    ),
    "oscilloscope, an empty line below the units": "v0,mu_macro\n(mm/s),(-)\n\n" + PLAIN,
    "logger with a scan and a time": (
        "Scan,Time,v0 (mm/s),mu_macro (-)\n" + rows("{i},11/29/2026 10:00:0{i}:000,{v},{m}")
    ),
    "test bench, names behind Kanal": (
        "Kanal:\tv0\tmu_macro\nEinheit:\tmm/s\t-\n" + rows("{i}\t{v}\t{m}", comma=True)
    ),
    "testing machine, units below an empty line": "v0,mu_macro\n\nmm/s,-\n" + PLAIN,
    "testing machine in quotes": '"v0";"mu_macro"\n"mm/s";""\n' + SEMICOLON,
    "unit of another column alone": "v0 [mm/s],mu_macro,T\n,,°C\n" + rows("{v},{m},20"),
    "finite elements": "\n\n   X      v0 [mm/s]     mu_macro\n\n" + rows("  {i}.   {v}.   {m}"),
    "finite elements, header in a comment": (
        "% Model: x.mph\n% Dimension: 0\n% v0 (mm/s)  mu_macro (1)\n" + rows("{v}   {m}")
    ),
    "flow simulation": "[Data]\nv0 [ mm s^-1 ],mu_macro\n" + PLAIN,
    "columns of one width, units between brackets": (
        "   v0      mu_macro\n  (mm/s)     (-)\n" + rows("   {v}.0   {m}")
    ),
    "array of a program": "# v0 [mm/s] mu_macro\n" + rows("{v}.000000000000000000e+00 {m}e+00"),
    "Markdown": "| v0 [mm/s] | mu_macro |\n|-------|:-----:|\n" + rows("| {v} | {m} |"),
    "text table in a frame": (
        "+------+------+\n| v0 [mm/s] | mu_macro |\n+------+------+\n"
        + rows("| {v} | {m} |")
        + "+------+------+\n"
    ),
    "ruler below the units": "v0  mu_macro\nmm/s  -\n----  ----\n" + rows("{v}  {m}"),
    "a line that names the separator": "sep=;\nv0 [mm/s];mu_macro\n" + SEMICOLON,
    "unit behind a comma in quotes": '"v0, mm/s","mu_macro, -"\n' + PLAIN,
    "decimal comma in quotes": '"v0 [mm/s]","mu_macro"\n' + rows('"{v}","{m}"', comma=True),
    "date and time first": (
        "Datum;Zeit;v0 [mm/s];mu_macro\n" + rows("29.11.2026;10:00:00;{v};{m}", comma=True)
    ),
    "YAML above": "---\nrig: 7\nunits:\n  v0: mm/s\n---\nv0,mu_macro\n" + PLAIN,
    "numbers of the columns above": "1,2\n" + HEAD + PLAIN,
    "units three lines above the names": (
        "mm/s,-\n# step 0\n# step 1\n# step 2\nv0,mu_macro\n" + PLAIN
    ),
    "brackets between blanks": "v0 (mm/s) mu_macro (-)\n" + rows("{v} {m}"),
    "square brackets between blanks": "v0 [mm/s] mu_macro [-]\n" + rows("{v} {m}"),
    "empty cells behind rows with a header below": HEAD + "1,0.069,\n2,0.097,\n" + HEAD + MIDDLE,
    "an empty cell beyond the header": HEAD + "1,0.069, ,\n2,0.097\n" + MIDDLE,
    "a row that is commented out": HEAD + BEGIN + "#3,0.1\n" + MIDDLE,
    "a quote in a comment": HEAD + '1,0.069\n# a,"b\n2,0.097\n# "\n' + MIDDLE,
    "units said twice": "v0,mu_macro\nmm/s,-\nmm/s,-\n" + PLAIN,
}
#: what is refused
REFUSED: dict[str, tuple[str, Refused]] = {
    "rheometer, two intervals": (INTERVALS, Refused(7, "--rows 5..6")),
    "worksheet with comments": (
        "v0\tmu_macro\nmm/s\t\nrun 7\tmean\n" + TAB,
        Refused(3, "--rows A..B"),
    ),
    "names of variables with their units": (
        "v0_mm_s,mu_macro\n" + PLAIN,
        Refused(1, "rename that column to v0 [mm/s]"),
    ),
    "logger with a row of methods": (
        TOA5 + '"","","Avg","Avg"\n' + rows('"2026",{i},{v},{m}'),
        Refused(4, "--rows A..B"),
    ),
    "end of data": (HEAD + PLAIN + "End of data\n", Refused(6, "--rows 2..5")),
    "end of data in quotes": (HEAD + PLAIN + '"End of data",""\n', Refused(6, "--rows 2..5")),
    "number of points": (HEAD + PLAIN + "Total points:,4\n", Refused(6, "--rows 2..5")),
    "number at the end": (
        "v0 mu_macro\nmm/s -\n" + rows("{v} {m}") + "END 4\n",
        Refused(7, "--rows 3..6"),
    ),
    "page at the end": (HEAD + PLAIN + "Page 1,of 1\n", Refused(6, "--rows 2..5")),
    "status at the end": (HEAD + PLAIN + "0 errors\n", Refused(6, "--rows 2..5")),
    "control sign at the end": (HEAD + PLAIN + "\x1a", Refused(6, "--rows 2..5")),
    "other units again": (
        f"v0,mu_macro\nmm/s,-\n{BEGIN}v0,mu_macro\num/s,-\n{MIDDLE}",
        Refused(6, "--rows 3..5"),
    ),
    "other units again that begin with 1": (
        "mu_macro,v0\n1,mm/s\n0.069,1\n0.097,2\nmu_macro,v0\n1,um/s\n0.174,5\n",
        Refused(6, "--rows 3..5"),
    ),
    "unit in the second header alone": (
        f"v0,mu_macro\n{BEGIN}{HEAD}{MIDDLE}",
        Refused(4, "--rows 2..3"),
    ),
    "unit in a comment below the rows": (
        f"v0,mu_macro\n{PLAIN}# v0 in mm/s\n",
        Refused(6, "v0 [mm/s]"),
    ),
    "unit in a sentence below the rows": (
        f"v0,mu_macro\n{PLAIN}\nv0 in mm/s\n",
        Refused(7, "neither a row nor a comment"),
    ),
    "statistics below": (HEAD + PLAIN + "\nMean,0.14\nStd,0.06\n", Refused(7, "--rows 2..6")),
    "statistics with their name in front": (
        "run,v0 [mm/s],mu_macro\n" + rows("a,{v},{m}") + "Mean:,4.5,0.14\n",
        Refused(6, "--rows 2..5"),
    ),
    "statistics with their name behind": (
        "v0 [mm/s],mu_macro,note\n" + rows("{v},{m},") + "4.5,0.14,mean\n",
        Refused(6, "--rows 2..5"),
    ),
    "statistics above": (HEAD + "Mean,0.14\n" + PLAIN, Refused(2, "--rows A..B")),
    "summary of a data frame": (
        ",v0 [mm/s],mu_macro\ncount,4,4\nmean,4.5,0.14\nmin,1,0.069\n25%,1.7,0.09\n",
        Refused(2, "--rows A..B"),
    ),
    "types below the names": (HEAD + "double,double\n" + PLAIN, Refused(2, "--rows A..B")),
    "labels below the names": (
        'v0,mu_macro\n"Sliding speed (mm/s)","Friction"\n' + PLAIN,
        Refused(2, "--rows A..B"),
    ),
    "numbers of the columns below": (HEAD + "(1),(2)\n" + PLAIN, Refused(2, "--rows A..B")),
    "units that differ": ("v0,mu_macro\nmm/s,-\nm/s,-\n" + PLAIN, Refused(3, "leave one")),
    "units as YAML in comments": (
        "# - name: v0\n#   unit: mm/s\nv0,mu_macro\n" + PLAIN,
        Refused(2, "write each behind its name"),
    ),
    "decimal commas between commas": (
        HEAD + rows("{v},{m}", comma=True),
        Refused(2, "has 3 cells, the header has 2"),
    ),
    "another header in a comment": (
        HEAD + BEGIN + "# v0 [m/s],mu_macro\n" + MIDDLE,
        Refused(4, "--rows 2..3"),
    ),
    "header with its columns changed": (
        HEAD + BEGIN + "mu_macro,v0 [mm/s]\n" + MIDDLE,
        Refused(4, "--rows 2..3"),
    ),
    "title of a segment": (HEAD + BEGIN + "\nSegment 2\n" + MIDDLE, Refused(5, "--rows 2..4")),
    "label of a row behind it": (HEAD + BEGIN + ",Mittelwert:\n", Refused(4, "--rows 2..3")),
    "a cell beyond the header": (HEAD + "1,0.069\n2,0.097,7\n", Refused(3, "has 3 cells")),
    "a gap that begins like a comment": (HEAD + "#NV,0.1\n" + PLAIN, Refused(2, "--rows 3..6")),
    "overload": (HEAD + "1,0.069\n2,OVER\n", Refused(3, "--rows 2..2")),
}


@pytest.fixture(params=[decoding.PIECE, 7])
def path(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file for a table, which is read in pieces of several lengths."""
    monkeypatch.setattr(decoding, "PIECE", request.param)
    return tmp_path / "table.txt"


@pytest.mark.parametrize("name", READ)
def test_a_layout_is_read_as_it_is_meant(path: Path, name: str) -> None:
    data = READ[name]
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    points = read_points(path)
    assert points.columns["v0"].tolist() == close(V0, rel=1e-12)
    assert points.columns["mu_macro"].tolist() == close(MU, rel=1e-12)


@pytest.mark.parametrize("name", REFUSED)
def test_a_layout_that_is_not_clear_gets_its_line_and_a_remedy_that_works(
    path: Path, name: str
) -> None:
    text, expected = REFUSED[name]
    path.write_bytes(text.encode())
    with pytest.raises(TextError) as refusal:
        read_points(path)
    said = str(refusal.value)
    assert said.startswith(f"line {expected.line}")
    assert expected.remedy in said
    if match := re.search(r"--rows (\d+)\.\.(\d+)", said):
        points = read_points(path, Dialect(rows=(int(match[1]), int(match[2]))))
        n = len(points.lines)
        unit = 1.0 if points.units["v0"] == "mm/s" else 1e3
        assert points.columns["v0"].tolist() == close([unit * v for v in V0[:n]], rel=1e-12)
        assert points.columns["mu_macro"].tolist() == close(MU[:n], rel=1e-12)


#: what damage puts between the characters of a table
PIECES = ("\n", "\n\n", ",", ";", "\t", '"', "#", " ", "-", "1", "1,5", "v0", "mu_macro", "y0")
WORDS = ("mm/s", "[mm/s]", "units", "mean", "%", "{", "±", "..", "1e999", "***End_of_Header***\n")


def damaged(text: str, chance: random.Random) -> str:
    """Return a table in which characters were put in or left out, or a line stands twice."""
    for _ in range(chance.randint(1, 6)):
        place, kind = chance.randrange(len(text) + 1), chance.random()
        if kind < 0.5:
            piece = chance.choice(PIECES + WORDS) * chance.choice((1, 1, 2, 5))
            text = text[:place] + piece + text[place:]
        elif kind < 0.8:
            text = text[:place] + text[place + chance.randint(1, 12) :]
        else:
            lines = text.split("\n")
            lines.insert(chance.randrange(len(lines) + 1), chance.choice(lines))
            text = "\n".join(lines)
    return text


def test_a_damaged_layout_is_read_or_gets_a_reason(tmp_path: Path) -> None:
    chance, path = random.Random(1), tmp_path / "table.txt"  # noqa: S311
    texts = [text for text in READ.values() if isinstance(text, str)]
    texts += [text for text, _ in REFUSED.values()]
    # a name within a word, and no other name, in a line of names and units
    path.write_text("5-----\t0.174\nmu_macro2\t0.097\nv0\tmu_macro\nrun 7\tmean\n")
    with suppress(TextError):
        read_points(path)
    for _ in range(400):
        path.write_bytes(damaged(chance.choice(texts), chance).encode())
        with suppress(TextError):  # anything else fails the test
            read_points(path)
