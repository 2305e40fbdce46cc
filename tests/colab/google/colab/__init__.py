"""A stand-in for Google Colab's package: the names that the kit asks for, with files in the place of page and Drive."""

from pathlib import Path
from types import SimpleNamespace


def mount(place: str) -> None:
    """Show a Drive at a place; where nobody may write there, as in a bare Debian, beside the notebook."""
    import labcourse

    try:
        Path(place).mkdir(parents=True, exist_ok=True)
    except OSError:
        labcourse.DRIVE = Path.cwd() / "drive"
    print(f"Mounted at {labcourse.DRIVE}")


drive = SimpleNamespace(mount=mount)
