"""The folder that worker processes share.  Their parent makes it; it only starts and stops them, and imports little."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["FOLDER_VARIABLE", "shared_folder"]

#: names the folder to the workers; not a setting
FOLDER_VARIABLE = "_MUMACRO_METRICS_FOLDER"


@contextmanager
def shared_folder() -> Iterator[None]:
    """Make the folder that the workers share, in memory if possible; remove it at the end."""
    for place in ("/dev/shm", None):  # noqa: S108  (mkdtemp makes a folder of its own there)
        try:
            folder = tempfile.mkdtemp(prefix="mumacro-metrics-", dir=place)
            break
        except OSError:
            continue
    else:  # no writable folder: every worker reports its own counters
        yield
        return
    os.environ[FOLDER_VARIABLE] = folder
    try:
        yield
    finally:
        os.environ.pop(FOLDER_VARIABLE, None)
        shutil.rmtree(folder, ignore_errors=True)
