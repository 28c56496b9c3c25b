//! `glimt completions`.

use super::{Cli, Outcome};
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use glimt::Result;

/// Flags of `glimt completions`.
#[derive(Args)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

impl CompletionsArgs {
    /// Generates the script.
    pub fn run(self) -> Result<Outcome> {
        let mut outcome = Outcome::default();
        clap_complete::generate(self.shell, &mut Cli::command(), "glimt", &mut outcome.stdout);
        Ok(outcome)
    }
}
