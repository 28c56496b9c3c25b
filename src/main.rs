//! The `glimt` program: parse → call the library → print → exit code. The only place that prints and exits.

#![allow(clippy::print_stderr)]

mod cli;

use clap::Parser;
use std::io::Write;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;

fn main() -> ExitCode {
    let context = cli::Context { started: std::time::Instant::now(), interrupted: Arc::new(AtomicBool::new(false)) };
    let interrupted = context.interrupted.clone();
    // The first Ctrl-C lets work stop in order, removing temporary files; the second ends the process.
    let handler = ctrlc::set_handler(move || {
        if interrupted.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
    });
    if let Err(error) = handler {
        eprintln!("glimt: warning: Ctrl-C will not clean up: {error}");
    }
    match cli::Cli::parse().run(&context) {
        Ok(outcome) => {
            eprint!("{}", outcome.stderr);
            let mut stdout = std::io::stdout().lock();
            match stdout.write_all(&outcome.stdout).and_then(|()| stdout.flush()) {
                Ok(()) => ExitCode::from(outcome.code),
                // A reader that closes the pipe has what it wants.
                Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::from(outcome.code),
                Err(error) => {
                    eprintln!("glimt: cannot write standard output: {error}");
                    ExitCode::from(4)
                }
            }
        }
        Err(error) => {
            eprintln!("glimt: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
