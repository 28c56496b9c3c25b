//! Where the bytes of pictures lie.

use super::header::Header;
use crate::scene::gltf::{buffers, Document};
use serde_json::Value;
use std::borrow::Cow;

/// Bytes of a file beside the document that are read for a picture's header. Where it does not fit all are.
const HEADER_BYTES: u64 = 1 << 16;

impl Document<'_> {
    /// Image `index` as the document declares it.
    fn declared_image(&self, index: usize) -> Option<&Value> {
        self.raw.get("images")?.get(index)
    }

    /// The bytes of image `index`, as its file has them; of a file beside the document at most so many; and how many
    /// there are in all.
    fn image_beginning(&self, index: usize, most: u64) -> Result<(Cow<'_, [u8]>, u64), String> {
        let image = self.declared_image(index).ok_or_else(|| format!("there is no images[{index}]"))?;
        let view = image.get("bufferView").and_then(Value::as_u64);
        let bytes = match (view, image.get("uri").and_then(Value::as_str)) {
            (Some(view), _) => self.view_bytes(view as usize).map(|bytes| (Cow::Borrowed(bytes), bytes.len() as u64)),
            (None, Some(uri)) => buffers::from_uri(uri, self.folder, most).map(|(bytes, all)| (Cow::Owned(bytes), all)),
            (None, None) => Err("it has neither a bufferView nor a uri".into()),
        };
        bytes.map_err(|fault| format!("images[{index}]: {fault}"))
    }

    /// All bytes of image `index`.
    pub(in crate::scene::gltf) fn image_bytes(&self, index: usize) -> Result<Cow<'_, [u8]>, String> {
        self.image_beginning(index, buffers::LARGEST).map(|(bytes, _)| bytes)
    }

    /// The media type that the document says image `index` has.
    pub(in crate::scene::gltf) fn image_media_type(&self, index: usize) -> Option<&str> {
        let image = self.declared_image(index)?;
        let in_uri = || image.get("uri")?.as_str()?.strip_prefix("data:")?.split([';', ',']).next();
        image.get("mimeType").and_then(Value::as_str).or_else(in_uri)
    }

    /// What image `index` claims to be, from its first bytes, and how many it has.
    pub(in crate::scene::gltf) fn image_header(&self, index: usize) -> Result<(Header, u64), String> {
        let (beginning, length) = self.image_beginning(index, HEADER_BYTES)?;
        let header = match Header::of(&beginning) {
            Err(_) if beginning.len() as u64 == HEADER_BYTES => Header::of(&self.image_bytes(index)?),
            header => header,
        };
        header.map(|header| (header, length)).map_err(|fault| format!("images[{index}]: {fault}"))
    }
}

/// A warning if a picture is not what it is declared as.
pub(in crate::scene::gltf) fn other_type(declared: &str, own: &str) -> Option<String> {
    (!declared.eq_ignore_ascii_case(own)).then(|| format!("it is {own}, but declared as {declared}"))
}
