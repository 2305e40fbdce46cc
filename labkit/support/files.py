"""Writing files so that a killed process or a full disk never leaves half of one."""

import errno
import os
from pathlib import Path


def write_atomically(path, data: bytes) -> None:
    """Write bytes to `path` through a temporary file beside it: readers see the old file or the new one, whole.

    Creates missing folders. On any failure (a full disk, say) the temporary file is removed; an OSError names `path`.
    """
    path = Path(path)
    unfinished = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        unfinished.write_bytes(data)
        os.replace(unfinished, path)
    except OSError as error:
        raise OSError(error.errno, f"could not write the file ({os.strerror(error.errno or 0)})", str(path)) from error
    finally:
        unfinished.unlink(missing_ok=True)


def check_writable(folder) -> None:
    """Raise the OSError that writing into a folder would end with, before the work of an hour; nothing is made yet."""
    folder = Path(folder).absolute()
    there = next(path for path in (folder, *folder.parents) if path.exists())
    if not there.is_dir():
        raise NotADirectoryError(errno.ENOTDIR, f"a file stands where a folder is wanted for {folder}", str(there))
    if not os.access(there, os.W_OK | os.X_OK):
        raise PermissionError(errno.EACCES, f"nothing can be written here, and so not {folder}", str(there))
