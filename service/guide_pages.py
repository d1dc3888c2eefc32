"""Serve the built documentation below ``/guide/``."""

import base64
import hashlib
import posixpath
from collections.abc import Iterator
from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.responses import RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope


class GuidePages(StaticFiles):
    """Serve the pages with their own security policy.  A name that begins with a dot is not served,
    and redirects do not name a host."""

    def __init__(self, directory: Path) -> None:
        super().__init__(directory=directory, html=True)
        hashes = "".join(sorted(f" 'sha256-{one}'" for one in set(_inline_scripts(directory))))
        # inline styles are allowed, because the theme sets some on elements
        self._policy = (
            f"default-src 'none'; script-src 'self'{hashes}; style-src 'self' 'unsafe-inline'; "
            "img-src 'self' data:; font-src 'self'; connect-src 'self'; base-uri 'none'; "
            "form-action 'self'; frame-ancestors 'none'"
        )

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return the file, or the page of the folder."""
        if any(step.startswith(".") for step in path.split("/") if step != "."):
            raise HTTPException(404)
        response = await super().get_response(path, scope)
        if isinstance(response, RedirectResponse):
            # Behind a proxy with TLS, Starlette's address would have another scheme.
            response.headers["location"] = f"{posixpath.basename(scope['path'])}/"
        response.headers["content-security-policy"] = self._policy
        return response


def _inline_scripts(directory: Path) -> Iterator[str]:
    """Yield the hashes of the scripts that are within the pages."""
    for page in directory.rglob("*.html"):
        for rest in page.read_text("utf-8", "replace").split("<script>")[1:]:
            script = rest.partition("</script>")[0].encode()
            yield base64.b64encode(hashlib.sha256(script).digest()).decode()
