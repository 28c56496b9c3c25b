//! Where the shared corpus lies, for the tests of the library and of its parts.

use std::path::{Path, PathBuf};

/// The shared corpus; `None`, with a printed reason, where it is absent. With CI=true it must be there.
pub fn corpus() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/corpus");
    if path.is_dir() {
        return Some(path);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "CI=true, but there is no corpus at {}", path.display());
    println!("skipped: no corpus at {}", path.display());
    None
}
