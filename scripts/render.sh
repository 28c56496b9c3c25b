#!/usr/bin/env bash
# Installs what is missing, builds glimt, and runs `glimt render ARGS…` where you are. Without ARGS: the built-in table.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/setup.sh"
cargo build --quiet --release --manifest-path "$root/Cargo.toml" "${cargo_config[@]}" >&2
exec "${CARGO_TARGET_DIR:-$root/target}/release/glimt" render "$@"
