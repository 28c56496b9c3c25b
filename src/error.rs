//! What can go wrong, each naming the thing, and the exit code it means.

use std::path::{Path, PathBuf};

/// Result of this library.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What went wrong.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// An option or a combination of options makes no sense.
    #[error("{0}")]
    Usage(String),
    /// A file could not be read.
    #[error("cannot read {}: {source}", .path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A file was read, but its content is not what it must be.
    #[error("{file}: {message}")]
    Content {
        /// The file as the user named it.
        file: String,
        /// The fault, with its place in the file.
        message: String,
    },
    /// No Vulkan device can be used.
    #[error("{0}")]
    NoDevice(String),
    /// A Vulkan call failed.
    #[error("Vulkan: {what}: {result}")]
    Vulkan {
        /// What was being done, with the object's name.
        what: String,
        /// The call's answer.
        result: ash::vk::Result,
    },
    /// The device computed something it must not.
    #[error("device: {0}")]
    Device(String),
    /// The validation layers complained.
    #[error("Vulkan validation: {} message(s), the first: {}", .0.len(), .0.first().map_or("", String::as_str))]
    Validation(Vec<String>),
    /// An output could not be written.
    #[error("cannot write {}: {message}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        message: String,
    },
    /// The user asked to stop.
    #[error("interrupted: nothing unfinished was written")]
    Interrupted,
}

impl Error {
    /// The process exit code: 2 bad usage or input, 3 no usable device or it failed, 4 output not written, 130 interrupted.
    pub fn exit_code(&self) -> u8 {
        match self {
            Error::Usage(_) | Error::Read { .. } | Error::Content { .. } => 2,
            Error::NoDevice(_) | Error::Vulkan { .. } | Error::Device(_) | Error::Validation(_) => 3,
            Error::Write { .. } => 4,
            Error::Interrupted => 130,
        }
    }

    /// `Content` from anything that prints.
    pub fn content(file: impl Into<String>, message: impl ToString) -> Self {
        Error::Content { file: file.into(), message: message.to_string() }
    }

    /// `Write` from anything that prints.
    pub fn write(path: &Path, message: impl ToString) -> Self {
        Error::Write { path: path.to_owned(), message: message.to_string() }
    }
}
