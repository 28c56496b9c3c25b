//! `glimt stress`.

use super::machine::MachineArgs;
use super::{command_line, Context, Outcome};
use clap::{Args, ValueEnum, ValueHint};
use glimt::render::{describe_device, Renderer, Sabotage};
use glimt::report::{stress_page, StressRow};
use glimt::stress::{failures, run, Case, Settings, CASES};
use glimt::vulkan::DeviceChoice;
use glimt::{Error, Options, Result};
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

/// Flags of `glimt stress`.
#[derive(Args)]
pub struct StressArgs {
    /// Only this case; may be given several times [default: all]
    #[arg(long = "case", value_name = "NAME", value_parser = case)]
    cases: Vec<&'static str>,
    /// Fewer values and rays: under a minute
    #[arg(long)]
    quick: bool,
    /// Print a JSON array of rows on standard output, nothing else
    #[arg(long)]
    json: bool,
    /// Write a page with a plot of each case
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    html: Option<PathBuf>,
    /// Write the rays of cases that trace them one by one, and the triangles they meet, for other programs
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    export: Option<PathBuf>,
    /// Write pictures of what each safeguard prevents: left with it, right without; runs no case
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pictures: Option<PathBuf>,
    /// List the cases
    #[arg(long)]
    list: bool,
    /// Switch a safeguard off, to see what it prevents
    #[arg(long, value_enum, hide = true)]
    sabotage: Option<SabotageChoice>,
    #[command(flatten)]
    machine: MachineArgs,
}

/// A safeguard.
#[derive(Clone, Copy, ValueEnum)]
enum SabotageChoice {
    FixedEpsilon,
    MollerTrumbore,
    SureOfThin,
    TightBoxes,
    NoRebase,
    PlainSums,
}

impl From<SabotageChoice> for Sabotage {
    fn from(choice: SabotageChoice) -> Self {
        match choice {
            SabotageChoice::FixedEpsilon => Self::FixedEpsilon,
            SabotageChoice::MollerTrumbore => Self::MollerTrumbore,
            SabotageChoice::SureOfThin => Self::SureOfThin,
            SabotageChoice::TightBoxes => Self::TightBoxes,
            SabotageChoice::NoRebase => Self::NoRebase,
            SabotageChoice::PlainSums => Self::PlainSums,
        }
    }
}

fn case(text: &str) -> Result<&'static str, String> {
    let names = CASES.map(|case| case.name);
    names.into_iter().find(|name| *name == text).ok_or_else(|| format!("no such case; there is {}", names.join(", ")))
}

impl StressArgs {
    /// Runs the cases, prints a row each as it is done.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        if self.list {
            let lines = CASES.map(|case| format!("{:<16} {}\n", case.name, case.about));
            return Ok(Outcome::text(lines.concat()));
        }
        self.machine.set_threads()?;
        if let Some(path) = &self.html {
            glimt::film::check_writable(path)?;
        }
        let device = self.machine.device.clone().map_or(DeviceChoice::Best, DeviceChoice::Named);
        let options = Options {
            interrupted: context.interrupted.clone(),
            sabotage: self.sabotage.map(Into::into),
            ..Options::default()
        };
        if let Some(folder) = &self.export {
            std::fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))?;
        }
        let settings = Settings { quick: self.quick, export: self.export.clone() };
        let renderer = Renderer::new(&device, self.machine.validate)?;
        if let Some(folder) = &self.pictures {
            let paths = failures::write(&renderer, &options, folder)?;
            return Ok(Outcome::text(paths.iter().map(|path| format!("{}\n", path.display())).collect::<String>()));
        }
        let cases: Vec<Case> =
            CASES.into_iter().filter(|case| self.cases.is_empty() || self.cases.contains(&case.name)).collect();
        // On a terminal rows appear as they are found; a pipe gets all of them in the end, or none.
        let is_live = !self.json && std::io::stderr().is_terminal() && !std::io::stdout().is_terminal();
        let mut show = |row: &StressRow| {
            if is_live {
                let _ = writeln!(std::io::stderr(), "{}", row.text());
            }
        };
        let rows = run(&renderer, &cases, &settings, &options, &mut show)?;
        if self.machine.validate && !renderer.device().instance.messages().is_empty() {
            return Err(Error::Validation(renderer.device().instance.messages()));
        }
        let device = describe_device(renderer.device());
        let failed = rows.iter().filter(|row| !row.holds).count();
        if let Some(path) = &self.html {
            let about = CASES.map(|case| (case.name, case.about));
            let subject = format!("{} ({}), {}", device.name, device.driver, command_line());
            glimt::film::write_whole(path, stress_page(&rows, &about, &subject).as_bytes())?;
        }
        let mut outcome = if self.json { Outcome::json(&rows)? } else { Outcome::default() };
        if !self.json {
            let lines = rows.iter().map(|row| row.text() + "\n").collect::<String>();
            let rays: u64 = rows.iter().map(|row| row.rays).sum();
            let ms: f64 = rows.iter().map(|row| row.ms).sum();
            outcome.stdout = format!(
                "{}\n{lines}{} of {} values hold; {rays} rays and pixels judged in {:.1} s on {} ({})\n",
                StressRow::HEADINGS,
                rows.len() - failed,
                rows.len(),
                ms / 1e3,
                device.name,
                device.driver
            )
            .into_bytes();
        }
        outcome.code = u8::from(failed > 0);
        Ok(outcome)
    }
}
