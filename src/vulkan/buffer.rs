//! Buffers: memory, optional texel view, upload and read-back.

use super::device::lock;
use super::huge_pages::prefer_huge_pages;
use super::{failed, Access, Commands, Device, DeviceKind, Fetch};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// Bytes of a `uvec4` texel.
const TEXEL: u64 = 16;

/// What a buffer is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Usage {
    /// Read-only texels, seen through the device's [`Fetch`].
    Fetch,
    /// A storage buffer.
    Storage,
    /// A storage buffer that later passes read as [`Usage::Fetch`].
    FetchedStorage,
    /// A storage buffer that also holds the arguments of indirect dispatches.
    Indirect,
    /// A uniform buffer.
    Uniform,
}

/// Where a buffer lives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Memory {
    /// Next to the device; the host never looks.
    Device,
    /// Written by the host.
    Upload,
    /// Read by the host.
    ReadBack,
}

/// A buffer and its memory, freed together.
pub struct Buffer {
    device: Arc<Device>,
    pub(super) raw: vk::Buffer,
    /// Its `uvec4` texels, where the device fetches them.
    pub(super) texel_view: vk::BufferView,
    allocation: Option<Allocation>,
    /// Size in bytes, as asked for and padded.
    pub bytes: u64,
    /// Debug name.
    pub name: &'static str,
}

impl Buffer {
    /// Makes a buffer of at least `bytes`, its content undefined.
    ///
    /// # Errors
    /// `Device` when it is larger than the device can bind; `Vulkan` or `Device` when there is no memory for it.
    pub fn new(device: &Arc<Device>, name: &'static str, bytes: u64, usage: Usage, memory: Memory) -> Result<Self> {
        let fetched = matches!(usage, Usage::Fetch | Usage::FetchedStorage);
        let texels = fetched && device.fetch == Fetch::Texel;
        let bytes = padded(bytes, fetched);
        let most_texel_bytes = u64::from(device.info.max_texels) * TEXEL;
        let limit = match usage {
            Usage::Fetch if texels => most_texel_bytes,
            Usage::FetchedStorage if texels => most_texel_bytes.min(device.info.max_storage_bytes),
            Usage::Uniform => 16384,
            _ => device.info.max_storage_bytes,
        };
        if bytes > limit {
            return Err(Error::Device(format!(
                "{} can bind {limit} bytes at once, the scene needs {bytes} for its {name}",
                device.info.name
            )));
        }
        let kind = match usage {
            Usage::Fetch if texels => vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER,
            Usage::FetchedStorage if texels => {
                vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::STORAGE_TEXEL_BUFFER
            }
            Usage::Fetch | Usage::Storage | Usage::FetchedStorage => vk::BufferUsageFlags::STORAGE_BUFFER,
            Usage::Indirect => vk::BufferUsageFlags::STORAGE_BUFFER | vk::BufferUsageFlags::INDIRECT_BUFFER,
            Usage::Uniform => vk::BufferUsageFlags::UNIFORM_BUFFER,
        };
        let transfer = vk::BufferUsageFlags::TRANSFER_SRC | vk::BufferUsageFlags::TRANSFER_DST;
        let info = vk::BufferCreateInfo::default().size(bytes).usage(kind | transfer);
        // SAFETY: a valid description; the buffer is owned by the struct that is made next and freed in its Drop.
        let raw = unsafe { device.raw.create_buffer(&info, None) }.map_err(failed(format!("create buffer {name}")))?;
        let texel_view = vk::BufferView::null();
        let mut buffer = Self { device: device.clone(), raw, texel_view, allocation: None, bytes, name };
        device.set_name(raw, name);
        buffer.allocate(memory)?;
        if texels {
            buffer.make_texel_view()?;
        }
        Ok(buffer)
    }

    /// Makes a buffer that holds `data`; without data, of the least size and undefined content.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn with_data(device: &Arc<Device>, name: &'static str, data: &[u8], usage: Usage) -> Result<Self> {
        Self::filled(device, name, data.len() as u64, usage, |target| target.copy_from_slice(data))
    }

    /// Makes a buffer of so many bytes, which `fill` writes, each one, and does not read: in the device's own memory where the host sees
    /// it, in a staging buffer where it does not. Of none, it has the least size and undefined content.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn filled(
        device: &Arc<Device>,
        name: &'static str,
        bytes: u64,
        usage: Usage,
        fill: impl FnOnce(&mut [u8]),
    ) -> Result<Self> {
        if bytes == 0 {
            return Self::new(device, name, 0, usage, Memory::Device);
        }
        let (seen_as, seen_usage) = if device.staged { ("staging", Usage::Storage) } else { (name, usage) };
        let mut seen = Self::new(device, seen_as, bytes, seen_usage, Memory::Upload)?;
        fill(seen.mapped(bytes)?);
        if !device.staged {
            return Ok(seen);
        }
        let buffer = Self::new(device, name, bytes, usage, Memory::Device)?;
        let mut commands = Commands::new(device, 0)?;
        commands.copy(&seen, &buffer, 0, bytes);
        // Buffer: the copy wrote, kernels of later submissions read.
        commands.barrier(Access::Transfer, Access::ShaderReadWrite);
        commands.submit_and_wait()?;
        Ok(buffer)
    }

    fn allocate(&mut self, memory: Memory) -> Result<()> {
        let device = &self.device;
        // SAFETY: the buffer is alive and of this device.
        let requirements = unsafe { device.raw.get_buffer_memory_requirements(self.raw) };
        let location = match memory {
            Memory::Device => MemoryLocation::GpuOnly,
            Memory::Upload => MemoryLocation::CpuToGpu,
            Memory::ReadBack => MemoryLocation::GpuToCpu,
        };
        let description = AllocationCreateDesc {
            name: self.name,
            requirements,
            location,
            linear: true,
            // A block of its own gives its memory back to the system as soon as it is freed.
            allocation_scheme: AllocationScheme::DedicatedBuffer(self.raw),
        };
        let allocation = device
            .allocator()
            .allocate(&description)
            .map_err(|error| Error::Device(format!("no memory for {} ({} bytes): {error}", self.name, self.bytes)))?;
        // SAFETY: the allocation is alive until the buffer is freed.
        let block = unsafe { allocation.memory() };
        // SAFETY: block and offset come from the allocator for this buffer's requirements; bound once.
        let bound = unsafe { device.raw.bind_buffer_memory(self.raw, block, allocation.offset()) };
        let mut count = lock(&device.memory);
        count.now += allocation.size();
        count.peak = count.peak.max(count.now);
        drop(count);
        if let (DeviceKind::Cpu, Some(mapped)) = (device.info.kind, allocation.mapped_ptr()) {
            prefer_huge_pages(mapped.as_ptr().cast(), allocation.size() as usize);
        }
        self.allocation = Some(allocation);
        bound.map_err(failed(format!("bind memory of {}", self.name)))
    }

    fn make_texel_view(&mut self) -> Result<()> {
        let info = vk::BufferViewCreateInfo::default()
            .buffer(self.raw)
            .format(vk::Format::R32G32B32A32_UINT)
            .range(vk::WHOLE_SIZE);
        // SAFETY: the buffer has texel usage, its size is a multiple of a texel and within the device's limit.
        self.texel_view = unsafe { self.device.raw.create_buffer_view(&info, None) }
            .map_err(failed(format!("create texel view of {}", self.name)))?;
        self.device.set_name(self.texel_view, self.name);
        Ok(())
    }

    /// The host's view of the first bytes, to be written.
    fn mapped(&mut self, bytes: u64) -> Result<&mut [u8]> {
        let mapped = self.allocation.as_mut().and_then(Allocation::mapped_slice_mut);
        let target = mapped.and_then(|mapped| mapped.get_mut(..bytes as usize));
        target.ok_or_else(|| Error::Device(format!("cannot write {bytes} bytes to {}", self.name)))
    }

    /// The host's view of the whole buffer, which no commands in flight may write.
    ///
    /// # Errors
    /// `Device` when the buffer is not in host-visible memory.
    pub fn read(&self) -> Result<&[u8]> {
        let mapped = self.allocation.as_ref().and_then(Allocation::mapped_slice);
        mapped.ok_or_else(|| Error::Device(format!("cannot read {}", self.name)))
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: commands that use the buffer were waited for; null is allowed.
        unsafe { self.device.raw.destroy_buffer_view(self.texel_view, None) };
        // SAFETY: as above, and the view is gone.
        unsafe { self.device.raw.destroy_buffer(self.raw, None) };
        if let Some(allocation) = self.allocation.take() {
            lock(&self.device.memory).now -= allocation.size();
            // The allocator only fails for memory that is not its own.
            let _ = self.device.allocator().free(allocation);
        }
    }
}

/// Size with padding: at least 16 bytes; fetched buffers are whole texels and never a power of two of them, because Mesa
/// 22.3 compiles a kernel anew when a texel buffer changes between a power of two and another count.
fn padded(bytes: u64, fetched: bool) -> u64 {
    let texels = bytes.div_ceil(TEXEL).max(1);
    let texels = if fetched && texels.is_power_of_two() { texels + 1 } else { texels };
    // 1 + 1 = 2 is a power of two again.
    TEXEL * if fetched { texels.max(3) } else { texels }
}

#[cfg(test)]
mod tests {
    use super::padded;

    #[test]
    fn fetched_buffers_are_never_a_power_of_two() {
        for bytes in 0..70_000 {
            let size = padded(bytes, true);
            assert!(size >= bytes && size.is_multiple_of(16) && !(size / 16).is_power_of_two(), "{bytes}: {size}");
        }
    }
}
