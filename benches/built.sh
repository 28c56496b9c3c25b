# Sourced by what measures glimt, in the project's folder: sets `GLIMT`, the program; builds it unless that is set.
if [ -z "${GLIMT:-}" ]; then
    config=()
    if [ -f /usr/lib/x86_64-linux-gnu/libshaderc_combined.a ]; then config=(--config scripts/shaderc-debian.toml); fi
    cargo build --release "${config[@]}"
    GLIMT=$PWD/target/release/glimt
fi
export GLIMT
