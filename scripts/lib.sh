# shellcheck shell=bash disable=SC2034 # the scripts that source this file use the names
# Shared by the scripts. After sourcing, the working directory is the root of the repository.

NEXTEST_VERSION=0.9.143
FMI_VERSIONS=(2 3)

# a relative CARGO_TARGET_DIR counts from where the script was called, as it does for cargo
if [[ -n ${CARGO_TARGET_DIR:-} ]]; then
    mkdir -p "$CARGO_TARGET_DIR"
    CARGO_TARGET_DIR=$(cd "$CARGO_TARGET_DIR" && pwd)
    export CARGO_TARGET_DIR
fi

cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit
ROOT=$PWD
TARGET=${CARGO_TARGET_DIR:-$ROOT/target}
PYTHON=${PYTHON:-python3}

# the Python package scripts/koppel is used from here, it is not installed
export PYTHONPATH="$ROOT/scripts${PYTHONPATH:+:$PYTHONPATH}"
export PATH="$ROOT/.tools/bin:$PATH"

say() {
    printf '== %s\n' "$*"
}

die() {
    printf 'error: %s\n' "$*" >&2
    exit 1
}

need_python() {
    command -v "$PYTHON" >/dev/null ||
        die "$PYTHON is missing: install Python 3.11 or newer (Debian: apt-get install python3 python3-venv), or set PYTHON"
    "$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' ||
        die "$("$PYTHON" --version) is too old: Python 3.11 or newer is needed; set PYTHON to one"
    "$PYTHON" -c 'import venv, ensurepip' 2>/dev/null ||
        die "$PYTHON cannot make virtual environments: Debian needs the package python3-venv"
}

need_cargo() {
    command -v cargo >/dev/null || die "cargo is missing: install Rust (the rustup installer, or Debian: apt-get install cargo)"
    command -v cc >/dev/null || die "cc is missing: a C linker is needed (Debian: apt-get install gcc libc6-dev)"
}

# names of all FMUs, one per line
fmu_names() {
    local manifest
    for manifest in fmus/*/Cargo.toml; do
        [[ -e $manifest ]] || continue
        basename "$(dirname "$manifest")"
    done
}

# fmu_names into the array FMUS; at least one must exist
read_fmus() {
    mapfile -t FMUS < <(fmu_names)
    ((${#FMUS[@]} > 0)) || die "no FMU in fmus/"
}

# locked_venv FOLDER LOCK: a virtual environment with exactly the packages of LOCK; made again when one of them changes
locked_venv() {
    local folder=$1 lock=$2 stamp
    stamp="$(cksum <"$lock") $("$PYTHON" --version)"
    [[ ! -f $folder/.locked || $(<"$folder/.locked") != "$stamp" ]] || return 0
    say "Python packages into $folder"
    rm -rf "$folder"
    "$PYTHON" -m venv "$folder"
    "$folder/bin/python" -m pip install --quiet --require-hashes --only-binary=:all: -r "$lock" ||
        die "the packages of $lock could not be installed; the lines above say why (network, or no wheels for this platform)"
    printf '%s' "$stamp" >"$folder/.locked"
}

# venv_python ARGS...: the Python of the virtual environment
venv_python() {
    .venv/bin/python "$@"
}
