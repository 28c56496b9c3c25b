//! How many rays Mesa's software Vulkan traces side by side.

use super::cache;
use std::path::PathBuf;

/// What Mesa's software Vulkan reads when it starts: the bits of its vectors, 256 unless it says something else.
const BITS: &str = "LP_NATIVE_VECTOR_WIDTH";

/// Where it is told to keep machine code.
const CODE: &str = "MESA_SHADER_CACHE_DIR";

/// Asks Mesa's software Vulkan for vectors of 512 bits, sixteen rays side by side, on processors on which that was seen to be faster: those of AMD from
/// Zen 5 on (docs/performance.md). What the user has set stands. Pictures are the same.
///
/// Wherever vectors are not as usual, machine code gets a folder of its own: Mesa 25.0.7 takes what it finds on disk for vectors as wide as those of today,
/// and half of the rays would be missing.
///
/// It sets variables of the process' environment, so it is for programs: call it at the start of `main`, before there are other threads.
pub fn prefer_wide_vectors() {
    let users = std::env::var(BITS).ok();
    let Some(bits) = users.or_else(|| are_wide_vectors_faster().then(|| "512".into())) else { return };
    let users_folder = std::env::var_os(CODE).filter(|folder| !folder.is_empty()).map(PathBuf::from);
    // Without a folder for it vectors stay as they are.
    let Some(folder) = users_folder.or_else(cache::folder) else { return };
    // The driver makes no more than the last two.
    let _ = std::fs::create_dir_all(&folder);
    std::env::set_var(CODE, folder.join(format!("vectors of {bits} bits")));
    std::env::set_var(BITS, bits);
}

/// On Intel's (Emerald Rapids) 256 bits are mostly faster: they have three ports for such vectors and two for those of 512. Zen 4 was not measured.
#[cfg(target_arch = "x86_64")]
fn are_wide_vectors_faster() -> bool {
    let has_avx512 = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    // Only AMD's have SSE4a, and of those only from Zen 5 on the other.
    let is_amd_since_zen5 = is_x86_feature_detected!("sse4a") && is_x86_feature_detected!("avx512vp2intersect");
    has_avx512 && is_amd_since_zen5
}

#[cfg(not(target_arch = "x86_64"))]
fn are_wide_vectors_faster() -> bool {
    false
}
