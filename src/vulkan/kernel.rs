//! A compute pipeline from SPIR-V and specialization constants.

use super::{failed, Cache, Layout};
use crate::error::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// What a kernel is made of.
#[derive(Clone, Debug)]
pub struct Source {
    /// Name of kernel, pass, timing row and debug label.
    pub name: &'static str,
    /// Its code.
    pub spirv: &'static [u8],
    /// Boolean specialization constants 0, 1, 2, ….
    pub constants: Vec<bool>,
}

/// A compiled kernel.
pub struct Kernel {
    pub(super) layout: Arc<Layout>,
    pub(super) raw: vk::Pipeline,
    /// Name of kernel, pass, timing row and debug label.
    pub name: &'static str,
}

impl Kernel {
    /// Makes the pipeline.
    ///
    /// # Errors
    /// `Device` when the bytes are no SPIR-V; `Vulkan` when the driver refuses.
    pub fn new(layout: &Arc<Layout>, cache: &Cache, source: &Source) -> Result<Self> {
        let Source { name, spirv, constants } = source;
        let device = &layout.device;
        let code = ash::util::read_spv(&mut std::io::Cursor::new(spirv))
            .map_err(|error| Error::Device(format!("kernel {name}: {error}")))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&code);
        // SAFETY: build.rs compiled the code for Vulkan 1.2.
        let module =
            unsafe { device.raw.create_shader_module(&info, None) }.map_err(failed(format!("load kernel {name}")))?;
        device.set_name(module, name);
        let values: Vec<u8> = constants.iter().flat_map(|on| u32::from(*on).to_ne_bytes()).collect();
        let entries: Vec<_> = (0..constants.len() as u32)
            .map(|id| vk::SpecializationMapEntry::default().constant_id(id).offset(4 * id).size(4))
            .collect();
        let specialization = vk::SpecializationInfo::default().map_entries(&entries).data(&values);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&specialization);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout.pipeline);
        // SAFETY: cache, module and layout are alive, and the kernel declares only slots of the layout.
        let created = unsafe { device.raw.create_compute_pipelines(cache.raw, &[info], None) };
        // SAFETY: the pipeline does not need its module any more.
        unsafe { device.raw.destroy_shader_module(module, None) };
        let raw = created.map_err(|(_, result)| failed(format!("compile kernel {name}"))(result))?[0];
        device.set_name(raw, name);
        Ok(Self { layout: layout.clone(), raw, name })
    }
}

impl Drop for Kernel {
    fn drop(&mut self) {
        // SAFETY: commands that use the pipeline were waited for.
        unsafe { self.layout.device.raw.destroy_pipeline(self.raw, None) };
    }
}
