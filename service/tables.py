"""Load the tables.  Each is opened, and its checksum and a known answer are checked, before the
service is ready."""

import asyncio
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mumacro import Surrogate, TableError

from . import API_VERSION
from .admission import Thread
from .problems import FieldFault, ProblemKind, RequestError, refuse

_PATIENCE_S = 2.0  # longest time for a check of the files
_log = logging.getLogger("mumacro.tables")


def _files(paths: Sequence[Path]) -> list[Path]:
    """Return the files among ``paths``, and the ``*.nc`` files of the directories among them, in
    order of name.

    Raise TableError if a path is missing, or a directory holds no table.
    """
    files: list[Path] = []
    for path in paths:
        tables = [path] if path.is_file() else sorted(path.glob("[!.]*.nc"))
        if not tables:
            raise TableError(
                path, "the directory holds no *.nc file" if path.is_dir() else "missing"
            )
        files += tables
    return files


def _stamp(path: Path) -> tuple[int, int, int]:
    """Return size, time and place of a file.  Raise TableError if it does not exist."""
    try:
        status = path.stat()
    except OSError as error:
        raise TableError(path, "the file is gone") from error
    return status.st_size, status.st_mtime_ns, status.st_ino


class LoadedTable:
    """Hold a table in memory, and the state of its file when it was read.  Raise TableError if it
    is damaged."""

    def __init__(self, path: Path) -> None:
        self.stamp, self.surrogate = _stamp(path), Surrogate.open(path, threads=1)
        self.id = self.surrogate.id
        #: the table's label in every answer
        self.label = {"id": self.id, "tolerance": self.surrogate.tolerance}
        #: fields of every answer: the table and the version of the interface
        self.signature: dict[str, Any] = {"table": self.label, "api_version": API_VERSION}
        self.check()

    def check(self) -> None:
        """Check the known answer, and that the file is unchanged; otherwise raise TableError."""
        self.surrogate.self_check()
        if _stamp(self.surrogate.path) != self.stamp:
            raise TableError(
                self.surrogate.path, "the file was changed after it was loaded; restart the service"
            )


class Tables:
    """Hold all tables of the service, the tightest first, or the reason why there are none."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.paths = tuple(paths)
        self.loaded: tuple[LoadedTable, ...] = ()
        self.fault: str | None = "the tables are not loaded yet"
        self._checking: asyncio.Future[None] | None = None  # the last check of the files

    def load(self) -> None:
        """Load all tables.  A refused table makes the service not ready; it never stops the
        process."""
        try:
            tables = [LoadedTable(path) for path in _files(self.paths)]
            names = [table.id for table in tables]
            for table in tables:
                if names.count(table.id) > 1:
                    raise TableError(table.surrogate.path, "another table has the same name")
        except TableError as error:
            self.fault = f"table {error.path.name}: {error.reason}"
            _log.error("no tables: %s", error)
        except Exception:
            self.fault = "the tables could not be loaded; the log has the reason"
            _log.exception("no tables")
        else:
            self.loaded = tuple(
                sorted(tables, key=lambda table: (table.surrogate.tolerance, table.id))
            )
            self.fault = None
            _log.info(
                "tables are loaded",
                extra={"fields": {"tables": [table.label for table in self.loaded]}},
            )

    async def check(self) -> None:
        """Check every table again.  Raise TableError, or RequestError if no table is loaded.

        A thread checks the files, one for all requests that ask at the same time, so that a file
        system that hangs stops no other request.
        """
        self.pick()
        if self._checking is None or self._checking.done():
            self._checking = Thread(self._check_files).done
        checking = self._checking
        if not (await asyncio.wait([checking], timeout=_PATIENCE_S))[0]:
            raise RequestError(ProblemKind.NOT_READY, "the files of the tables do not answer")
        checking.result()

    def _check_files(self) -> None:
        for table in self.loaded:
            table.check()

    def pick(self, tolerance: float | None = None, parameter: bool | None = None) -> LoadedTable:
        """Return the tightest table, or the smallest one that meets ``tolerance`` (relative to mu0
        [-])."""
        if self.fault is not None:
            raise RequestError(ProblemKind.NOT_READY, self.fault)
        tables = self.loaded
        if tolerance is None:
            return tables[0]
        fit = [table for table in tables if table.surrogate.tolerance <= tolerance]
        if not fit:
            tightest = tables[0].surrogate.tolerance
            reason = f"must be >= {tightest:g}: no loaded table is tighter"
            refuse(
                [FieldFault(("tolerance",), reason, tolerance, parameter)],
                tightest_available=tightest,
            )
        return min(fit, key=lambda table: (table.stamp[0], -table.surrogate.tolerance))
