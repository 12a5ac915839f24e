"""`python -m koppel.scene_files [--check] [NAME...]`: the scenes of the library as `scenes/<name>/*.ssd`."""

import argparse
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from . import library, paths
from .scene import SceneError
from .scene.ssp import text

FOLDER = paths.ROOT / "scenes"


def outdated(names: Iterable[str]) -> Iterator[tuple[Path, str]]:
    """Files that are not what the library says, with the text that they should have."""
    for name in names:
        with library.scene(name) as scene:
            wanted = {FOLDER / name / file: text(variant) for file, variant in library.variants(scene).items()}
        for path, content in wanted.items():
            if not path.is_file() or path.read_text(encoding="utf-8") != content:
                yield path, content


def buildable() -> Iterator[str]:
    """Scenes of which all FMUs are there."""
    for name in library.SCENES:
        try:
            library.scene(name).close_fmus()
        except SceneError as missing:
            print(f"left out: {missing}", file=sys.stderr)
        else:
            yield name


def main() -> int:
    """Write or check; 1 if a checked file is not up to date."""
    parser = argparse.ArgumentParser(prog="scripts/scenes", description="Write the scene files of the library.")
    parser.add_argument("--check", action="store_true", help="compare only; fail if a file is not up to date")
    parser.add_argument("names", nargs="*", metavar="NAME", help="scenes; all that can be built unless given")
    options = parser.parse_args()
    unknown = set(options.names) - set(library.SCENES)
    if unknown:
        parser.error(f"no scene {', '.join(sorted(unknown))}; there are: {', '.join(library.SCENES)}")
    old = list(outdated(options.names or buildable()))
    for path, wanted in old:
        if options.check:
            print(f"{path.relative_to(paths.ROOT)} is not what koppel.library says: run scripts/scenes")
        else:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(wanted, encoding="utf-8")
            print(f"written: {path.relative_to(paths.ROOT)}")
    return 1 if options.check and old else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except SceneError as failed:
        sys.exit(f"error: {failed}")
