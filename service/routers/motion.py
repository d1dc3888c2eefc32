"""Answer any periodic motion: ``POST /v1/motion``.  It reads no table."""

from dataclasses import fields
from typing import Any

from fastapi import Request, Response

import mumacro
from mumacro.errors import InputError

from .. import API_VERSION
from ..admission import compute
from ..bodies import understood_in
from ..json_text import Json
from ..models.motion import MotionAnswer, MotionRequest
from ..problems import FieldFault, reason_of, refuse, with_members
from . import POST_PROBLEMS, router_of

router = router_of("answers")
_NUMBERS = [one.name for one in fields(mumacro.Motion) if one.name in MotionAnswer.model_fields]


@router.post(
    "/motion",
    responses={200: {"model": MotionAnswer}, **POST_PROBLEMS},
    summary="The mean friction of any periodic motion",
)
async def post_motion(request: Request, scene: MotionRequest) -> Response:
    """Compute the steady cycle of a contact that is shaken obliquely, in an ellipse, with harmonics
    or with an oscillating load."""
    members = await understood_in(request, bool(scene.include))
    with with_members(**members):
        return await compute(request, lambda: Json(_answered(scene) | members), scene.cost)


def _answered(scene: MotionRequest) -> dict[str, Any]:
    try:
        motion = mumacro.motion(**scene.case, threads=1)
    except InputError as error:
        if error.field in MotionRequest.model_fields:
            raise
        # a fault of several inputs together, such as the speed: no single one is bad
        refuse([FieldFault((), f"{error.field} {reason_of(error)}", error.value)])
    answer: dict[str, Any] = {name: getattr(motion, name) for name in _NUMBERS} | {
        "contact": scene.contact
    }
    said = {"warnings": motion.warnings, "remarks": motion.remarks}
    answer |= {name: lines for name, lines in said.items() if lines}
    if scene.cycle:
        columns = motion.cycle()._asdict()
        answer["cycle"] = {name: column.tolist() for name, column in columns.items()}
    return {**answer, "api_version": API_VERSION}
