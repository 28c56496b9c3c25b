//! `glimt batch`: JSON jobs, a line each, on standard input → JSON answers, a line each, on standard output, in their order.
//!
//! One device and its kernels serve all jobs. A job that fails, be it by a panic, is an answer like any other.

use super::job::{self, Job, LimitArgs};
use super::lines::lines;
use super::machine::MachineArgs;
use super::render::RenderArgs;
use super::{stop_if_interrupted, Context, Outcome};
use clap::Args;
use glimt::render::Renderer;
use glimt::vulkan::DeviceChoice;
use glimt::{Error, Report, Result};
use serde::Serialize;
use serde_json::Value;
use std::any::Any;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::Arc;
use std::time::{Duration, Instant};

const EXAMPLES: &str = "\
A job is a JSON object in one line. Its keys are the long options of `glimt render`, with - or _, and
  scene      a file or a built-in scene; scene-choice is what --scene is for render
  output     the file to write [default: as for render]
  timeout    seconds that the job may take
  id         anything: the answer has it too
Values are strings, numbers, true for a flag, false or null for none; a size may be [w, h], a vector [x, y, z].

Examples:
  {\"scene\": \"a.glb\", \"output\": \"a.png\", \"size\": \"256x256\", \"spp\": 4, \"background\": \"transparent\"}
  {\"id\": 7, \"scene\": \"b.glb\", \"output\": \"b.png\", \"size\": [512, 384], \"orbit\": [30, 60, 4], \"timeout\": 10}

Answers, in the order of the jobs, each as soon as its job is done:
  {\"id\":7,\"ok\":true,\"line\":2,\"output\":\"b.png\",\"report\":{…}}       the report is that of glimt render --json
  {\"id\":null,\"ok\":false,\"line\":3,\"error\":\"c.glb: the file is empty\",\"exit_code\":2}
exit_code is what glimt render would end with; 124 for a timeout, 3 for a job that panicked.

  ls *.glb | jq -Rc '{scene: ., size: \"256x256\"}' | glimt batch --timeout 30 --max-triangles 5000000

Exit codes: 0 all jobs done · 1 some failed · 2 bad usage · 3 no usable device · 4 answers not written · 130 interrupted";

/// Flags of `glimt batch`.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub struct BatchArgs {
    #[command(flatten)]
    limits: LimitArgs,
    #[command(flatten)]
    machine: MachineArgs,
}

/// How often Ctrl-C and timeouts are looked at.
const TICK: Duration = Duration::from_millis(10);

/// Why there is no picture.
struct Fault {
    message: String,
    exit_code: u8,
}

impl Fault {
    /// Bad usage.
    fn usage(message: String) -> Self {
        Self { message, exit_code: 2 }
    }
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self { message: error.to_string(), exit_code: error.exit_code() }
    }
}

/// What is said of a job.
#[derive(Serialize)]
struct Answer<'a> {
    id: &'a Value,
    ok: bool,
    line: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<&'a Report>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    exit_code: Option<u8>,
}

impl BatchArgs {
    /// Answers jobs until there are no more.
    pub fn run(self, context: &Context) -> Result<Outcome> {
        self.machine.set_threads()?;
        let mut worker = Worker { choice: self.machine.choice(), validate: self.machine.validate, renderer: None };
        worker.open()?;
        let lines = lines();
        let mut code = 0;
        while !context.interrupted.load(Ordering::Relaxed) {
            let line = match lines.recv_timeout(TICK) {
                Ok(line) => line,
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => return Ok(Outcome { code, ..Outcome::default() }),
            };
            let (id, job) = match line.text {
                Ok(text) => job::read(&text, &self.limits),
                Err(fault) => (Value::Null, Err(fault)),
            };
            let done = job.map_err(Fault::usage).and_then(|job| worker.run(&job, &context.interrupted));
            if done.is_err() && context.interrupted.load(Ordering::Relaxed) {
                break;
            }
            code |= u8::from(done.is_err());
            if !context.tell(&answer(&id, line.number, &done)?)? {
                // Whoever asked is gone.
                return Ok(Outcome { code, ..Outcome::default() });
            }
        }
        Err(Error::Interrupted)
    }
}

/// An answer's line.
fn answer(id: &Value, line: u64, done: &Result<Report, Fault>) -> Result<Vec<u8>> {
    let (report, fault) = (done.as_ref().ok(), done.as_ref().err());
    let answer = Answer {
        id,
        ok: report.is_some(),
        line,
        output: report.map(|report| report.image.path.as_str()),
        report,
        error: fault.map(|fault| fault.message.as_str()),
        exit_code: fault.map(|fault| fault.exit_code),
    };
    Ok(Outcome::json(&answer)?.stdout)
}

/// Who does the jobs.
struct Worker {
    /// `None` for the reference renderer.
    choice: Option<DeviceChoice>,
    validate: bool,
    /// Open unless the last job broke it.
    renderer: Option<Renderer>,
}

impl Worker {
    /// Opens the device if it is not.
    fn open(&mut self) -> Result<()> {
        if let (Some(choice), None) = (&self.choice, &self.renderer) {
            self.renderer = Some(Renderer::new(choice, self.validate)?);
        }
        Ok(())
    }

    /// Does a job, until its time is over or the user wants to stop.
    fn run(&mut self, job: &Job, interrupted: &AtomicBool) -> Result<Report, Fault> {
        let started = Instant::now();
        let limit = Limit { timeout: job.timeout, started, stop: Arc::default() };
        let done = limit.watch(interrupted, || {
            guard(|| {
                self.open()?;
                self.picture(&job.render, &limit)
            })
        });
        self.judge(done, &limit)
    }

    /// Forgets a renderer that can do no more pictures; says what was wrong.
    fn judge(&mut self, done: Result<Result<Report>, String>, limit: &Limit) -> Result<Report, Fault> {
        match done {
            Ok(Ok(report)) => Ok(report),
            Ok(Err(Error::Interrupted)) => Err(limit.fault()),
            Ok(Err(error)) => {
                // A device that is lost stays so, and messages of the validation layers are those of all pictures so far.
                if matches!(error, Error::Vulkan { .. } | Error::Validation(_)) {
                    self.renderer = None;
                }
                Err(error.into())
            }
            Err(panic) => {
                self.renderer = None;
                Err(Fault { message: format!("this is a fault of glimt: {panic}"), exit_code: 3 })
            }
        }
    }

    /// As `glimt render` makes it, on the device that is open.
    fn picture(&self, render: &RenderArgs, limit: &Limit) -> Result<Report> {
        let mut options = render.options(limit.started)?;
        options.validate = self.validate;
        options.interrupted = limit.stop.clone();
        let may_finish = || if limit.is_over() { Err(Error::Interrupted) } else { stop_if_interrupted(&options) };
        let mut report =
            render.picture(&options, limit.started, &mut Vec::new(), may_finish, || match &self.renderer {
                Some(renderer) => render.on_renderer(renderer, &options),
                None => render.on_reference(&options),
            })?;
        // It was open before the job.
        report.times_ms.device = 0.0;
        Ok(report)
    }
}

/// The time a job may take.
struct Limit {
    timeout: Option<Duration>,
    started: Instant,
    /// Set when the job must stop.
    stop: Arc<AtomicBool>,
}

impl Limit {
    fn is_over(&self) -> bool {
        self.timeout.is_some_and(|timeout| self.started.elapsed() >= timeout)
    }

    /// Does some work, and tells it to stop when its time is over or the user wants to.
    fn watch<T>(&self, interrupted: &AtomicBool, work: impl FnOnce() -> T) -> T {
        let (working, done) = mpsc::channel::<()>();
        std::thread::scope(|threads| {
            threads.spawn(move || loop {
                let left = self.timeout.map_or(TICK, |timeout| timeout.saturating_sub(self.started.elapsed()));
                let wait = if self.stop.load(Ordering::Relaxed) { TICK } else { left.min(TICK) };
                if done.recv_timeout(wait) == Err(RecvTimeoutError::Disconnected) {
                    return;
                }
                if self.is_over() || interrupted.load(Ordering::Relaxed) {
                    self.stop.store(true, Ordering::Relaxed);
                }
            });
            let result = work();
            drop(working);
            result
        })
    }

    /// Why a job was stopped.
    fn fault(&self) -> Fault {
        match self.timeout {
            Some(timeout) if self.is_over() => {
                let seconds = timeout.as_secs_f64();
                Fault {
                    message: format!("stopped after its timeout of {seconds} s: nothing was written"),
                    exit_code: 124,
                }
            }
            _ => Error::Interrupted.into(),
        }
    }
}

/// Does some work; a panic is a message.
fn guard<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic: Box<dyn Any + Send>| {
        let text = panic.downcast_ref::<String>().map(String::as_str);
        text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("it panicked").to_owned()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_and_a_lost_device_are_answers_and_the_renderer_is_made_anew() {
        let mut worker = Worker { choice: Some(DeviceChoice::Best), validate: false, renderer: None };
        let limit = Limit { timeout: None, started: Instant::now(), stop: Arc::default() };
        let code = |done: Result<Report, Fault>| done.err().map(|fault| (fault.exit_code, fault.message));
        worker.open().unwrap();
        let usage = worker.judge(Ok(Err(Error::Usage("no".into()))), &limit);
        assert_eq!((code(usage), worker.renderer.is_some()), (Some((2, "no".into())), true));
        let panicked = worker.judge(guard(|| panic!("at {}", 7)), &limit);
        let said = "this is a fault of glimt: at 7".to_owned();
        assert_eq!((code(panicked), worker.renderer.is_none()), (Some((3, said)), true));
        worker.open().unwrap();
        let lost = Error::Vulkan { what: "submit".into(), result: ash::vk::Result::ERROR_DEVICE_LOST };
        let lost = worker.judge(Ok(Err(lost)), &limit);
        assert_eq!((code(lost).map(|(code, _)| code), worker.renderer.is_none()), (Some(3), true));
        let job = job::read(br#"{"size": "8x8", "output": "/nonexistent/a.png"}"#, &LimitArgs::default()).1;
        let job = job.unwrap_or_else(|fault| panic!("{fault}"));
        let refused = worker.run(&job, &AtomicBool::new(false));
        assert_eq!((code(refused).map(|(code, _)| code), worker.renderer.is_some()), (Some(4), true));
    }

    #[test]
    fn work_is_told_to_stop() {
        let stops = |timeout, interrupted| {
            let limit = Limit { timeout, started: Instant::now(), stop: Arc::default() };
            let told = limit.watch(&AtomicBool::new(interrupted), || {
                while !limit.stop.load(Ordering::Relaxed) && limit.started.elapsed() < Duration::from_secs(20) {
                    std::thread::yield_now();
                }
                limit.stop.load(Ordering::Relaxed)
            });
            (told, limit.fault().exit_code)
        };
        assert_eq!(stops(Some(Duration::from_millis(20)), false), (true, 124));
        assert_eq!(stops(Some(Duration::MAX), true), (true, 130));
        assert_eq!(stops(None, true), (true, 130));
    }
}
