//! The whole reader: bytes of a `.glb` or `.gltf`.
#![no_main]

mod common;

use libfuzzer_sys::fuzz_target;

fuzz_target!(init: common::init(), |bytes: &[u8]| common::read(bytes));
