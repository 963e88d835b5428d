//! The `quietcut` command.
use std::process::ExitCode;

fn main() -> ExitCode {
    quietcut::cli::main()
}
