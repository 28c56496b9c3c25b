//! All tests, one binary.
//!
//! * `architecture` — who knows whom, where `unsafe` and printing may be
//! * `layout` — the contract: Rust offsets against SPIR-V decorations, unknown lines
//! * `bvh` — invariants on random and hostile boxes, determinism
//! * `scene` — shapes, transforms, cameras, materials
//! * `gltf` — accessors of every kind, hierarchies, faults, written by the tests themselves
//! * `compressed` — Draco and meshopt
//! * `account` — what becomes of extensions and pictures, `--strict`, `info`
//! * `poses` — animations and morph targets against values computed by hand; variants, visibility
//! * `skins` — vertices that follow joints, against values computed by hand
//! * `sequences` — pictures of an animation, trees refitted or built anew
//! * `frames` — pictures: against the reference, closed forms, determinism, features
//! * `textures` — samplers, maps, alpha and coloured shadows, against the reference and closed forms
//! * `hard_scenes` — pictures that are hard on trees, stacks and f32
//! * `hostile` — documents that ask for too much, documents changed at random
//! * `measuring` — bench, stress and study as programs
//! * `stress` — extreme cases hold, and fail without their safeguards
//! * `study` — slopes, knobs, estimated against true error
//! * `cli` — the program: exit codes, messages, files
//! * `batch` — JSON jobs in, answers and pictures out, in one process: order, faults, limits, line by line
//! * `test_models` — models that show whether they are drawn right, against what they looked like
//! * `broken` — the validator's broken files, what the fuzzer found, random changes: an error or a scene, never a panic
//! * `ahead` — kernels that several devices compile at the same time
//! * `vulkan` — commands that are in flight when the host panics
//! * `corpus` — real files, golden silhouettes (skipped where the corpus is absent, demanded when CI=true)

#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::print_stdout, clippy::print_stderr)]

mod account;
mod ahead;
mod architecture;
mod batch;
mod broken;
mod bvh;
mod cli;
mod compressed;
mod corpus;
mod corpus_folder;
mod documents;
mod frames;
mod gltf;
mod hard_scenes;
mod hostile;
mod layout;
mod measuring;
mod poses;
mod scene;
mod sequences;
mod skins;
mod stress;
mod study;
mod support;
mod test_models;
mod textures;
mod vulkan;
