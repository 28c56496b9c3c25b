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
    let command = match cli::Cli::try_parse() {
        Ok(command) => command,
        Err(answer) if !answer.use_stderr() => answer.exit(),
        Err(error) => {
            eprintln!("glimt: {}", one_line(&error));
            return ExitCode::from(2);
        }
    };
    match command.run(&context) {
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

/// What is wrong with the command line and the tip, if there is one, without the usage.
fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines =
        text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage") && !line.starts_with("For more"));
    let said: Vec<&str> =
        lines.filter(|line| !line.is_empty()).map(|line| line.trim_start_matches("error: ")).collect();
    format!("{} (see glimt --help)", said.join("; "))
}
