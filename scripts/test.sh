#!/usr/bin/env bash
# Installs what is missing, the validation layers too, and runs every check: format, lints, documentation, all tests.
set -euo pipefail
more_packages=(vulkan-validationlayers)
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
cd "$root"
step() { echo "== $*" >&2; }

step format
cargo fmt --check
step lints
cargo clippy --quiet --all-targets "${cargo_config[@]}" -- -D warnings
step documentation
RUSTDOCFLAGS="-D warnings" cargo doc --quiet --no-deps "${cargo_config[@]}"
step tests
cargo build --quiet "${cargo_config[@]}"
"${CARGO_TARGET_DIR:-target}/debug/glimt" devices
cargo test --quiet "${cargo_config[@]}" -- --show-output
