//! The `palpate` command: runs scenes and reads their logs.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
