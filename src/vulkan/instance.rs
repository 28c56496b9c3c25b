//! The loader, the instance, and what the validation layers say.

use super::failed;
use crate::error::{Error, Result};
use ash::{ext::debug_utils, vk};
use std::ffi::{c_void, CStr};
use std::sync::{Arc, Mutex};

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Warnings and errors of the validation layers, in order.
type Messages = Mutex<Vec<String>>;

/// A Vulkan 1.2 instance without any window system extension.
pub struct Instance {
    pub(super) raw: ash::Instance,
    /// Present when the loader or a layer offers names and labels.
    pub(super) has_debug_utils: bool,
    messenger: Option<(debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    // The messenger's user data points here; it outlives the messenger.
    messages: Arc<Messages>,
    // The library that all function pointers point into; dropped last.
    _entry: ash::Entry,
}

impl Instance {
    /// Loads Vulkan. With `validate`, every message of the validation layers is kept for [`Instance::messages`].
    ///
    /// # Errors
    /// `NoDevice` when there is no loader, no driver answers, or validation is asked for and the layers are not installed.
    pub fn new(validate: bool) -> Result<Arc<Self>> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers; it is trusted as every Vulkan program trusts it.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| {
            Error::NoDevice(format!(
                "no Vulkan loader ({error}); install it and a driver (Debian: apt install libvulkan1 mesa-vulkan-drivers)"
            ))
        })?;
        let has_debug_utils = has_extension(&entry, debug_utils::NAME, None)
            || (validate && has_extension(&entry, debug_utils::NAME, Some(VALIDATION_LAYER)));
        let layers = if validate { vec![VALIDATION_LAYER.as_ptr()] } else { Vec::new() };
        let extensions = if has_debug_utils { vec![debug_utils::NAME.as_ptr()] } else { Vec::new() };
        let application = vk::ApplicationInfo::default()
            .application_name(c"glimt")
            .engine_name(c"glimt")
            .api_version(vk::API_VERSION_1_2);
        let info = vk::InstanceCreateInfo::default()
            .application_info(&application)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&extensions);
        // SAFETY: info and all that it points to live until the call returns.
        let raw = unsafe { entry.create_instance(&info, None) }.map_err(|result| match result {
            vk::Result::ERROR_LAYER_NOT_PRESENT => Error::NoDevice(
                "the Vulkan validation layers are not installed (Debian: apt install vulkan-validationlayers)".into(),
            ),
            vk::Result::ERROR_INCOMPATIBLE_DRIVER | vk::Result::ERROR_INITIALIZATION_FAILED => {
                Error::NoDevice(no_driver())
            }
            result => Error::NoDevice(format!("cannot create a Vulkan instance: {result}")),
        })?;
        let mut instance = Self { raw, has_debug_utils, messenger: None, messages: Arc::default(), _entry: entry };
        if validate {
            instance.messenger = Some(instance.listen()?);
        }
        Ok(Arc::new(instance))
    }

    /// Subscribes to the validation layers' warnings and errors.
    fn listen(&self) -> Result<(debug_utils::Instance, vk::DebugUtilsMessengerEXT)> {
        let utils = debug_utils::Instance::new(&self._entry, &self.raw);
        let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::WARNING | vk::DebugUtilsMessageSeverityFlagsEXT::ERROR,
            )
            .message_type(
                vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION | vk::DebugUtilsMessageTypeFlagsEXT::PERFORMANCE,
            )
            .pfn_user_callback(Some(keep_message))
            .user_data(Arc::as_ptr(&self.messages).cast_mut().cast());
        // SAFETY: the callback has the right signature and its user data lives as long as the messenger.
        let messenger =
            unsafe { utils.create_debug_utils_messenger(&info, None) }.map_err(failed("create debug messenger"))?;
        Ok((utils, messenger))
    }

    /// Whether validation layers are on.
    pub(super) fn is_validating(&self) -> bool {
        self.messenger.is_some()
    }

    /// What the validation layers have said so far.
    pub fn messages(&self) -> Vec<String> {
        self.messages.lock().map(|messages| messages.clone()).unwrap_or_default()
    }

    /// Physical devices in the loader's order.
    pub(super) fn physical_devices(&self) -> Result<Vec<vk::PhysicalDevice>> {
        // SAFETY: the instance is alive.
        let devices = unsafe { self.raw.enumerate_physical_devices() };
        match devices {
            Ok(devices) if !devices.is_empty() => Ok(devices),
            Ok(_) | Err(vk::Result::ERROR_INITIALIZATION_FAILED) => Err(Error::NoDevice(no_driver())),
            Err(result) => Err(failed("list devices")(result)),
        }
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        if let Some((utils, messenger)) = self.messenger.take() {
            // SAFETY: made from this instance, destroyed once, no call of it is running.
            unsafe { utils.destroy_debug_utils_messenger(messenger, None) };
        }
        // SAFETY: every device holds an Arc of this instance, so none is left.
        unsafe { self.raw.destroy_instance(None) };
    }
}

fn no_driver() -> String {
    "the Vulkan loader finds no driver; install one (Debian, without a GPU: apt install mesa-vulkan-drivers)".into()
}

fn has_extension(entry: &ash::Entry, name: &CStr, layer: Option<&CStr>) -> bool {
    // SAFETY: a valid global call; the layer's name is null-terminated.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(layer) };
    extensions.unwrap_or_default().iter().any(|extension| extension.extension_name_as_c_str() == Ok(name))
}

/// Callback of the validation layers: keeps the text.
unsafe extern "system" fn keep_message(
    _severity: vk::DebugUtilsMessageSeverityFlagsEXT,
    _kind: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes a valid structure for the duration of the call.
    let data = unsafe { &*data };
    // SAFETY: `listen` passed a pointer to the instance's messages, which outlive the messenger.
    let messages = unsafe { &*messages.cast::<Messages>() };
    if !data.p_message.is_null() {
        // SAFETY: the layer's message is a null-terminated string.
        let text = unsafe { CStr::from_ptr(data.p_message) };
        if let Ok(mut messages) = messages.lock() {
            messages.push(text.to_string_lossy().into_owned());
        }
    }
    vk::FALSE
}
