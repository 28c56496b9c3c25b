//! Choosing a physical device and opening it: one compute queue, memory, limits.

use super::{failed, Instance};
use crate::error::{Error, Result};
use ash::{ext::debug_utils, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use sha2::Digest;
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Texel buffers smaller than this push a software device to storage buffers: SwiftShader offers 65 536 texels.
const ENOUGH_TEXELS: u32 = 1 << 26;
/// Texels of a buffer that kernels tell apart: as many as Mesa's software Vulkan offers, see FETCH in shaders/shared/bindings.glsl.
const MOST_TEXELS: u32 = 1 << 27;
/// So do fewer storage texel buffers in a kernel than there are slots.
const ENOUGH_TEXEL_BUFFERS: u32 = 32;

/// What kind of thing the device is; in the order of preference.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum DeviceKind {
    /// A GPU of its own.
    Discrete,
    /// A GPU that shares the CPU's memory.
    Integrated,
    /// A part of a GPU.
    Virtual,
    /// Software.
    Cpu,
    /// Anything else.
    Other,
}

impl DeviceKind {
    /// Lower-case name, as `--json` prints it.
    pub fn name(self) -> &'static str {
        match self {
            DeviceKind::Discrete => "discrete",
            DeviceKind::Integrated => "integrated",
            DeviceKind::Virtual => "virtual",
            DeviceKind::Cpu => "cpu",
            DeviceKind::Other => "other",
        }
    }
}

/// Which device to open.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum DeviceChoice {
    /// The best usable one: discrete, then integrated, then virtual, then software.
    #[default]
    Best,
    /// By its index in [`Device::list`], or by a part of its name, in any case.
    Named(String),
}

/// What a physical device says of itself.
#[derive(Clone, Debug)]
pub struct DeviceInfo {
    /// Name, e.g. `llvmpipe (LLVM 15.0.6, 256 bits)`.
    pub name: String,
    /// Driver's name and version, e.g. `llvmpipe Mesa 22.3.6 (LLVM 15.0.6)`.
    pub driver: String,
    /// Vulkan version, e.g. `1.3.230`.
    pub api: String,
    /// Kind.
    pub kind: DeviceKind,
    /// Invocations in a subgroup; nothing depends on it.
    pub subgroup_size: u32,
    /// Most texels in a texel buffer.
    pub max_texels: u32,
    /// Most storage texel buffers that a kernel can see.
    pub max_texel_buffers: u32,
    /// Most bytes in a storage buffer binding.
    pub max_storage_bytes: u64,
    /// Most storage buffers that a kernel can see.
    pub max_storage_buffers: u32,
    /// Why it cannot be used, if it cannot.
    pub unusable: Option<String>,
}

/// Through which kind of buffer kernels fetch the tree and the triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fetch {
    /// Storage texel buffers: what software Vulkan reads fastest.
    Texel,
    /// Storage buffers.
    Storage,
}

/// An open device with one compute queue.
pub struct Device {
    pub(super) raw: ash::Device,
    /// One submission at a time, from any thread.
    pub(super) queue: Mutex<vk::Queue>,
    pub(super) queue_family: u32,
    pub(super) utils: Option<debug_utils::Device>,
    /// Freed by hand before the device is destroyed.
    allocator: ManuallyDrop<Mutex<Allocator>>,
    /// Nanoseconds a timestamp tick; `None` when the queue has no timestamps.
    pub(super) timestamp_period: Option<f64>,
    /// Bytes allocated now and at most.
    pub(super) memory: Mutex<MemoryCount>,
    /// What was opened.
    pub info: DeviceInfo,
    /// How kernels fetch on this device.
    pub fetch: Fetch,
    /// What tells this device and driver from others whose compiled kernels do not fit.
    identity: [u8; 28],
    physical: vk::PhysicalDevice,
    /// Uploads go through a staging buffer, because the host does not see the device's memory.
    pub(super) staged: bool,
    /// Kernels may be compiled ahead of their first dispatch.
    pub(super) compiles_ahead: bool,
    /// The instance, for its validation messages.
    pub instance: Arc<Instance>,
}

/// How to use a device, where its kind and limits are not to decide. For tests of paths that other devices take.
#[derive(Clone, Copy, Debug, Default)]
pub struct Habits {
    /// Through which buffers kernels fetch.
    pub fetch: Option<Fetch>,
    /// Uploads through a staging buffer.
    pub staged: Option<bool>,
    /// Kernels are compiled ahead of their first dispatch, if a trial shows that this helps.
    pub compile_ahead: Option<bool>,
}

/// Bytes of device memory that buffers hold.
#[derive(Clone, Copy, Debug, Default)]
pub struct MemoryCount {
    pub(super) now: u64,
    pub(super) peak: u64,
}

impl Device {
    /// Most bytes of a buffer that kernels fetch from.
    pub fn fetch_limit(&self) -> u64 {
        match self.fetch {
            Fetch::Texel => 16 * u64::from(self.info.max_texels),
            Fetch::Storage => self.info.max_storage_bytes,
        }
    }

    /// All physical devices, in the loader's order, usable or not.
    ///
    /// # Errors
    /// `NoDevice` when there is no loader or no driver.
    pub fn list(instance: &Instance) -> Result<Vec<DeviceInfo>> {
        Ok(instance.physical_devices()?.into_iter().map(|device| describe(instance, device)).collect())
    }

    /// Opens a device. What `habits` leave open, its kind and limits decide.
    ///
    /// # Errors
    /// `NoDevice` when none fits the choice; `Vulkan` when the driver refuses.
    pub fn open(instance: &Arc<Instance>, choice: &DeviceChoice, habits: Habits) -> Result<Arc<Self>> {
        let physical = instance.physical_devices()?;
        let infos: Vec<DeviceInfo> = physical.iter().map(|device| describe(instance, *device)).collect();
        let index = choose(&infos, choice)?;
        Self::open_physical(instance, physical[index], infos[index].clone(), habits)
    }

    fn open_physical(
        instance: &Arc<Instance>,
        physical: vk::PhysicalDevice,
        info: DeviceInfo,
        habits: Habits,
    ) -> Result<Arc<Self>> {
        let (queue_family, timestamp_bits) = compute_family(instance, physical)
            .ok_or_else(|| Error::NoDevice(format!("{} has no compute queue", info.name)))?;
        let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
        let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default().scalar_block_layout(true);
        let create = vk::DeviceCreateInfo::default().queue_create_infos(&queues).push_next(&mut vulkan12);
        // SAFETY: the physical device belongs to the instance; queue family and feature were asked for and are there.
        let raw = unsafe { instance.raw.create_device(physical, &create, None) }
            .map_err(failed(format!("open device {}", info.name)))?;
        // SAFETY: one queue of this family was made with the device.
        let queue = unsafe { raw.get_device_queue(queue_family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        });
        let allocator = allocator.map_err(|error| {
            // SAFETY: nothing was made from the device yet.
            unsafe { raw.destroy_device(None) };
            Error::NoDevice(format!("{}: memory allocator: {error}", info.name))
        })?;
        let utils = instance.has_debug_utils.then(|| debug_utils::Device::new(&instance.raw, &raw));
        // SAFETY: the physical device belongs to the instance.
        let properties = unsafe { instance.raw.get_physical_device_properties(physical) };
        let mut identity = [0; 28];
        identity[..16].copy_from_slice(&properties.pipeline_cache_uuid);
        for (bytes, id) in identity[16..].chunks_exact_mut(4).zip([
            properties.vendor_id,
            properties.device_id,
            properties.driver_version,
        ]) {
            bytes.copy_from_slice(&id.to_le_bytes());
        }
        let enough = info.max_texels >= ENOUGH_TEXELS && info.max_texel_buffers >= ENOUGH_TEXEL_BUFFERS;
        let suitable = if info.kind == DeviceKind::Cpu && enough { Fetch::Texel } else { Fetch::Storage };
        let device = Arc::new(Self {
            raw,
            queue: Mutex::new(queue),
            queue_family,
            utils,
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            timestamp_period: (timestamp_bits > 0).then_some(f64::from(properties.limits.timestamp_period)),
            memory: Mutex::default(),
            fetch: habits.fetch.unwrap_or(suitable),
            staged: habits.staged.unwrap_or(info.kind == DeviceKind::Discrete),
            // Validation is not about speed, and the layers of 1.3.239 do not stand every use of several threads.
            compiles_ahead: habits.compile_ahead.unwrap_or(info.kind == DeviceKind::Cpu && !instance.is_validating()),
            identity,
            physical,
            info,
            instance: instance.clone(),
        });
        device.set_name(device.raw.handle(), "glimt");
        device.set_name(queue, "compute");
        Ok(device)
    }

    /// The same physical device opened once more.
    pub(super) fn twin(&self) -> Result<Arc<Self>> {
        let habits = Habits { fetch: Some(self.fetch), staged: Some(self.staged), compile_ahead: Some(false) };
        Self::open_physical(&self.instance, self.physical, self.info.clone(), habits)
    }

    /// From now on the peak is that of what follows.
    pub fn forget_peak_memory(&self) {
        let mut count = lock(&self.memory);
        count.peak = count.now;
    }

    /// Most bytes of device memory that buffers have held at once.
    pub fn peak_memory(&self) -> u64 {
        lock(&self.memory).peak
    }

    pub(super) fn allocator(&self) -> MutexGuard<'_, Allocator> {
        lock(&self.allocator)
    }

    /// A name for what this driver compiles for this device out of what `key` stands for.
    pub(super) fn cache_name(&self, key: &[u8]) -> String {
        let digest = sha2::Sha256::new().chain_update(self.identity).chain_update(key).finalize();
        digest.iter().take(16).map(|byte| format!("{byte:02x}")).collect()
    }

    /// Gives an object the name that tools and validation messages show.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        let Some(utils) = &self.utils else { return };
        let Ok(name) = std::ffi::CString::new(name) else { return };
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
        // SAFETY: the handle is alive and of this device. A name that cannot be set costs nothing but the name.
        let _ = unsafe { utils.set_debug_utils_object_name(&info) };
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // SAFETY: never used again; every buffer held an Arc of this device, so all memory has been returned.
        unsafe { ManuallyDrop::drop(&mut self.allocator) };
        // SAFETY: every object of the device held an Arc of it, so none is left, and every submission was waited for.
        unsafe { self.raw.destroy_device(None) };
    }
}

/// A poisoned lock only means that another thread panicked: the counters behind it are still right.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The first queue family that computes, and its timestamp bits.
fn compute_family(instance: &Instance, physical: vk::PhysicalDevice) -> Option<(u32, u32)> {
    // SAFETY: the physical device belongs to the instance.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(physical) };
    let index = families.iter().position(|family| family.queue_flags.contains(vk::QueueFlags::COMPUTE))?;
    Some((u32::try_from(index).ok()?, families[index].timestamp_valid_bits))
}

fn describe(instance: &Instance, physical: vk::PhysicalDevice) -> DeviceInfo {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut subgroup = vk::PhysicalDeviceSubgroupProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut subgroup);
    // SAFETY: the physical device belongs to the instance; the chain is of structures this query fills.
    unsafe { instance.raw.get_physical_device_properties2(physical, &mut properties) };
    let core = properties.properties;
    let subgroup_operations = subgroup.supported_operations;
    let text = |chars: Result<&std::ffi::CStr, _>| {
        chars.map(|chars: &std::ffi::CStr| chars.to_string_lossy().into_owned()).unwrap_or_default()
    };
    let api = core.api_version;
    let mut info = DeviceInfo {
        name: text(core.device_name_as_c_str().map_err(drop)),
        driver: format!(
            "{} {}",
            text(driver.driver_name_as_c_str().map_err(drop)),
            text(driver.driver_info_as_c_str().map_err(drop))
        ),
        api: format!("{}.{}.{}", vk::api_version_major(api), vk::api_version_minor(api), vk::api_version_patch(api)),
        kind: match core.device_type {
            vk::PhysicalDeviceType::DISCRETE_GPU => DeviceKind::Discrete,
            vk::PhysicalDeviceType::INTEGRATED_GPU => DeviceKind::Integrated,
            vk::PhysicalDeviceType::VIRTUAL_GPU => DeviceKind::Virtual,
            vk::PhysicalDeviceType::CPU => DeviceKind::Cpu,
            _ => DeviceKind::Other,
        },
        subgroup_size: subgroup.subgroup_size,
        max_texels: core.limits.max_texel_buffer_elements.min(MOST_TEXELS),
        max_texel_buffers: core
            .limits
            .max_per_stage_descriptor_storage_images
            .min(core.limits.max_descriptor_set_storage_images),
        max_storage_bytes: core.limits.max_storage_buffer_range.into(),
        max_storage_buffers: core
            .limits
            .max_per_stage_descriptor_storage_buffers
            .min(core.limits.max_descriptor_set_storage_buffers),
        unusable: None,
    };
    let ballots = vk::SubgroupFeatureFlags::BASIC | vk::SubgroupFeatureFlags::BALLOT;
    let lacks_ballots = || !subgroup_operations.contains(ballots);
    info.unusable = unusable(instance, physical, api)
        .or_else(|| lacks_ballots().then(|| "its subgroups have no ballots, which queues are filled by".into()));
    info
}

/// What a device lacks, if anything.
fn unusable(instance: &Instance, physical: vk::PhysicalDevice, api: u32) -> Option<String> {
    if api < vk::API_VERSION_1_2 {
        return Some("it offers less than Vulkan 1.2".into());
    }
    if compute_family(instance, physical).is_none() {
        return Some("it has no compute queue".into());
    }
    let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan12);
    // SAFETY: the physical device belongs to the instance and has Vulkan 1.2, which defines the chained structure.
    unsafe { instance.raw.get_physical_device_features2(physical, &mut features) };
    (vulkan12.scalar_block_layout == vk::FALSE).then(|| "it has no scalarBlockLayout".into())
}

/// Index of the device that fits the choice.
fn choose(infos: &[DeviceInfo], choice: &DeviceChoice) -> Result<usize> {
    let listed = || {
        let lines = infos.iter().enumerate().map(|(index, info)| format!("{index}: {}", info.name));
        lines.collect::<Vec<_>>().join("; ")
    };
    let index = match choice {
        DeviceChoice::Best => (0..infos.len())
            .filter(|index| infos[*index].unusable.is_none())
            .min_by_key(|index| infos[*index].kind)
            .ok_or_else(|| {
                let reasons =
                    infos.iter().map(|info| format!("{}: {}", info.name, info.unusable.as_deref().unwrap_or("")));
                Error::NoDevice(format!("no usable Vulkan device: {}", reasons.collect::<Vec<_>>().join("; ")))
            })?,
        DeviceChoice::Named(name) => {
            let wanted = name.to_lowercase();
            let by_index = name.parse::<usize>().ok().filter(|index| *index < infos.len());
            let by_name = || infos.iter().position(|info| info.name.to_lowercase().contains(&wanted));
            by_index
                .or_else(by_name)
                .ok_or_else(|| Error::NoDevice(format!("no device '{name}'; there is {}", listed())))?
        }
    };
    match &infos[index].unusable {
        Some(reason) => Err(Error::NoDevice(format!("{} cannot be used: {reason}", infos[index].name))),
        None => Ok(index),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kernels_tell_as_many_texels_apart_as_buffers_may_have() {
        let fetch = format!("#define FETCH(name, index) imageLoad(name, int((index) & {:#x}u))", MOST_TEXELS - 1);
        assert!(include_str!("../../shaders/shared/bindings.glsl").contains(&fetch), "{fetch}");
    }
}
