"""Answer questions about a contact: ``POST /v1/stiffness``, from materials and geometry; ``POST
/v1/fit``, from measured points."""

from collections.abc import Mapping, Sequence
from typing import Any

from fastapi import Request, Response

from mumacro.errors import InputError, TextError
from mumacro.fits.fit import best_fit
from mumacro.fits.measured_points import read_points, unknowns_beside
from mumacro.inputs.text_tables import Most
from mumacro.inputs.whole_tables import TableOfNumbers
from mumacro.inputs.workbooks import BEGIN as WORKBOOK
from mumacro.stiffness import contact_of

from .. import API_VERSION
from ..admission import compute
from ..bodies import understood_in
from ..json_text import Json
from ..models.answers import FitAnswer, PointsAnswer, StiffnessAnswer
from ..models.questions import MAX_POINTS, FitRequest, StiffnessRequest
from ..problems import FieldFault, refuse, with_members
from ..tables import LoadedTable
from . import POST_PROBLEMS, router_of

router = router_of("answers")
_FAULTS = 100  # largest number of bad lines of a table that an answer names
#: largest table of points: columns, and characters in a cell
MOST = Most(MAX_POINTS, columns=200, cell=200)


@router.post(
    "/stiffness",
    responses={200: {"model": StiffnessAnswer}, **POST_PROBLEMS},
    summary="The stiffness of a contact from materials and geometry",
)
async def post_stiffness(request: Request, contact: StiffnessRequest) -> Response:
    """Return k, and the contact to use with it; the arguments of a geometry are in SI."""
    members = await understood_in(request, bool(contact.include))
    with with_members(**members):
        arguments = contact.model_dump(exclude_none=True, exclude={"geometry", "include"})
        answer = contact_of(contact.geometry, **arguments).to_dict()
        answer |= members
        return Json({"geometry": contact.geometry, **answer, "api_version": API_VERSION})


@router.post(
    "/fit",
    responses={200: {"model": FitAnswer | PointsAnswer}, **POST_PROBLEMS},
    summary="k and mu0 from measured points",
)
async def post_fit(request: Request, measured: FitRequest) -> Response:
    """Fit k and mu0 to measured points; an infinite bound is null, an infinite k is the word
    rigid."""
    columns, source = measured.columns, measured.table
    table = request.app.state.tables.pick(measured.tolerance)

    def answer() -> Response:
        points = None if source is None else _points(*source, measured)
        if points is not None and measured.read_only:
            return Json(_as_read(points))
        return Json(_fitted(table, measured, columns, points))

    return await compute(request, answer)


def _points(member: str, data: bytes, measured: FitRequest) -> TableOfNumbers:
    """Return the points of a table; a refusal names what is wrong in its lines, at ``member``."""
    try:
        if data.startswith(WORKBOOK):  # a few kB of a workbook may unpack to any size
            raise TextError("it is a workbook, or another zip file: save it as CSV")
        return read_points(data, measured.dialect, MOST)
    except TextError as error:
        faults = error.faults or [str(error)]
        refuse([FieldFault.of(member, fault) for fault in faults[:_FAULTS]])


def _as_read(points: TableOfNumbers) -> dict[str, Any]:
    return {
        "columns": points.as_written,
        "units": points.units,
        "lines": points.lines,
        "skipped_lines": points.skipped,
        "read_as": points.read_as,
        "api_version": API_VERSION,
    }


def _fitted(
    table: LoadedTable,
    measured: FitRequest,
    columns: Mapping[str, Any],
    points: TableOfNumbers | None,
) -> dict[str, Any]:
    words: Any = measured.kind.names
    unknowns: Sequence[str] = measured.unknowns
    account: dict[str, Any] = {}
    if points is not None:
        if in_common := sorted(columns.keys() & points.columns.keys()):
            raise InputError(in_common[0], None, "given once: it is a column of the points")
        columns = {**points.columns, **columns}
        if "unknowns" not in measured.model_fields_set:
            unknowns = unknowns_beside(columns)
        account = {"read_as": points.read_as, "skipped_lines": points.skipped}
    try:
        fit = best_fit(columns, unknowns, table.surrogate, **words)
    except InputError as error:
        if points is None or error.index is None:
            raise
        reason = f"line {points.lines[error.index]}: {error.field} must be {error.bound}"
        refuse([FieldFault.of("points", reason, error.value)])
    return {**fit.to_dict(), **account, **table.signature}
