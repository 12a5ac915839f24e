"""What a measurement was made with: machine, build, versions."""

import os
import platform
import shutil
import subprocess
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

from . import paths


def first_line(*command: str) -> str | None:
    """First line a program prints, None if it is not installed or fails."""
    if shutil.which(command[0]) is None:
        return None
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=60)
    return done.stdout.splitlines()[0] if done.returncode == 0 and done.stdout else None


def processor() -> str:
    """Name of the processor."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def commit() -> str:
    """Commit of the sources, marked if the tree has changes."""
    head = first_line("git", "rev-parse", "--short=12", "HEAD")
    if head is None:
        return "not known"
    return head + (" with local changes" if first_line("git", "status", "--porcelain") else "")


def facts() -> dict[str, str]:
    """Machine, build and host program of a measurement."""
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "commit": commit(),
        "processor": f"{processor()}, {os.cpu_count()} cores; one thread used",
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        "build": f"profile `fmu` (release, fat LTO, one codegen unit); {first_line('rustc', '--version') or 'rustc not found'}",
        "host": f"Python {platform.python_version()}, fmpy {version('fmpy')}, numpy {version('numpy')}; compiled loader `fmu-loader`",
    }
