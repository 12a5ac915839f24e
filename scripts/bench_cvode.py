#!/usr/bin/env python3
"""Work-precision of the integrators beside SUNDIALS CVODE, in one run on one machine.

    python3 -m venv /tmp/bench && /tmp/bench/bin/pip install -r scripts/requirements-bench.txt
    /tmp/bench/bin/python scripts/bench_cvode.py [--csv FILE]

CVODE (BDF, dense, exact Jacobian) comes compiled with the package scikit-sundae; right-hand sides, Jacobians and the
timing loop are C, compiled here with gcc, so that no Python runs inside the time measured. A CVODE run is CVodeReInit and
CVode to the end; memory and solver objects exist before. The right-hand sides are those of
`common/integrators/tests/common/stiff.rs`; reference solutions and errors are computed here on their own.
"""

import argparse
import csv
import ctypes
import datetime
import io
import pathlib
import platform
import subprocess
import sys
import tempfile

import numpy as np
import sksundae

ROOT = pathlib.Path(__file__).resolve().parent.parent
WANTED = 1e-6  # final error at which times are compared

DRIVER = r"""
#include <math.h>
#include <time.h>

typedef void *P;
P N_VNew_Serial(long n, P ctx);
double *N_VGetArrayPointer(P v);
int SUNContext_Create(int comm, P *ctx);
P SUNDenseMatrix(long m, long n, P ctx);
double *SUNDenseMatrix_Column(P a, long j);
P SUNLinSol_Dense(P y, P a, P ctx);
P CVodeCreate(int lmm, P ctx);
typedef int (*Rhs)(double, P, P, P);
typedef int (*Jac)(double, P, P, P, P, P, P, P);
int CVodeInit(P mem, Rhs f, double t, P y);
int CVodeReInit(P mem, double t, P y);
int CVodeSVtolerances(P mem, double rtol, P atol);
int CVodeSetLinearSolver(P mem, P ls, P a);
int CVodeSetJacFn(P mem, Jac j);
int CVodeSetMaxNumSteps(P mem, long n);
int CVode(P mem, double t_end, P y, double *t, int task);
int CVodeGetNumSteps(P mem, long *n);
int CVodeGetNumErrTestFails(P mem, long *n);
int CVodeGetNumRhsEvals(P mem, long *n);
int CVodeGetNumJacEvals(P mem, long *n);
int CVodeGetNumLinSolvSetups(P mem, long *n);

static double eps;

static int vdp(double t, P y_, P f_, P u) {
    const double *y = N_VGetArrayPointer(y_);
    double *f = N_VGetArrayPointer(f_);
    f[0] = y[1];
    f[1] = ((1.0 - y[0] * y[0]) * y[1] - y[0]) / eps;
    return 0;
}

static int vdp_jac(double t, P y_, P f, P a, P u, P t1, P t2, P t3) {
    const double *y = N_VGetArrayPointer(y_);
    double *c0 = SUNDenseMatrix_Column(a, 0), *c1 = SUNDenseMatrix_Column(a, 1);
    c0[0] = 0.0;
    c0[1] = (-2.0 * y[0] * y[1] - 1.0) / eps;
    c1[0] = 1.0;
    c1[1] = (1.0 - y[0] * y[0]) / eps;
    return 0;
}

static int pendulum(double t, P y_, P f_, P u) {
    const double *y = N_VGetArrayPointer(y_);
    double *f = N_VGetArrayPointer(f_);
    f[0] = y[1];
    f[1] = -sin(y[0]);
    return 0;
}

static int pendulum_jac(double t, P y_, P f, P a, P u, P t1, P t2, P t3) {
    const double *y = N_VGetArrayPointer(y_);
    double *c0 = SUNDenseMatrix_Column(a, 0), *c1 = SUNDenseMatrix_Column(a, 1);
    c0[0] = 0.0;
    c0[1] = -cos(y[0]);
    c1[0] = 1.0;
    c1[1] = 0.0;
    return 0;
}

enum { N = 10 };

static void second(const double *w, double *d) {
    for (int i = 0; i < N; i++)
        d[i] = 121.0 * ((i > 0 ? w[i - 1] : 0.0) - 2.0 * w[i] + (i + 1 < N ? w[i + 1] : 0.0));
}

static void bend(const double *x, double weight, double *f) {
    double s[N], d[N], b[N];
    for (int i = 0; i < N; i++) s[i] = x[i] + 1e-3 * x[N + i];
    second(s, d);
    second(d, b);
    for (int i = 0; i < N; i++) {
        f[i] = x[N + i];
        f[N + i] = -100.0 * b[i] - weight;
    }
}

static int beam(double t, P y, P f, P u) {
    bend(N_VGetArrayPointer(y), 9.81, N_VGetArrayPointer(f));
    return 0;
}

static int beam_jac(double t, P y, P f, P a, P u, P t1, P t2, P t3) {
    for (int j = 0; j < 2 * N; j++) {
        double unit[2 * N] = {0.0};
        unit[j] = 1.0;
        bend(unit, 0.0, SUNDenseMatrix_Column(a, j));
    }
    return 0;
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

/* Shortest time of many runs [s]; negative: CVODE failed. x: start, then end. */
double run(int problem, double parameter, int n, double *x, double t_end, double rtol, const double *atol,
           double patience, long *counts) {
    static const Rhs rhs[] = {vdp, pendulum, beam};
    static const Jac jac[] = {vdp_jac, pendulum_jac, beam_jac};
    P ctx;
    eps = parameter;
    if (SUNContext_Create(0, &ctx)) return -1.0;
    P y = N_VNew_Serial(n, ctx), tol = N_VNew_Serial(n, ctx), a = SUNDenseMatrix(n, n, ctx);
    double *v = N_VGetArrayPointer(y);
    for (int i = 0; i < n; i++) {
        v[i] = x[i];
        N_VGetArrayPointer(tol)[i] = atol[i];
    }
    P mem = CVodeCreate(2, ctx);
    if (CVodeInit(mem, rhs[problem], 0.0, y) || CVodeSVtolerances(mem, rtol, tol) ||
        CVodeSetLinearSolver(mem, SUNLinSol_Dense(y, a, ctx), a) || CVodeSetJacFn(mem, jac[problem]) ||
        CVodeSetMaxNumSteps(mem, 100000000))
        return -2.0;
    double best = 1e99, begin = now(), t;
    for (int runs = 0; runs < 5 || now() - begin < patience; runs++) {
        for (int i = 0; i < n; i++) v[i] = x[i];
        double start = now();
        if (CVodeReInit(mem, 0.0, y) || CVode(mem, t_end, y, &t, 1) < 0) return -3.0;
        double time = now() - start;
        if (time < best) best = time;
    }
    for (int i = 0; i < n; i++) x[i] = v[i];
    CVodeGetNumSteps(mem, counts);
    CVodeGetNumErrTestFails(mem, counts + 1);
    CVodeGetNumRhsEvals(mem, counts + 2);
    CVodeGetNumJacEvals(mem, counts + 3);
    CVodeGetNumLinSolvSetups(mem, counts + 4);
    return best; /* contexts are few and stay */
}
"""


def compiled(folder):
    """The driver, linked with the libraries inside the package."""
    package = pathlib.Path(sksundae.__file__).resolve().parent
    libraries = package.parent / "scikit_sundae.libs"
    parts = ["core", "cvode", "nvecserial", "sunmatrixdense", "sunlinsoldense"]
    found = [next(iter(libraries.glob(f"libsundials_{part}-*.so*")), None) for part in parts]
    if None in found:
        sys.exit(f"no SUNDIALS libraries in {libraries}: another build of scikit-sundae than its wheel?")
    source, library = folder / "driver.c", folder / "driver.so"
    source.write_text(DRIVER)
    subprocess.run(
        ["gcc", "-O3", "-shared", "-fPIC", "-o", library, source, *found, f"-Wl,-rpath,{libraries}", "-lm"], check=True
    )
    function = ctypes.CDLL(str(library)).run
    function.restype = ctypes.c_double
    return function


def beam_solution(t):
    """Modes of the pinned beam by numpy's eigenvectors of its 20 x 20 matrix: not the formula of the Rust tests."""
    n = 10
    d = 121.0 * (np.diag(np.ones(n - 1), -1) - 2.0 * np.eye(n) + np.diag(np.ones(n - 1), 1))
    k = 100.0 * d @ d
    a = np.block([[np.zeros((n, n)), np.eye(n)], [-k, -1e-3 * k]])
    rest = np.concatenate([np.linalg.solve(k, np.full(n, -9.81)), np.zeros(n)])
    values, vectors = np.linalg.eig(a)
    start = np.zeros(2 * n)
    start[3] = 0.01
    modes = np.linalg.solve(vectors, (start - rest).astype(complex))
    return start, rest + (vectors @ (np.exp(values * t) * modes)).real


def quarter_period(amplitude):
    a, b = 1.0, np.cos(amplitude / 2)
    for _ in range(10):
        a, b = (a + b) / 2, np.sqrt(a * b)
    return np.pi / 2 / a


def problems():
    """Name: number, parameter, start, end time, solution, scale of the error, nominal values."""
    one = np.ones(2)
    published = np.array([1.706167732170483, -0.8928097010247975])  # IVP Test Set, VDPOL
    mild = np.array([1.7632345402034, -0.83568868167767])  # SciPy's DOP853 and Radau at 3e-14
    start, beam = beam_solution(1.0)
    w, v = np.abs(beam[:10]).max(), np.abs(beam[10:]).max()
    return {
        "vdp_1e-3": (0, 1e-3, np.array([2.0, 0.0]), 2.0, mild, np.abs(mild), one),
        "vdp_1e-6": (0, 1e-6, np.array([2.0, 0.0]), 2.0, published, np.abs(published), one),
        "pendulum": (1, 0.0, np.array([2.0, 0.0]), 4 * quarter_period(2.0), np.array([2.0, 0.0]), 2 * one, one),
        "beam": (2, 0.0, start, 1.0, beam, np.repeat([w, v], 10), np.repeat([1e-3, 1.0], 10)),
    }


def cvode(run, name, problem, patience):
    number, parameter, start, t_end, exact, scale, nominal = problem
    double = ctypes.c_double
    for half in range(6, 27):
        rtol = 10.0 ** (-half / 2)
        x = (double * len(start))(*start)
        atol = (double * len(start))(*(rtol * nominal))
        counts = (ctypes.c_long * 5)()
        time = run(
            number, double(parameter), len(start), x, double(t_end), double(rtol), atol, double(patience), counts
        )
        if time < 0:
            continue  # tolerance beyond its reach
        error = np.abs((np.array(x) - exact) / scale).max()
        yield [name, "cvode", f"{rtol:.1e}", "", f"{error:.3e}", f"{1e6 * time:.3f}", *counts]


def cheapest(rows, accuracy=WANTED):
    """Method: shortest time of a run whose error is at most `accuracy`."""
    best = {}
    for row in rows:
        if float(row[4]) <= accuracy:
            best[row[1]] = min(best.get(row[1], np.inf), float(row[5]))
    return best


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("--csv", type=pathlib.Path, help="write the table there")
    arguments.add_argument("--patience", type=float, default=0.15, help="time per line of CVODE [s]")
    arguments = arguments.parse_args()
    command = ["cargo", "run", "--quiet", "--release", "-p", "integrators", "--example", "work_precision"]
    subprocess.run([*command[:1], "build", *command[2:]], cwd=ROOT, check=True)
    with tempfile.TemporaryDirectory() as folder:
        run = compiled(pathlib.Path(folder))
        tables = {}
        for name, problem in problems().items():  # one after the other, so that a slow minute hits both
            text = subprocess.run([*command, "--", name], cwd=ROOT, check=True, capture_output=True, text=True).stdout
            header, *rows = csv.reader(io.StringIO(text))
            tables[name] = rows + list(cvode(run, name, problem, arguments.patience))
    if arguments.csv:
        commit = subprocess.run(["git", "rev-parse", "--short", "HEAD"], cwd=ROOT, capture_output=True, text=True).stdout
        with arguments.csv.open("w", newline="") as file:
            file.write(f"# {datetime.date.today()}, commit {commit.strip()}, {processor()}\n")
            csv.writer(file).writerows([header, *(row for rows in tables.values() for row in rows)])
    print(f"Shortest time [microseconds] to a final error of {WANTED:.0e}, and how many times longer CVODE takes:")
    for name, rows in tables.items():
        best = cheapest(rows)
        print(f"\n{name}")
        for method, time in sorted(best.items(), key=lambda item: item[1]):
            print(f"  {method:12}{time:12.2f}{best.get('cvode', np.nan) / time:10.1f}")


def processor():
    lines = pathlib.Path("/proc/cpuinfo")
    names = [line.split(":")[1].strip() for line in lines.read_text().splitlines() if line.startswith("model name")] if (
        lines.exists()
    ) else []
    return names[0] if names else platform.processor() or platform.machine()


if __name__ == "__main__":
    main()
