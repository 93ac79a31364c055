"""Files that are there whole or not at all."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile, mkstemp

from vrdp_prob.errors import InputError


def check_writable(folder: Path) -> None:
    """Refuse a folder that could not be written, before the work whose result shall go there; nothing is left in it.

    Raises
    ------
    InputError
        If the folder could not be made or written.
    """
    try:
        existing = next(parent for parent in (folder, *folder.absolute().parents) if parent.exists())
        with TemporaryFile(dir=existing):
            return
    except OSError as error:
        raise InputError(f"{folder}: the folder cannot be written ({error.strerror}); choose another one.") from error


def check_file(path: Path) -> None:
    """Refuse a file that could not be written, before the work whose result it shall hold.

    Raises
    ------
    InputError
        If it is a folder, or its folder could not be made or written.
    """
    if path.is_dir():
        raise InputError(f"{path}: this is a folder; name the file to write.")
    check_writable(path.parent)


def own_folders(videos: Sequence[str]) -> dict[str, str]:
    """Names of folders for some videos, whose own names may hold what leads elsewhere.

    Raises
    ------
    InputError
        If two would have the same.
    """
    names: dict[str, str] = {}
    for video in videos:
        name = re.sub(r"[/\\\0]", "_", video)
        name = name if name.strip(".") else "_" * len(name)
        if name in names.values():
            raise InputError(f"video '{video}': another one would be written to the folder '{name}' too; rename one.")
        names[video] = name
    return names


@contextmanager
def write_atomically(path: Path | str) -> Iterator[Path]:
    """Give a temporary path beside `path`, which takes the name `path` when the block ends without an exception.

    Raises
    ------
    InputError
        If the folder cannot be made or written, a folder has the file's name, or the disk is full.
    """
    path, temporary = Path(path), None
    if path.is_dir():
        raise InputError(f"{path}: the file cannot be written, a folder has its name; choose another place.")
    try:
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            handle, name = mkstemp(prefix=f".{path.stem}-", suffix=path.suffix, dir=path.parent)
            temporary = Path(name)
            open(handle, "wb").close()
        except OSError as error:
            raise InputError(
                f"{path.parent}: the folder cannot be written ({error.strerror}); choose another one."
            ) from error
        yield temporary
        temporary.chmod(0o644)
        temporary.replace(path)
    except BaseException as error:
        if temporary is not None:
            temporary.unlink(missing_ok=True)
        if isinstance(error, OSError):
            reason = error.strerror or error
            raise InputError(f"{path}: the file cannot be written ({reason}); choose another place.") from error
        raise
