//! The `glimt` program: parse → call the library → print → exit code. The only place that prints and exits.

mod cli;

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

#[global_allocator]
static ALLOCATOR: glimt::HugePages = glimt::HugePages;

fn main() -> ExitCode {
    let started = std::time::Instant::now();
    // Before there are other threads.
    glimt::prefer_wide_vectors();
    let context = cli::Context { started, interrupted: Arc::new(AtomicBool::new(false)), print };
    let command = match cli::Cli::try_parse() {
        Ok(command) => command,
        Err(answer) if !answer.use_stderr() => answer.exit(),
        Err(error) => {
            say(&format!("glimt: {} (see glimt --help)\n", cli::one_line(&error)));
            return ExitCode::from(2);
        }
    };
    let interrupted = context.interrupted.clone();
    let writes_files = command.writes_files();
    // Where a file may be half written the first Ctrl-C lets the work stop in order; otherwise, and the second time, the
    // process ends at once.
    let handler = ctrlc::set_handler(move || {
        if interrupted.swap(true, Ordering::Relaxed) || !writes_files {
            std::process::exit(130);
        }
    });
    if let Err(error) = handler {
        say(&format!("glimt: warning: Ctrl-C will not clean up: {error}\n"));
    }
    match command.run(&context) {
        Ok(outcome) => {
            let written = print(&outcome.stdout);
            say(&outcome.stderr);
            match written {
                // A reader that closes the pipe has what it wants.
                Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                    say(&format!("glimt: cannot write standard output: {error}\n"));
                    ExitCode::from(4)
                }
                _ => ExitCode::from(outcome.code),
            }
        }
        Err(error) => {
            say(&format!("glimt: {error}\n"));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Writes to standard output, at once.
fn print(results: &[u8]) -> std::io::Result<()> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(results)?;
    stdout.flush()
}

/// Writes to standard error; nobody can be told when that fails.
fn say(text: &str) {
    let _ = std::io::stderr().write_all(text.as_bytes());
}
