//! Content of buffers: the BIN chunk, data URIs, files beside the document.

use super::Warnings;
use crate::error::{Error, Result};
use ::gltf::json::Root;
use base64::{engine::general_purpose, Engine};
use std::path::Path;

/// Largest buffer, so that a declared length alone allocates nothing absurd.
const LARGEST: u64 = 1 << 34;

/// Loads every buffer, each at least as long as it declares.
pub(super) fn load(
    root: &Root,
    binary: Option<&[u8]>,
    file: &str,
    folder: Option<&Path>,
    warnings: &mut Warnings,
) -> Result<Vec<Vec<u8>>> {
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let refuse = |message: String| Error::content(file, format!("buffers[{index}]: {message}"));
        let declared = buffer.byte_length.0;
        if declared == 0 || declared > LARGEST {
            return Err(refuse(format!("byteLength {declared} is not a sensible length")));
        }
        let bytes = match (&buffer.uri, binary) {
            (Some(uri), _) if uri.starts_with("data:") => decode_data_uri(uri).map_err(refuse)?,
            (Some(uri), _) => read_beside(uri, folder).map_err(refuse)?,
            (None, Some(binary)) if index == 0 => binary.to_vec(),
            (None, _) => return Err(refuse("it has no uri, and there is no BIN chunk for it".into())),
        };
        if (bytes.len() as u64) < declared {
            return Err(refuse(format!("byteLength is {declared}, but there are only {} bytes", bytes.len())));
        }
        // A BIN chunk may be padded by up to three bytes.
        if bytes.len() as u64 > declared + if buffer.uri.is_none() { 3 } else { 0 } {
            warnings.add(format!("buffers[{index}]: byteLength is {declared}, but there are {} bytes", bytes.len()));
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

fn decode_data_uri(uri: &str) -> Result<Vec<u8>, String> {
    let (head, data) = uri.split_once(',').ok_or("a data URI without a comma")?;
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
    if Path::new(name.as_ref()).is_absolute() {
        return Err(format!("'{uri}' is not relative to the document"));
    }
    let path = folder.join(name.as_ref());
    std::fs::read(&path).map_err(|error| format!("cannot read {}: {error}", path.display()))
}
