//! The program `koppel`.

use std::process::ExitCode;

fn main() -> ExitCode {
    host::cli::main()
}
