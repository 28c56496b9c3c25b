//! Content of buffers: the BIN chunk, data URIs, files beside the document.

use super::{meshopt, Document, Warnings};
use ::gltf::json::{Buffer, Root};
use base64::{engine::general_purpose, Engine};
use std::borrow::Cow;
use std::io::Read;
use std::path::{Component, Path};

/// Largest file that is read, so that a declared length alone allocates nothing absurd.
pub(super) const LARGEST: u64 = 1 << 34;

/// Bytes of a buffer, or why there are none.
pub(super) type Content<'a> = Result<Cow<'a, [u8]>, String>;

/// Loads every buffer, each at least as long as it declares, together at most `left` bytes: many may name the same file. One
/// that cannot be had refuses the file only when something that is drawn needs it.
pub(super) fn load<'a>(
    root: &Root,
    binary: Option<&'a [u8]>,
    folder: Option<&Path>,
    mut left: u64,
    warnings: &mut Warnings,
) -> Vec<Content<'a>> {
    let fallbacks = meshopt::fallbacks(root, binary.is_some());
    let mut buffers = Vec::new();
    for (index, buffer) in root.buffers.iter().enumerate() {
        let binary = binary.filter(|_| index == 0);
        if fallbacks[index] {
            buffers.push(Err(format!("buffers[{index}] only stands in for compressed data")));
            continue;
        }
        let declared = buffer.byte_length.0;
        let bytes = match left.checked_sub(declared) {
            None => Err("it takes more memory than is left (see --max-memory)".into()),
            Some(_) => load_one(buffer, binary, folder),
        };
        let bytes = bytes.and_then(|(bytes, length)| match length {
            length if length < declared => Err(format!("byteLength is {declared}, but there are only {length} bytes")),
            length => Ok((bytes, length)),
        });
        // A BIN chunk may be padded by up to three bytes.
        let most = declared.saturating_add(if buffer.uri.is_none() { 3 } else { 0 });
        match bytes {
            Ok((bytes, length)) => {
                if length > most {
                    warnings.add(format!("buffers[{index}]: byteLength is {declared}, but there are {length} bytes"));
                }
                left -= declared;
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
pub(super) fn slice<'a>(buffers: &'a [Content], buffer: usize, offset: u64, length: u64) -> Result<&'a [u8], String> {
    let bytes = buffers.get(buffer).ok_or_else(|| format!("there is no buffers[{buffer}]"))?;
    let bytes = bytes.as_ref().map_err(Clone::clone)?;
    let whole = usize::try_from(offset).ok().zip(usize::try_from(length).ok());
    let part = whole.and_then(|(offset, length)| bytes.get(offset..offset.checked_add(length)?));
    part.ok_or_else(|| format!("{length} bytes from {offset} on do not fit into buffers[{buffer}]"))
}

/// The bytes of a buffer, at least as many as it declares if there are, and how many there are.
fn load_one<'a>(
    buffer: &Buffer,
    binary: Option<&'a [u8]>,
    folder: Option<&Path>,
) -> Result<(Cow<'a, [u8]>, u64), String> {
    let declared = buffer.byte_length.0;
    match (&buffer.uri, binary) {
        _ if declared == 0 || declared > LARGEST => Err(format!("byteLength {declared} is not a sensible length")),
        (Some(uri), _) => from_uri(uri, folder, declared).map(|(bytes, length)| (bytes.into(), length)),
        (None, Some(binary)) => Ok((binary[..binary.len().min(declared as usize)].into(), binary.len() as u64)),
        (None, None) => Err("it has no uri, and there is no BIN chunk for it".into()),
    }
}

/// The bytes that a URI of the document holds or names, of a file at most the first `most`, and how many there are in all.
pub(super) fn from_uri(uri: &str, folder: Option<&Path>, most: u64) -> Result<(Vec<u8>, u64), String> {
    if uri.starts_with("data:") {
        let bytes = decode_data_uri(uri)?;
        let length = bytes.len() as u64;
        Ok((bytes, length))
    } else {
        read_beside(uri, folder, most)
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

fn read_beside(uri: &str, folder: Option<&Path>, most: u64) -> Result<(Vec<u8>, u64), String> {
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
    let mut bytes = Vec::with_capacity(data.len().min(most) as usize);
    let file = std::fs::File::open(&path).map_err(|error| refuse(&error))?;
    file.take(most).read_to_end(&mut bytes).map_err(|error| refuse(&error))?;
    // A file that has shrunk meanwhile has no more than was read.
    let length = if (bytes.len() as u64) < most { bytes.len() as u64 } else { data.len() };
    Ok((bytes, length))
}
