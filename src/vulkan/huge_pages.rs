//! Memory on huge pages: the program's own and, of software Vulkan, the device's.
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
pub(super) fn prefer_huge_pages(start: *mut u8, bytes: usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    /// What the system knows of the memory that an address lies in: the flags of its line in smaps.
    #[cfg(target_os = "linux")]
    fn flags_of(address: usize) -> Vec<String> {
        let text = std::fs::read_to_string("/proc/self/smaps").unwrap();
        let mut inside = false;
        for line in text.lines() {
            let range = line.split_whitespace().next().and_then(|range| range.split_once('-'));
            let number = |digits| usize::from_str_radix(digits, 16).ok();
            if let Some((start, end)) = range.and_then(|(start, end)| number(start).zip(number(end))) {
                inside = (start..end).contains(&address);
            }
            if let Some(flags) = line.strip_prefix("VmFlags:").filter(|_| inside) {
                return flags.split_whitespace().map(str::to_owned).collect();
            }
        }
        Vec::new()
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn large_blocks_ask_and_small_ones_do_not() {
        if !std::path::Path::new("/sys/kernel/mm/transparent_hugepage").is_dir() {
            println!("skipped: this system has no huge pages to ask for");
            return;
        }
        let asks = |bytes: usize| {
            let mut block = vec![0_u8; bytes];
            prefer_huge_pages(block.as_mut_ptr(), block.len());
            flags_of(block.as_ptr() as usize + bytes / 2).iter().any(|flag| flag == "hg")
        };
        assert!(asks(64 << 20) && !asks(2 << 20));
    }

    #[test]
    fn blocks_keep_what_is_in_them() {
        let layout = |bytes| Layout::from_size_align(bytes, 16).unwrap();
        let (small, large) = (layout(1 << 20), layout(40 << 20));
        // SAFETY: the size is not 0.
        let block = unsafe { HugePages.alloc_zeroed(large) };
        // SAFETY: the block has so many bytes, all of them written.
        let bytes = unsafe { std::slice::from_raw_parts_mut(block, large.size()) };
        assert!(bytes.iter().all(|byte| *byte == 0));
        bytes[..small.size()].fill(7);
        // SAFETY: the block is of this allocator and layout; no reference to it is used any more.
        let block = unsafe { HugePages.realloc(block, large, small.size()) };
        // SAFETY: as above.
        let block = unsafe { HugePages.realloc(block, small, large.size()) };
        // SAFETY: the first bytes were written before it grew.
        let bytes = unsafe { std::slice::from_raw_parts(block, small.size()) };
        assert!(bytes.iter().all(|byte| *byte == 7));
        // SAFETY: as above.
        unsafe { HugePages.dealloc(block, large) };
    }
}
