#!/usr/bin/env python3
"""Write tests/reference/suspension/oracle_<case>.csv.

python tests/oracle/make.py            all cases (about five minutes, nearly all for the stiff bushings)
python tests/oracle/make.py drop tiny  only these
"""

import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS))

from oracle.cases import CASES  # noqa: E402  (needs the path above)

FOLDER = TESTS / "reference" / "suspension"

HEAD = """\
# source: tests/oracle/make.py: planar double wishbone as free bodies with Lagrange multipliers (tests/oracle/wishbone.py),
# source: integrated in minimal coordinates with DOP853, rtol {rtol:g}, restarted at every sample; it reproduces
# source: wishbone_paper.csv to 1e-14 rad and 2e-11 N. Independent of the product's code and formulation.
# case: {note}
# columns: as wishbone_paper.csv; SI units, angles in rad
"""


def main(names):
    unknown = [name for name in names if name not in CASES]
    if unknown:
        sys.exit(f"unknown case: {', '.join(unknown)}; known: {', '.join(CASES)}")
    for name in names or CASES:
        case = CASES[name]
        table = case.table()
        path = FOLDER / f"oracle_{name}.csv"
        with path.open("w", encoding="ascii") as file:
            file.write(HEAD.format(rtol=case.rtol, note=case.note))
            file.write(",".join(case.model.COLUMNS) + "\n")
            file.writelines(",".join(f"{value:.15g}" for value in row) + "\n" for row in table)
        print(f"{path.relative_to(TESTS.parent)}: {len(table)} rows", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
