//! Vulkan compute in a few owning types over `ash`: instance, device, buffers, kernels, commands. It knows nothing of rays.
//!
//! ```text
//! Instance ─ Device ─┬─ Buffer (memory by gpu-allocator, texel view)
//!                    ├─ Kernel (pipeline, out of a Cache, compiled Ahead) ─ Layout (descriptor set layout, push constants)
//!                    ├─ Bindings (descriptor set)
//!                    └─ Commands (record: label, bind, dispatch, barrier, timestamp → submit and wait)
//! ```
//! All `unsafe` of the project lives in this room: one block, one call, one reason. Every object holds an `Arc` of the device
//! and is freed in `Drop`; the device holds the instance. [`HugePages`] and [`prefer_wide_vectors`] are for programs: memory that large scenes go through, rays side by side. Vulkan 1.2, no window system extension.

#![allow(unsafe_code)]

mod ahead;
mod bindings;
mod buffer;
mod cache;
mod commands;
mod device;
mod huge_pages;
mod instance;
mod kernel;
mod vectors;

pub use ahead::{Ahead, Compiled};
pub use bindings::{BindingSlot, Bindings, Layout, SlotKind};
pub use buffer::{Buffer, Memory, Usage};
pub use cache::Cache;
pub use commands::{Access, Commands};
pub use device::{Device, DeviceChoice, DeviceInfo, DeviceKind, Fetch, Habits};
pub use huge_pages::HugePages;
pub use instance::Instance;
pub use kernel::{Kernel, Source};
pub use vectors::prefer_wide_vectors;

use crate::error::Error;

/// Turns a Vulkan answer into an `Error` that says what was being done.
fn failed(what: impl Into<String>) -> impl FnOnce(ash::vk::Result) -> Error {
    let what = what.into();
    move |result| Error::Vulkan { what, result }
}
