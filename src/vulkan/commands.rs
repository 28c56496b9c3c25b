//! Recording: bind, push, dispatch, barrier, timestamp; then submit and wait, at once or in parts.

use super::device::lock;
use super::{failed, Bindings, Buffer, Device, Kernel};
use crate::error::Result;
use ash::vk;
use std::ffi::CString;
use std::sync::Arc;

/// Who touches memory, for barriers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// A kernel writes it.
    ShaderWrite,
    /// A kernel reads or writes it.
    ShaderReadWrite,
    /// A kernel reads or writes it, and indirect dispatches read their arguments from it.
    ShaderAndIndirect,
    /// The host reads it.
    HostRead,
    /// The device copies or fills it.
    Transfer,
}

impl Access {
    fn stage(self) -> vk::PipelineStageFlags {
        match self {
            Access::ShaderWrite | Access::ShaderReadWrite => vk::PipelineStageFlags::COMPUTE_SHADER,
            Access::ShaderAndIndirect => vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::DRAW_INDIRECT,
            Access::HostRead => vk::PipelineStageFlags::HOST,
            Access::Transfer => vk::PipelineStageFlags::TRANSFER,
        }
    }

    fn flags(self) -> vk::AccessFlags {
        match self {
            Access::ShaderWrite => vk::AccessFlags::SHADER_WRITE,
            Access::ShaderReadWrite => {
                vk::AccessFlags::SHADER_READ | vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::UNIFORM_READ
            }
            Access::ShaderAndIndirect => {
                vk::AccessFlags::SHADER_READ | vk::AccessFlags::SHADER_WRITE | vk::AccessFlags::INDIRECT_COMMAND_READ
            }
            Access::HostRead => vk::AccessFlags::HOST_READ,
            Access::Transfer => vk::AccessFlags::TRANSFER_WRITE | vk::AccessFlags::TRANSFER_READ,
        }
    }
}

/// A command buffer that is recorded, submitted and waited for; in several parts where that takes long.
pub struct Commands {
    device: Arc<Device>,
    pool: vk::CommandPool,
    buffer: vk::CommandBuffer,
    fence: vk::Fence,
    timestamps: vk::QueryPool,
    /// Name of each dispatch of this part; the end timestamp of the first `most_timed` has the next index.
    dispatched: Vec<&'static str>,
    most_timed: usize,
    is_submitted: bool,
    /// Names and milliseconds of the parts before.
    spans: Vec<(&'static str, f64)>,
}

impl Commands {
    /// Begins recording. At most `most_timed` dispatches of each part get a timestamp.
    ///
    /// # Errors
    /// `Vulkan` when the driver refuses.
    pub fn new(device: &Arc<Device>, most_timed: usize) -> Result<Self> {
        let most_timed = if device.timestamp_period.is_some() { most_timed } else { 0 };
        // Owns each object as soon as it is made; null handles are ignored when destroyed.
        let mut commands = Self {
            device: device.clone(),
            pool: vk::CommandPool::null(),
            buffer: vk::CommandBuffer::null(),
            fence: vk::Fence::null(),
            timestamps: vk::QueryPool::null(),
            dispatched: Vec::new(),
            most_timed,
            is_submitted: false,
            spans: Vec::new(),
        };
        let raw = &device.raw;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue_family);
        // SAFETY: the family is the one of the device's queue.
        commands.pool = unsafe { raw.create_command_pool(&info, None) }.map_err(failed("create command pool"))?;
        let info = vk::CommandBufferAllocateInfo::default().command_pool(commands.pool).command_buffer_count(1);
        // SAFETY: the pool was just made and is used by this thread alone.
        let buffers = unsafe { raw.allocate_command_buffers(&info) }.map_err(failed("allocate commands"))?;
        commands.buffer = buffers[0];
        device.set_name(commands.pool, "commands");
        device.set_name(commands.buffer, "commands");
        // SAFETY: a valid description.
        commands.fence =
            unsafe { raw.create_fence(&vk::FenceCreateInfo::default(), None) }.map_err(failed("create fence"))?;
        device.set_name(commands.fence, "commands done");
        if most_timed > 0 {
            let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP);
            let info = info.query_count(commands.timestamp_count());
            // SAFETY: the queue has timestamps.
            commands.timestamps =
                unsafe { raw.create_query_pool(&info, None) }.map_err(failed("create timestamp pool"))?;
            device.set_name(commands.timestamps, "timestamps");
        }
        commands.begin()?;
        Ok(commands)
    }

    fn timestamp_count(&self) -> u32 {
        self.most_timed as u32 + 1
    }

    fn begin(&self) -> Result<()> {
        let begin = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is fresh.
        unsafe { self.device.raw.begin_command_buffer(self.buffer, &begin) }.map_err(failed("begin commands"))?;
        if self.most_timed > 0 {
            let count = self.timestamp_count();
            // SAFETY: recording; all queries of the pool.
            unsafe { self.device.raw.cmd_reset_query_pool(self.buffer, self.timestamps, 0, count) };
            self.write_timestamp(0);
        }
        Ok(())
    }

    fn write_timestamp(&self, index: u32) {
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: recording; the query was reset and is written once.
        unsafe { self.device.raw.cmd_write_timestamp(self.buffer, stage, self.timestamps, index) };
    }

    /// Makes all slots visible to the dispatches that follow.
    pub fn bind(&mut self, kernel: &Kernel, bindings: &Bindings) {
        let (point, layout) = (vk::PipelineBindPoint::COMPUTE, kernel.layout.pipeline);
        // SAFETY: recording; set and pipeline layout are of the same Layout, and alive until the commands were waited for.
        unsafe { self.device.raw.cmd_bind_descriptor_sets(self.buffer, point, layout, 0, &[bindings.set], &[]) };
    }

    /// Runs `groups` workgroups.
    pub fn dispatch(&mut self, kernel: &Kernel, push: &[u8], groups: u32) {
        self.labelled(kernel, push, |commands| {
            // SAFETY: recording; pipeline, set and push constants are bound; groups ≤ 65 535 by the caller's bands.
            unsafe { commands.device.raw.cmd_dispatch(commands.buffer, groups, 1, 1) };
        });
    }

    /// Runs as many workgroups as the `index`-th triple of `arguments` says by then.
    pub fn dispatch_indirect(&mut self, kernel: &Kernel, push: &[u8], arguments: &Buffer, index: u64) {
        self.labelled(kernel, push, |commands| {
            let offset = index * size_of::<vk::DispatchIndirectCommand>() as u64;
            // SAFETY: recording; the buffer has indirect usage and room for the triple.
            unsafe { commands.device.raw.cmd_dispatch_indirect(commands.buffer, arguments.raw, offset) };
        });
    }

    /// A dispatch with its debug label, pipeline, push constants and timestamp.
    fn labelled(&mut self, kernel: &Kernel, push: &[u8], dispatch: impl FnOnce(&Self)) {
        if let (Some(utils), Ok(name)) = (&self.device.utils, CString::new(kernel.name)) {
            let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
            // SAFETY: recording; the label's name lives until the call returns.
            unsafe { utils.cmd_begin_debug_utils_label(self.buffer, &label) };
        }
        let point = vk::PipelineBindPoint::COMPUTE;
        // SAFETY: recording; the pipeline is alive until the commands were waited for.
        unsafe { self.device.raw.cmd_bind_pipeline(self.buffer, point, kernel.raw) };
        let stage = vk::ShaderStageFlags::COMPUTE;
        // SAFETY: recording; the bytes are exactly the layout's push constants.
        unsafe { self.device.raw.cmd_push_constants(self.buffer, kernel.layout.pipeline, stage, 0, push) };
        dispatch(self);
        self.dispatched.push(kernel.name);
        if self.dispatched.len() <= self.most_timed {
            self.write_timestamp(self.dispatched.len() as u32);
        }
        if let Some(utils) = &self.device.utils {
            // SAFETY: recording; ends the label begun above.
            unsafe { utils.cmd_end_debug_utils_label(self.buffer) };
        }
    }

    /// What follows may touch, as `after` says, what came before has written, as `before` says.
    pub fn barrier(&mut self, before: Access, after: Access) {
        let memory = [vk::MemoryBarrier::default().src_access_mask(before.flags()).dst_access_mask(after.flags())];
        let (from, to) = (before.stage(), after.stage());
        let flags = vk::DependencyFlags::empty();
        // SAFETY: recording; stages and accesses match each other.
        unsafe { self.device.raw.cmd_pipeline_barrier(self.buffer, from, to, flags, &memory, &[], &[]) };
    }

    /// Sets all of a buffer to zero.
    pub fn clear(&mut self, buffer: &Buffer) {
        // SAFETY: recording; the buffer has transfer usage and its size is a multiple of 4.
        unsafe { self.device.raw.cmd_fill_buffer(self.buffer, buffer.raw, 0, vk::WHOLE_SIZE, 0) };
    }

    /// Copies the first `bytes` to `offset`.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer, offset: u64, bytes: u64) {
        let region = [vk::BufferCopy::default().dst_offset(offset).size(bytes)];
        // SAFETY: recording; both buffers are alive, have transfer usage and room for the bytes.
        unsafe { self.device.raw.cmd_copy_buffer(self.buffer, from.raw, to.raw, &region) };
    }

    /// Dispatches recorded since the last [`Self::flush`].
    pub fn dispatches(&self) -> usize {
        self.dispatched.len()
    }

    /// Runs what was recorded, waits, and begins anew: with nothing bound, and with a barrier to follow, as it would between dispatches.
    ///
    /// # Errors
    /// As [`Self::submit_and_wait`].
    pub fn flush(&mut self) -> Result<()> {
        let mut fresh = Self::new(&self.device, self.most_timed)?;
        std::mem::swap(self, &mut fresh);
        self.spans = fresh.submit_and_wait()?;
        Ok(())
    }

    /// Runs what was recorded, waits, and returns each dispatch's name and milliseconds, in order; 0 where it was not timed.
    ///
    /// # Errors
    /// `Vulkan` when the device is lost or out of memory.
    pub fn submit_and_wait(self) -> Result<Vec<(&'static str, f64)>> {
        self.submit_and_wait_beside(|| ())
    }

    /// The same; the host does its own work before it waits.
    ///
    /// # Errors
    /// As [`Self::submit_and_wait`].
    pub fn submit_and_wait_beside(mut self, host_work: impl FnOnce()) -> Result<Vec<(&'static str, f64)>> {
        self.submit()?;
        host_work();
        self.wait()?;
        let last = self.read_timestamps()?;
        self.spans.extend(last);
        Ok(std::mem::take(&mut self.spans))
    }

    fn submit(&mut self) -> Result<()> {
        let raw = &self.device.raw;
        // SAFETY: recording, and ended once.
        unsafe { raw.end_command_buffer(self.buffer) }.map_err(failed("end commands"))?;
        let buffers = [self.buffer];
        let submit = [vk::SubmitInfo::default().command_buffers(&buffers)];
        {
            let queue = lock(&self.device.queue);
            // SAFETY: the lock keeps other threads off the queue; fence and commands are fresh.
            unsafe { raw.queue_submit(*queue, &submit, self.fence) }.map_err(failed("submit"))?;
        }
        self.is_submitted = true;
        Ok(())
    }

    fn wait(&self) -> Result<()> {
        // SAFETY: the fence was submitted.
        unsafe { self.device.raw.wait_for_fences(&[self.fence], true, u64::MAX) }.map_err(failed("wait for the device"))
    }

    fn read_timestamps(&self) -> Result<Vec<(&'static str, f64)>> {
        let mut spans: Vec<_> = self.dispatched.iter().map(|name| (*name, 0.0)).collect();
        let Some(period) = self.device.timestamp_period.filter(|_| self.most_timed > 0) else {
            return Ok(spans);
        };
        let mut ticks = vec![0_u64; spans.len().min(self.most_timed) + 1];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: the queries were written by commands that have completed.
        unsafe { self.device.raw.get_query_pool_results(self.timestamps, 0, &mut ticks, flags) }
            .map_err(failed("read timestamps"))?;
        for ((_, ms), pair) in spans.iter_mut().zip(ticks.windows(2)) {
            *ms = pair[1].saturating_sub(pair[0]) as f64 * period * 1e-6;
        }
        Ok(spans)
    }
}

impl Drop for Commands {
    fn drop(&mut self) {
        if self.is_submitted {
            // Again, in case the host's work panicked. A lost device does not use them any more.
            let _ = self.wait();
        }
        let raw = &self.device.raw;
        // SAFETY: submitted commands were waited for, or were never submitted; null is allowed here and below.
        unsafe { raw.destroy_query_pool(self.timestamps, None) };
        // SAFETY: as above.
        unsafe { raw.destroy_fence(self.fence, None) };
        // SAFETY: as above; frees the command buffer too.
        unsafe { raw.destroy_command_pool(self.pool, None) };
    }
}
