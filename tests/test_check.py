"""`koppel check`: every FMU and scene through its stiff and extreme cases."""

import json
import subprocess

import pytest
from koppel import paths

KOPPEL = paths.ROOT / "dist" / "bin" / "koppel"


def check(*arguments):
    """Exit code, answer and what was said of a check."""
    if not KOPPEL.is_file():
        pytest.fail(f"{KOPPEL} is missing: run scripts/build")
    command = [KOPPEL, "check", "--json", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=paths.ROOT, timeout=600)
    return done.returncode, json.loads(done.stdout), done.stderr


def test_no_case_is_wrong_and_none_is_left_out(tmp_path):
    table = tmp_path / "extremes.md"
    code, answer, said = check("--output", table)
    assert code == 0, said
    assert answer["wrong"] == 0
    outcomes = {target: set() for target in (row["target"] for row in answer["rows"])}
    for row in answer["rows"]:
        outcomes[row["target"]].add(row["outcome"])
        assert row["note"] or row["outcome"] == "right", "a refusal says why"
    for folder in [*(paths.ROOT / "fmus").iterdir(), *(paths.ROOT / "scenes").iterdir()]:
        if (folder / "Cargo.toml").is_file() or (folder / "check.toml").is_file():
            name = folder.name if folder.parent.name == "fmus" else f"scene {folder.name}"
            assert "right" in outcomes[name], name
    cases = lambda text: [line.split("|")[1:3] for line in text.splitlines() if line.startswith("| ")]
    shown = (paths.ROOT / "docs" / "extremes.md").read_text(encoding="utf-8")
    assert cases(table.read_text(encoding="utf-8")) == cases(shown), "koppel check --output docs/extremes.md"


PLAN = """fmu = "bushing"
stop = 0.1
H = [0.05]
methods = {{ rk4 = 1e-9 }}
watch = ["A.F.x"]
[[case]]
name = "one"
{}
"""


@pytest.mark.parametrize(
    "case, code, said",
    [
        ('set = { "A.r.x" = 1e-3 }\nvalues = { "A.F.x" = -1000.0 }', 0, ""),
        ('set = { "A.r.x" = 1e-3 }\nvalues = { "A.F.x" = -999.0 }', 3, "error above its bound"),
        ('set = { stiffness = -1.0 }\nexpect = "right"', 3, "stiffness = -1"),
        ('expect = "refused"', 3, "expected otherwise"),
        ("set = { stifness = 1.0 }", 2, "no variable \"stifness\""),
        ("stop = -1.0", 2, "stop = -1"),
        ("sto = 1.0", 2, "sto"),
    ],
)
def test_a_missed_expectation_is_wrong(tmp_path, case, code, said):
    (tmp_path / "check.toml").write_text(PLAN.format(case), encoding="utf-8")
    is_code, _, is_said = check(tmp_path, "--fmus", paths.ROOT / "dist" / "fmi3")
    assert is_code == code, is_said
    assert said in is_said
