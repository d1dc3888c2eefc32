"""The loaded tables.  Each is opened and its checksum and a known answer are checked before the service is ready."""

import logging
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b
from pathlib import Path
from typing import Annotated, Any, Self

import orjson
from fastapi import Depends
from starlette.requests import Request

from mumacro import Surrogate, TableError

from . import API_VERSION, __version__, numbers
from .errors import FieldFault, InvalidFieldsError, NotReadyError
from .kernel import Kernel
from .metrics import first_cell

__all__ = ["LoadedTable", "Tables", "TablesDep", "signature", "table_files", "tables_of"]

_log = logging.getLogger("mumacro.tables")


def table_files(paths: Sequence[Path]) -> list[Path]:
    """Files among ``paths``, and the ``*.nc`` files of the directories among them, in order of name.

    Raises
    ------
    TableError
        A path is missing, or a directory holds no table.
    """
    files: list[Path] = []
    for path in paths:
        if path.is_dir():
            found = sorted(file for file in path.glob("*.nc") if not file.name.startswith("."))
            if not found:
                raise TableError(path, "the directory holds no *.nc file")
            files.extend(found)
        elif path.exists():
            files.append(path)
        else:
            raise TableError(path, "missing")
    return files


def _stamp(path: Path) -> tuple[int, int, int]:
    status = os.stat(path)
    return status.st_size, status.st_mtime_ns, status.st_ino


@dataclass(frozen=True)
class LoadedTable:
    """A table in memory, and the state of its file when it was read."""

    surrogate: Surrogate
    kernel: Kernel
    stamp: tuple[int, int, int]
    cell: int = 0  # index of the counter of its first source

    @classmethod
    def open(cls, path: Path) -> Self:
        """Read and check one table, and load what its first answers need.

        Raises
        ------
        TableError
            The file is missing or damaged, or its known answer is wrong.
        """
        try:
            stamp = _stamp(path)
        except OSError as error:
            raise TableError(path, error.strerror or "unreadable") from error
        surrogate = Surrogate.open(path)
        kernel = Kernel(surrogate)
        surrogate.self_check()
        return cls(surrogate, kernel, stamp)

    @cached_property
    def label(self) -> dict[str, object]:
        """The table's label in every answer."""
        return {"id": self.surrogate.id, "tolerance": self.surrogate.tolerance}

    @cached_property
    def fragment(self) -> orjson.Fragment:
        """The label as JSON."""
        return orjson.Fragment(orjson.dumps(self.label))

    @cached_property
    def tag_key(self) -> bytes:
        """The part of entity tags that depends on the table and the version."""
        text = repr((self.kernel.checksum, self.surrogate.id, __version__, API_VERSION))
        return blake2b(text.encode(), digest_size=32).digest()

    @property
    def size_bytes(self) -> int:
        """Size of the file when it was read."""
        return self.stamp[0]

    def check(self) -> None:
        """Check the known answer again, and whether the file is unchanged.

        Raises
        ------
        TableError
            The answer is wrong, or the file was changed after it was loaded.
        """
        self.surrogate.self_check()
        path = self.surrogate.path
        try:
            same = _stamp(path) == self.stamp
        except OSError as error:
            raise TableError(path, "the file is gone") from error
        if not same:
            raise TableError(path, "the file was changed after it was loaded; restart the service")


class Tables:
    """All tables of the service, tightest first; or the reason why there are none."""

    def __init__(self, paths: Sequence[Path]) -> None:
        self.paths = tuple(paths)
        self.loaded: tuple[LoadedTable, ...] = ()
        self.fault: str | None = "the tables are not loaded yet"
        self.ready = False  # whether requests are answered
        self.draining = False
        self.warm = False  # whether everything compiled is loaded, not only what the first answers need

    def load(self, before_answers: Callable[[list[dict[str, Any]]], None] | None = None) -> None:
        """Load all tables.  A refused table makes the service not ready; it never stops the process.

        ``before_answers`` is called with the labels of the tables before the first request is answered.
        """
        try:
            tables = [LoadedTable.open(path) for path in table_files(self.paths)]
            names = [table.surrogate.id for table in tables]
            for table in tables:
                if names.count(table.surrogate.id) > 1:
                    raise TableError(table.surrogate.path, "another table has the same name")
        except TableError as error:
            self.fault = f"table {error.path.name}: {error.reason}"
            _log.error("no tables: %s", error)
        except Exception:
            self.fault = "the tables could not be loaded; the log has the reason"
            _log.exception("no tables")
        else:
            tables.sort(key=lambda table: (table.surrogate.tolerance, table.surrogate.id))
            self.loaded = tuple(replace(table, cell=first_cell(i)) for i, table in enumerate(tables))
            labels = [table.label for table in self.loaded]
            if before_answers is not None:
                before_answers(labels)
            self.fault = None
            _log.info("tables are loaded", extra={"fields": {"tables": labels}})

    def check(self) -> None:
        """Raise NotReadyError if a table does not give its known answer, or if the service is stopping."""
        if self.draining:
            raise NotReadyError("the service is stopping")
        self._ready()
        try:
            for table in self.loaded:
                table.check()
        except TableError as error:
            raise NotReadyError(f"table {error.path.name}: {error.reason}") from error

    def pick(self, tolerance: float | None = None, place: str = "pointer") -> LoadedTable:
        """The tightest table, or the smallest one that meets ``tolerance`` (relative to mu0 [-]).

        Raises
        ------
        NotReadyError, InvalidFieldsError
            No table is loaded; none is tight enough.
        """
        tables = self._ready()
        if tolerance is None:
            return tables[0]
        fit = [table for table in tables if table.surrogate.tolerance <= tolerance]
        if not fit:
            tightest = tables[0].surrogate.tolerance
            reason = f"no loaded table is that tight; the tightest has {tightest:g}"
            fault = FieldFault("tolerance", reason, tolerance, f">= {tightest:g}", place)
            raise InvalidFieldsError(f"tolerance: {reason}", [fault], tightest_available=tightest)
        return min(fit, key=lambda table: (table.size_bytes, -table.surrogate.tolerance))

    def named(self, identity: str) -> LoadedTable:
        """The table of that name.

        Raises
        ------
        NotReadyError, InvalidFieldsError
            No table is loaded; none has that name.
        """
        tables = self._ready()
        for table in tables:
            if table.surrogate.id == identity:
                return table
        reason = "must be one of " + ", ".join(table.surrogate.id for table in tables)
        raise InvalidFieldsError(f"id: {reason}", [FieldFault("id", reason, identity, place="parameter")])

    def _ready(self) -> tuple[LoadedTable, ...]:
        if self.fault is not None:
            raise NotReadyError(self.fault)
        return self.loaded

    def warm_up_more(self) -> None:
        """Load or compile the code that the first answers do not need: the reader of batches, then the quantities."""
        numbers.load()
        self.warm = True


def signature(table: LoadedTable) -> dict[str, object]:
    """Fields of every answer: the table and the version of the interface."""
    return {"table": table.label, "api_version": API_VERSION}


def tables_of(request: Request) -> Tables:
    """The tables of the application that the request came to."""
    tables: Tables = request.app.state.tables
    return tables


async def _tables(request: Request) -> Tables:  # async: FastAPI would run a plain function in a thread
    return tables_of(request)


TablesDep = Annotated[Tables, Depends(_tables)]
