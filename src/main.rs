//! The `abbe` command; everything is in [`abbe::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    abbe::cli::main()
}
