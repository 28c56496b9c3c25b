//! What the targets share: bytes of a document → scene → soup, within little memory.

use glimt::scene::{gltf, Instancing, Soup};
use glimt::Scene;
use std::panic::{catch_unwind, set_hook, AssertUnwindSafe};

/// Bytes that a document may ask for.
const MOST_MEMORY: u64 = 16 << 20;
/// Most triangles of a scene whose soup is made.
const SMALL: usize = 20_000;

/// Everything runs on the fuzzer's own thread. The reader catches panics of other people's decoders, so only one that leaves
/// the library is a crash.
pub fn init() {
    set_hook(Box::new(|_| {}));
    // Fails only if there is a pool already.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
}

/// Reads a document as a user would: as it is; then, if it has any, with its first animation and first variant.
pub fn read(bytes: &[u8]) {
    if catch_unwind(AssertUnwindSafe(|| read_all(bytes))).is_err() {
        // Once more, to say where.
        set_hook(Box::new(|panic| eprintln!("{panic}")));
        read_all(bytes);
        std::process::abort();
    }
}

fn read_all(bytes: &[u8]) {
    let open = |options: &gltf::ReadOptions| gltf::open_bytes(bytes, "fuzz".into(), "fuzz", None, options);
    let options = gltf::ReadOptions { max_memory: Some(MOST_MEMORY), ..gltf::ReadOptions::default() };
    let Ok(asset) = open(&options) else { return };
    let contents = asset.contents();
    let variant = (!contents.variants.is_empty()).then(|| "0".to_owned());
    let at = contents.animations.first().map(|animation| 0.4 * animation.duration);
    if let Ok(scene) = asset.into_scene() {
        soups(&scene);
    }
    if variant.is_some() || at.is_some() {
        let moving = open(&gltf::ReadOptions { variant, at, max_texture_size: Some(64), ..options });
        if let Ok(scene) = moving.and_then(gltf::Asset::into_scene) {
            soups(&scene);
        }
    }
}

fn soups(scene: &Scene) {
    if scene.triangle_count() > SMALL {
        return;
    }
    for instancing in [Instancing::Flat, Instancing::Shared] {
        if let Ok(mut soup) = Soup::with(scene, instancing) {
            soup.dice(soup.lo);
        }
    }
}

/// A GLB of a JSON and a BIN chunk.
#[allow(dead_code)]
pub fn glb(mut json: String, binary: &[u8]) -> Vec<u8> {
    json.extend(std::iter::repeat_n(' ', json.len().next_multiple_of(4) - json.len()));
    let padding = vec![0; binary.len().next_multiple_of(4) - binary.len()];
    let word = |length: usize| u32::to_le_bytes(length as u32);
    let binary_length = binary.len() + padding.len();
    let length = word(12 + 8 + json.len() + 8 + binary_length);
    let head = [&b"glTF\x02\0\0\0"[..], &length, &word(json.len()), b"JSON", json.as_bytes()].concat();
    [&head[..], &word(binary_length), b"BIN\0", binary, &padding].concat()
}
