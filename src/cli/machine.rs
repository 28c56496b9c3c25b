//! Flags that choose the machine that computes, the same for every command that does.

use clap::Args;
use glimt::vulkan::DeviceChoice;
use glimt::{Error, Result};

/// Device and threads.
#[derive(Args)]
pub struct MachineArgs {
    /// Device by index or part of its name; `render` and `batch` also know `reference`, the slow f64 renderer [default: the best]
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Switch the Vulkan validation layers on; any message of theirs is an error
    #[arg(long)]
    pub validate: bool,
    /// Threads for host work and software Vulkan [default: all]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
}

impl MachineArgs {
    /// The device to open; `None` for the reference renderer, which needs none.
    pub fn choice(&self) -> Option<DeviceChoice> {
        match self.device.as_deref() {
            Some("reference") => None,
            Some(name) => Some(DeviceChoice::Named(name.into())),
            None => Some(DeviceChoice::Best),
        }
    }

    /// Sets the number of threads, of host work and of software Vulkan.
    ///
    /// # Errors
    /// `Usage` when there can be no such number.
    pub fn set_threads(&self) -> Result<()> {
        let Some(threads) = self.threads else { return Ok(()) };
        let refuse = |why: String| Error::Usage(format!("--threads {threads}: {why}"));
        if !(1..=1024).contains(&threads) {
            return Err(refuse("must be 1 to 1024".into()));
        }
        // Mesa's software Vulkan reads this when the device is opened; until then only Ctrl-C has a thread, which waits.
        std::env::set_var("LP_NUM_THREADS", threads.to_string());
        rayon::ThreadPoolBuilder::new().num_threads(threads).build_global().map_err(|error| refuse(error.to_string()))
    }
}
