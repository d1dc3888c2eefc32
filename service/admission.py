"""Admission: what one process takes on at the same time, decided in one place.

The bytes of a body are counted as they are received, over all requests together, before any of them
is read.
"""

from starlette.types import ASGIApp, Receive, Scope, Send

from .problems import FULL, ProblemKind, RequestError, path_in
from .security import HEALTH_PATHS

_TICKET = "mumacro.ticket"  # in the scope of a request that holds something


class Admission:
    """What the requests of one process hold together."""

    def __init__(self, max_held_bytes: int) -> None:
        self.max_held_bytes, self.held_bytes = max_held_bytes, 0


class Ticket:
    """What one request holds of it, until it is answered."""

    def __init__(self, admission: Admission) -> None:
        self._admission, self.held_bytes = admission, 0

    def weigh(self, size: int) -> None:
        """Refuse a body that will have this size, if the bodies of all requests are too many bytes
        then."""
        admission = self._admission
        if admission.held_bytes - self.held_bytes + size > admission.max_held_bytes:
            detail = (
                f"the bodies of all requests together may have {admission.max_held_bytes} bytes, "
                f"and {admission.held_bytes} of them are taken"
            )
            raise RequestError(ProblemKind.OVERLOADED, detail)

    def hold(self, size: int) -> None:
        """Hold a body of this size; 0 gives it back."""
        self._admission.held_bytes += size - self.held_bytes
        self.held_bytes = size


def ticket_of(scope: Scope) -> Ticket:
    """The ticket of a request, which :class:`Admitted` takes back."""
    ticket: Ticket = scope.get(_TICKET) or Ticket(scope["app"].state.admission)
    scope[_TICKET] = ticket
    return ticket


class Admitted:
    """Middleware: whatever a request holds is given back at its end.  While more connections are
    open than the settings allow, only the probes are answered."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Let a request pass if there is room for it."""
        if FULL in scope.get("state", ()) and path_in(scope) not in HEALTH_PATHS:
            raise RequestError(ProblemKind.OVERLOADED, "too many connections are open")
        try:
            await self._app(scope, receive, send)
        finally:
            if ticket := scope.get(_TICKET):
                ticket.hold(0)
