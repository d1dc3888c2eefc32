"""Tell PyInstaller where the hooks are; it calls the entry point ``pyinstaller40`` of the wheel."""

from pathlib import Path


def hook_folders() -> list[str]:
    """Return the folder of the hooks."""
    return [str(Path(__file__).parent)]
