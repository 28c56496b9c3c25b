//! One descriptor set layout for all kernels, and a set that fills it.

use super::{failed, Buffer, Device, Fetch};
use crate::error::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// How kernels reach a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SlotKind {
    /// Texels, through the device's [`Fetch`].
    Fetch,
    /// Storage buffer.
    Storage,
    /// Uniform buffer.
    Uniform,
}

/// A slot of set 0.
#[derive(Clone, Copy, Debug)]
pub struct BindingSlot {
    /// Its number.
    pub slot: u32,
    /// How it is reached.
    pub kind: SlotKind,
}

impl BindingSlot {
    fn descriptor_type(self, fetch: Fetch) -> vk::DescriptorType {
        match (self.kind, fetch) {
            (SlotKind::Fetch, Fetch::Texel) => vk::DescriptorType::STORAGE_TEXEL_BUFFER,
            (SlotKind::Fetch, Fetch::Storage) | (SlotKind::Storage, _) => vk::DescriptorType::STORAGE_BUFFER,
            (SlotKind::Uniform, _) => vk::DescriptorType::UNIFORM_BUFFER,
        }
    }
}

/// Descriptor set layout and pipeline layout, the same for every kernel.
pub struct Layout {
    pub(super) device: Arc<Device>,
    pub(super) set: vk::DescriptorSetLayout,
    pub(super) pipeline: vk::PipelineLayout,
    pub(super) push_bytes: u32,
    slots: Vec<BindingSlot>,
}

impl Layout {
    /// Set 0 with these slots, and push constants of `push_bytes`.
    ///
    /// # Errors
    /// `NoDevice` when there are more storage buffers than the device allows; `Vulkan` when the driver refuses.
    pub fn new(device: &Arc<Device>, slots: &[BindingSlot], push_bytes: u32) -> Result<Arc<Self>> {
        let is_storage = |slot: &&BindingSlot| slot.descriptor_type(device.fetch) == vk::DescriptorType::STORAGE_BUFFER;
        let needed = slots.iter().filter(is_storage).count();
        let most = device.info.max_storage_buffers;
        if needed > most as usize {
            let name = &device.info.name;
            return Err(Error::NoDevice(format!("{name} shows a kernel {most} storage buffers, {needed} are needed")));
        }
        let bindings: Vec<_> = slots
            .iter()
            .map(|slot| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(slot.slot)
                    .descriptor_type(slot.descriptor_type(device.fetch))
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::COMPUTE)
            })
            .collect();
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
        // SAFETY: a valid description; owned by the struct below.
        let set = unsafe { device.raw.create_descriptor_set_layout(&info, None) }
            .map_err(failed("create descriptor set layout"))?;
        let mut layout = Self {
            device: device.clone(),
            set,
            pipeline: vk::PipelineLayout::null(),
            push_bytes,
            slots: slots.to_vec(),
        };
        let sets = [set];
        let push = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::COMPUTE).size(push_bytes)];
        let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(&push);
        // SAFETY: the set layout is alive; push_bytes is within the guaranteed 128.
        layout.pipeline =
            unsafe { device.raw.create_pipeline_layout(&info, None) }.map_err(failed("create pipeline layout"))?;
        device.set_name(layout.set, "bindings");
        device.set_name(layout.pipeline, "kernels");
        Ok(Arc::new(layout))
    }

    /// The same for a twin of the device.
    pub(super) fn of_twin(&self) -> Result<Arc<Self>> {
        Self::new(&self.device.twin()?, &self.slots, self.push_bytes)
    }

    /// How a slot is reached.
    pub(super) fn kind(&self, slot: u32) -> SlotKind {
        self.slots[slot as usize].kind
    }
}

impl Drop for Layout {
    fn drop(&mut self) {
        // SAFETY: kernels hold an Arc of the layout, so none is left; null is allowed.
        unsafe { self.device.raw.destroy_pipeline_layout(self.pipeline, None) };
        // SAFETY: as above, and no set is being allocated from it.
        unsafe { self.device.raw.destroy_descriptor_set_layout(self.set, None) };
    }
}

/// A descriptor set in which every slot names a buffer.
pub struct Bindings {
    layout: Arc<Layout>,
    pool: vk::DescriptorPool,
    pub(super) set: vk::DescriptorSet,
}

impl Bindings {
    /// Binds `buffer_of(slot)` to every slot of the layout. The buffers must outlive the commands that use the set.
    ///
    /// # Errors
    /// `Vulkan` when the driver refuses.
    pub fn new<'a>(layout: &Arc<Layout>, buffer_of: impl Fn(u32) -> &'a Buffer) -> Result<Self> {
        let device = &layout.device;
        let count = layout.slots.len() as u32;
        let sizes = [
            vk::DescriptorType::STORAGE_TEXEL_BUFFER,
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::UNIFORM_BUFFER,
        ]
        .map(|kind| vk::DescriptorPoolSize::default().ty(kind).descriptor_count(count));
        let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
        // SAFETY: a valid description; owned by the struct below.
        let pool =
            unsafe { device.raw.create_descriptor_pool(&info, None) }.map_err(failed("create descriptor pool"))?;
        let mut bindings = Self { layout: layout.clone(), pool, set: vk::DescriptorSet::null() };
        let layouts = [layout.set];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts);
        // SAFETY: the pool has room for one set of this layout and is used by this thread alone.
        let sets = unsafe { device.raw.allocate_descriptor_sets(&info) }.map_err(failed("allocate descriptor set"))?;
        bindings.set = sets[0];
        device.set_name(bindings.pool, "bindings");
        device.set_name(bindings.set, "bindings");
        bindings.write(buffer_of);
        Ok(bindings)
    }

    fn write<'a>(&self, buffer_of: impl Fn(u32) -> &'a Buffer) {
        let device = &self.layout.device;
        for slot in &self.layout.slots {
            let buffer = buffer_of(slot.slot);
            let kind = slot.descriptor_type(device.fetch);
            let ranges = [vk::DescriptorBufferInfo::default().buffer(buffer.raw).range(vk::WHOLE_SIZE)];
            let views = [buffer.texel_view];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(slot.slot)
                .descriptor_type(kind)
                .descriptor_count(1);
            let write = if kind == vk::DescriptorType::STORAGE_TEXEL_BUFFER {
                write.texel_buffer_view(&views)
            } else {
                write.buffer_info(&ranges)
            };
            // SAFETY: the set is not in use yet; buffer and view are alive and have the slot's usage.
            unsafe { device.raw.update_descriptor_sets(&[write], &[]) };
        }
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        // SAFETY: commands that use the set were waited for; its sets go with it.
        unsafe { self.layout.device.raw.destroy_descriptor_pool(self.pool, None) };
    }
}
