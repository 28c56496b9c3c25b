//! `glimt devices`.

use super::Outcome;
use clap::Args;
use glimt::vulkan::{Device, DeviceInfo, Instance};
use glimt::Result;
use serde_json::{json, Value};
use std::fmt::Write;

/// Flags of `glimt devices`.
#[derive(Args)]
pub struct DevicesArgs {
    /// Print a JSON array
    #[arg(long)]
    json: bool,
}

impl DevicesArgs {
    /// Lists what the loader finds.
    pub fn run(self) -> Result<Outcome> {
        let instance = Instance::new(false)?;
        let devices = Device::list(&instance)?;
        if self.json {
            return Outcome::json(&devices.iter().enumerate().map(object).collect::<Vec<_>>());
        }
        let mut text = String::new();
        for (index, device) in devices.iter().enumerate() {
            let usable = device.unusable.as_ref().map_or(String::new(), |why| format!(" (unusable: {why})"));
            let _ = writeln!(
                text,
                "{index}: {}, {}, Vulkan {}, {}, subgroups of {}{usable}",
                device.name,
                device.kind.name(),
                device.api,
                device.driver,
                device.subgroup_size
            );
        }
        Ok(Outcome::text(text + "reference: the f64 renderer on the host, slow, for comparison\n"))
    }
}

fn object((index, device): (usize, &DeviceInfo)) -> Value {
    json!({
        "index": index, "name": device.name, "type": device.kind.name(), "api": device.api, "driver": device.driver,
        "subgroup_size": device.subgroup_size, "usable": device.unusable.is_none(), "reason": device.unusable,
    })
}
