//! `quietcut completions`: the script with which a shell completes verbs and options.

use std::io::{self, Write};

use clap::Command;
use clap_complete::Shell;

use super::Error;

/// Prints the script with which a shell completes verbs and options.
///
/// bash: quietcut completions bash > ~/.local/share/bash-completion/completions/quietcut. zsh: write it as _quietcut
/// into a folder of $fpath. fish: quietcut completions fish > ~/.config/fish/completions/quietcut.fish.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  quietcut completions bash")]
pub struct Args {
    /// The shell.
    #[arg(value_name = "SHELL")]
    shell: Shell,
}

/// Runs the verb: `command` is the definition of all verbs and options.
pub fn run(args: Args, command: &mut Command) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, command, "quietcut", &mut script);
    io::stdout()
        .lock()
        .write_all(&script)
        .map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe => Error::ReaderGone,
            _ => Error::other(format!("standard output: {error}")),
        })
}
