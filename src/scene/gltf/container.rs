//! The GLB container. Our own, because the `gltf` crate's subtracts header sizes unchecked and panics on short files.

/// The parts of a file.
#[derive(Clone, Copy)]
pub(super) struct Container<'a> {
    pub json: &'a [u8],
    pub binary: Option<&'a [u8]>,
    /// Faults that can be lived with.
    pub warnings: &'static [&'static str],
}

const HEADER: usize = 12;
const CHUNK_HEADER: usize = 8;

fn u32_at(bytes: &[u8], at: usize) -> Option<usize> {
    let word = bytes.get(at..at.checked_add(4)?)?.try_into().ok()?;
    usize::try_from(u32::from_le_bytes(word)).ok()
}

/// Splits a GLB, or passes a `.gltf` on as it is. `Err` names the fault.
pub(super) fn split(bytes: &[u8]) -> Result<Container<'_>, String> {
    if bytes.is_empty() {
        return Err("the file is empty".into());
    }
    if !bytes.starts_with(b"glTF") {
        let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
        if first != Some(&b'{') {
            return Err(
                "this is neither a .glb (it does not start with 'glTF') nor a .gltf (it does not start with '{')"
                    .into(),
            );
        }
        return Ok(Container { json: bytes, binary: None, warnings: &[] });
    }
    let header = u32_at(bytes, 4).zip(u32_at(bytes, 8));
    let (version, length) = header.ok_or("GLB: the file ends inside its header")?;
    if version != 2 {
        return Err(format!("GLB: version {version}, only 2 is known"));
    }
    if length < HEADER + CHUNK_HEADER {
        return Err(format!("GLB: the header says {length} bytes, too few for a chunk"));
    }
    if length > bytes.len() {
        return Err(format!("GLB: the header says {length} bytes, the file has {}: it is cut off", bytes.len()));
    }
    chunks(&bytes[..length], bytes.len() > length)
}

fn chunks(bytes: &[u8], has_more: bool) -> Result<Container<'_>, String> {
    let mut json = None;
    let mut binary = None;
    let mut unknown = false;
    let mut unaligned = false;
    let mut at = HEADER;
    while at < bytes.len() {
        let chunk = u32_at(bytes, at).zip(u32_at(bytes, at + 4));
        let (length, kind) = chunk.ok_or("GLB: the file ends inside a chunk's header")?;
        let start = at + CHUNK_HEADER;
        let content = start.checked_add(length).and_then(|end| bytes.get(start..end)).ok_or_else(|| {
            format!("GLB: a chunk of {length} bytes at {at} does not fit into the {} of the file", bytes.len())
        })?;
        match &(kind as u32).to_le_bytes() {
            b"JSON" if json.is_none() && at == HEADER => json = Some(content),
            b"JSON" => return Err("GLB: more than one JSON chunk, or it is not the first".into()),
            b"BIN\0" if json.is_none() => return Err("GLB: the first chunk is not JSON".into()),
            b"BIN\0" if binary.is_some() => return Err("GLB: more than one BIN chunk".into()),
            b"BIN\0" if unknown => return Err("GLB: the BIN chunk is not the second".into()),
            b"BIN\0" => binary = Some(content),
            _ if json.is_none() => return Err("GLB: the first chunk is not JSON".into()),
            _ => unknown = true,
        }
        unaligned |= length % 4 != 0;
        at = start + length;
    }
    let json = json.filter(|json| !json.is_empty()).ok_or("GLB: there is no JSON in it")?;
    let empty = binary.is_some_and(<[u8]>::is_empty);
    let warnings: &[&str] = match (has_more, unaligned, empty, unknown) {
        (true, ..) => &["GLB: there are bytes behind the length that the header gives; they are ignored"],
        (_, true, ..) => &["GLB: a chunk's length is no multiple of 4"],
        (_, _, true, _) => &["GLB: the BIN chunk is empty"],
        (_, _, _, true) => &["GLB: a chunk of unknown type is ignored"],
        _ => &[],
    };
    Ok(Container { json, binary, warnings })
}
