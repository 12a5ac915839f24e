"""Where things are in the repository."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DIST = ROOT / "dist"
OUT = ROOT / "out"
REFERENCE = ROOT / "tests" / "reference"


def fmu(name: str, fmi: int = 3) -> Path:
    """The packed archive of `name` for this version of FMI; it must have been built."""
    path = DIST / f"fmi{fmi}" / f"{name}.fmu"
    if not path.is_file():
        raise FileNotFoundError(f"{path.relative_to(ROOT)} is missing: run scripts/build {name}")
    return path


def loader() -> Path:
    """The compiled loader; it must have been built."""
    path = DIST / "bin" / "fmu-loader"
    if not path.is_file():
        raise FileNotFoundError(f"{path.relative_to(ROOT)} is missing: run scripts/build")
    return path
