//! Compiled kernels kept between processes, where the driver gives any away: one file a driver, device and set of kernels.
//!
//! Mesa's software Vulkan gives none (and keeps its own cache); GPUs do. A cache is never needed: whatever is wrong with its
//! file is as if there were none.

use super::Device;
use ash::vk;
use sha2::{Digest, Sha256};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes of the checksum before the driver's data.
const CHECKSUM: usize = 32;
/// Data no longer than this is a header with nothing behind it.
const HEADER: usize = 64;

/// A pipeline cache, written back when it is dropped if it has grown.
pub struct Cache {
    device: Arc<Device>,
    pub(super) raw: vk::PipelineCache,
    path: Option<PathBuf>,
    loaded: usize,
}

impl Cache {
    /// The cache of a device for the kernels that `key` stands for. Without a place for it, or when the driver refuses, an empty
    /// one that is never written.
    pub fn open(device: &Arc<Device>, key: &[u8]) -> Self {
        let path = folder().map(|folder| folder.join(format!("{}.bin", device.cache_name(key))));
        let data = path.as_deref().and_then(|path| std::fs::read(path).ok()).and_then(|file| unpack(&file));
        let data = data.unwrap_or_default();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        // SAFETY: the data is what this driver gave, by its identity in the file's name, checksum and the driver's own header.
        let created = unsafe { device.raw.create_pipeline_cache(&info, None) };
        let raw = created.unwrap_or(vk::PipelineCache::null());
        Self { device: device.clone(), path: path.filter(|_| created.is_ok()), raw, loaded: data.len() }
    }

    /// A cache that holds nothing and is never written.
    pub(super) fn empty(device: &Arc<Device>) -> Self {
        Self { device: device.clone(), raw: vk::PipelineCache::null(), path: None, loaded: 0 }
    }

    /// Writes the file as a whole, so that two processes may do so at once; the last one wins.
    fn save(&self, path: &Path) -> Option<()> {
        // SAFETY: the cache is alive, and nobody compiles any more.
        let data = unsafe { self.device.raw.get_pipeline_cache_data(self.raw) }.ok()?;
        if data.len() <= HEADER.max(self.loaded) {
            return None;
        }
        let folder = path.parent()?;
        std::fs::create_dir_all(folder).ok()?;
        let mut file = tempfile::NamedTempFile::new_in(folder).ok()?;
        file.write_all(&pack(&data)).ok()?;
        file.persist(path).ok().map(drop)
    }
}

impl Drop for Cache {
    fn drop(&mut self) {
        // What cannot be kept is compiled again next time.
        let _ = self.path.as_deref().map(|path| self.save(path));
        // SAFETY: pipelines do not need their cache; null is allowed.
        unsafe { self.device.raw.destroy_pipeline_cache(self.raw, None) };
    }
}

/// The user's cache folder for this program.
pub(super) fn folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = || variable("HOME").map(|home| home.join(".cache"));
    let folder = variable("XDG_CACHE_HOME").or_else(|| variable("LOCALAPPDATA")).or_else(home)?;
    folder.is_absolute().then(|| folder.join("glimt"))
}

fn pack(data: &[u8]) -> Vec<u8> {
    [Sha256::digest(data).as_slice(), data].concat()
}

/// The data, if it is what was packed.
fn unpack(file: &[u8]) -> Option<Vec<u8>> {
    let (checksum, data) = file.split_at_checked(CHECKSUM)?;
    (Sha256::digest(data).as_slice() == checksum).then(|| data.to_vec())
}

#[cfg(test)]
mod tests {
    use super::{pack, unpack};

    #[test]
    fn a_damaged_file_is_as_none() {
        let file = pack(b"compiled kernels");
        assert_eq!(unpack(&file).as_deref(), Some(b"compiled kernels".as_slice()));
        for index in 0..file.len() {
            let mut damaged = file.clone();
            damaged[index] ^= 1;
            assert_eq!(unpack(&damaged), None, "byte {index}");
            assert_eq!(unpack(&file[..index]), None, "cut to {index} bytes");
        }
    }
}
