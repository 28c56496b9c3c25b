//! Memory on huge pages.
//!
//! A large scene is gone through a few times and forgotten: a million triangles touch some 500 MB, and where the system hands memory
//! out in pages of 4 kB, a third of all processor time is spent in it. Linux gives pages of 2 MB to whom asks.

use std::alloc::{GlobalAlloc, Layout, System};

/// The system's allocator, but large blocks are asked for on huge pages. For programs that render large scenes:
/// `#[global_allocator] static ALLOCATOR: HugePages = HugePages;`
#[derive(Clone, Copy, Debug, Default)]
pub struct HugePages;

/// Smaller blocks stay on small pages: they would waste most of a huge one.
const LARGE: usize = 4 << 20;

/// Asks for huge pages for `bytes` bytes from `start` on, a block of the caller's. What is in it stays as it is; nothing happens where
/// the system knows no such wish.
pub fn prefer_huge_pages(start: *mut u8, bytes: usize) {
    #[cfg(target_os = "linux")]
    if bytes >= LARGE && !start.is_null() {
        const PAGE: usize = 4096;
        let before = start as usize % PAGE;
        // SAFETY: an advice changes nothing that a program can see, whatever lies there; a wrong one is refused, which does no harm.
        unsafe { libc::madvise(start.wrapping_sub(before).cast(), bytes + before, libc::MADV_HUGEPAGE) };
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (start, bytes, LARGE);
}

// SAFETY: every block is the system allocator's own, untouched.
unsafe impl GlobalAlloc for HugePages {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller keeps the promises of the same function.
        let block = unsafe { System.alloc(layout) };
        prefer_huge_pages(block, layout.size());
        block
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as above.
        let block = unsafe { System.alloc_zeroed(layout) };
        prefer_huge_pages(block, layout.size());
        block
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as above.
        let block = unsafe { System.realloc(block, layout, size) };
        prefer_huge_pages(block, size);
        block
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(block, layout) };
    }
}
