//! How many rays Mesa's software Vulkan traces side by side.

/// What Mesa's software Vulkan reads when it starts: the bits of its vectors, 256 unless it says something else.
const BITS: &str = "LP_NATIVE_VECTOR_WIDTH";

/// Asks Mesa's software Vulkan for vectors of 512 bits, sixteen rays side by side, on processors on which that was seen to be faster: those of AMD with
/// AVX-512 (docs/performance.md). What the user has set stands. Pictures are the same.
///
/// It sets a variable of the process' environment, so it is for programs: call it at the start of `main`, before there are other threads.
pub fn prefer_wide_vectors() {
    if are_wide_vectors_faster() && std::env::var_os(BITS).is_none() {
        std::env::set_var(BITS, "512");
    }
}

/// For other processors with AVX-512 the compiler in the driver itself prefers vectors of 256 bits; what is faster there was not measured.
#[cfg(target_arch = "x86_64")]
fn are_wide_vectors_faster() -> bool {
    let has_avx512 = is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    // Nobody else's have SSE4a.
    has_avx512 && is_x86_feature_detected!("sse4a")
}

#[cfg(not(target_arch = "x86_64"))]
fn are_wide_vectors_faster() -> bool {
    false
}
