//! Content of buffers: the BIN chunk, data URIs, files beside the document.

use super::{meshopt, Document, Warnings};
use ::gltf::json::{Buffer, Root};
use base64::{engine::general_purpose, Engine};
use std::path::{Component, Path};

/// Largest buffer, so that a declared length alone allocates nothing absurd.
const LARGEST: u64 = 1 << 34;

/// Loads every buffer, each at least as long as it declares. One that cannot be had refuses the file only when something
/// that is drawn needs it.
pub(super) fn load(
    root: &Root,
    binary: Option<&[u8]>,
    folder: Option<&Path>,
    warnings: &mut Warnings,
) -> Vec<Result<Vec<u8>, String>> {
    let fallbacks = meshopt::fallbacks(root, binary.is_some());
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let binary = binary.filter(|_| index == 0);
        if fallbacks[index] {
            buffers.push(Err(format!("buffers[{index}] only stands in for compressed data")));
            continue;
        }
        let bytes = load_one(buffer, binary, folder);
        let declared = buffer.byte_length.0;
        let bytes = bytes.and_then(|bytes| match bytes.len() as u64 {
            length if length < declared => Err(format!("byteLength is {declared}, but there are only {length} bytes")),
            _ => Ok(bytes),
        });
        // A BIN chunk may be padded by up to three bytes.
        let most = declared.saturating_add(if buffer.uri.is_none() { 3 } else { 0 });
        match bytes {
            Ok(bytes) => {
                if bytes.len() as u64 > most {
                    let length = bytes.len();
                    warnings.add(format!("buffers[{index}]: byteLength is {declared}, but there are {length} bytes"));
                }
                buffers.push(Ok(bytes));
            }
            Err(fault) => {
                let fault = format!("buffers[{index}]: {fault}");
                warnings.add(fault.clone());
                buffers.push(Err(fault));
            }
        }
    }
    buffers
}

impl Document<'_> {
    /// The bytes of a buffer view, decompressed if they are compressed.
    pub fn view_bytes(&self, index: usize) -> Result<&[u8], String> {
        if let Some(decompressed) = self.decompressed.get(&index) {
            return decompressed.as_deref().map_err(Clone::clone);
        }
        let view = self.root.buffer_views.get(index).ok_or_else(|| format!("there is no bufferViews[{index}]"))?;
        let offset = view.byte_offset.map_or(0, |offset| offset.0);
        slice(&self.buffers, view.buffer.value(), offset, view.byte_length.0)
            .map_err(|fault| format!("bufferViews[{index}]: {fault}"))
    }
}

/// Bytes of a buffer from `offset` on.
pub(super) fn slice(
    buffers: &[Result<Vec<u8>, String>],
    buffer: usize,
    offset: u64,
    length: u64,
) -> Result<&[u8], String> {
    let bytes = buffers.get(buffer).ok_or_else(|| format!("there is no buffers[{buffer}]"))?;
    let bytes = bytes.as_ref().map_err(Clone::clone)?;
    let whole = usize::try_from(offset).ok().zip(usize::try_from(length).ok());
    let part = whole.and_then(|(offset, length)| bytes.get(offset..offset.checked_add(length)?));
    part.ok_or_else(|| format!("{length} bytes from {offset} on do not fit into buffers[{buffer}]"))
}

fn load_one(buffer: &Buffer, binary: Option<&[u8]>, folder: Option<&Path>) -> Result<Vec<u8>, String> {
    match (&buffer.uri, binary) {
        _ if buffer.byte_length.0 == 0 || buffer.byte_length.0 > LARGEST => {
            Err(format!("byteLength {} is not a sensible length", buffer.byte_length.0))
        }
        (Some(uri), _) => from_uri(uri, folder),
        (None, Some(binary)) => Ok(binary.to_vec()),
        (None, None) => Err("it has no uri, and there is no BIN chunk for it".into()),
    }
}

/// The bytes that a URI of the document holds or names.
pub(super) fn from_uri(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        decode_data_uri(uri)
    } else {
        read_beside(uri, folder)
    }
}

fn decode_data_uri(uri: &str) -> Result<Vec<u8>, String> {
    let (head, data) = uri.split_once(',').ok_or("a data URI without a comma")?;
    if head.contains(";;") {
        return Err("the data URI has an empty parameter".into());
    }
    if !head.ends_with(";base64") {
        return Ok(percent_encoding::percent_decode_str(data).collect());
    }
    general_purpose::GeneralPurpose::new(
        &base64::alphabet::STANDARD,
        general_purpose::GeneralPurposeConfig::new()
            .with_decode_padding_mode(base64::engine::DecodePaddingMode::Indifferent),
    )
    .decode(data.trim())
    .map_err(|error| format!("the data URI is not base64: {error}"))
}

fn read_beside(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, String> {
    if uri.contains("://") {
        return Err(format!("'{uri}' is a network address; only files beside the document are read"));
    }
    let folder =
        folder.ok_or(format!("'{uri}' is a file beside the document, but there is none beside standard input"))?;
    let name = percent_encoding::percent_decode_str(uri).decode_utf8().map_err(|_| format!("'{uri}' is not UTF-8"))?;
    let plain = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    if !Path::new(name.as_ref()).components().all(plain) {
        return Err(format!("'{uri}' does not lie beside or below the document"));
    }
    let path = folder.join(name.as_ref());
    let refuse = |why: &dyn std::fmt::Display| format!("cannot read {}: {why}", path.display());
    let data = std::fs::metadata(&path).map_err(|error| refuse(&error))?;
    if !data.is_file() || data.len() > LARGEST {
        return Err(refuse(&"it is no file of a sensible size"));
    }
    std::fs::read(&path).map_err(|error| format!("cannot read {}: {error}", path.display()))
}
