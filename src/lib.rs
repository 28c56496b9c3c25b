//! A headless Vulkan ray tracer for glTF scenes: one picture on every device, GPU or none.
//!
//! ```
//! use glimt::{render, scene, Options};
//! let scene = scene::built_in("table")?;
//! let (film, report) = render(&scene, &Options { size: (64, 48), ..Options::default() })?;
//! assert_eq!((film.width, film.height), (64, 48));
//! println!("{} rays on {}", report.rays.primary, report.device.name);
//! # Ok::<(), glimt::Error>(())
//! ```
//!
//! # The data's path
//! ```text
//! scene.glb ─scene::gltf→ Asset (meshes, materials, decoded pictures) ─ a time → Scene
//! Scene ─┬─ Soup ─bvh→ Tree (one, or one a shared mesh and one over instances) ─ quantised nodes ───┐
//!        ├─ View (camera, lights, size)                                      render::upload → device buffers
//!        └─ Features → specialization constants, passes, buffers (render::Plan)
//! a sequence: Asset ─ times → Scenes, each Tree refitted from the one before or built anew
//! buffers ─render::frame→ primary → per round { prepare → shade → prepare → shadow; reflection } → resolve → Film → file
//! buffers ─render::trace→ ray sets through the same kernels → report::Bench
//! scenes by code ─stress→ render, reference → rows that hold or do not      knobs ─study→ render → error against run time
//! ```
//! # Rooms, and who may know whom
//! ```text
//! main → cli → everything below       render → scene, bvh, vulkan, layout, film, report, error
//! stress, study → render, scene, film, report, error (stress also reference and layout, study bvh)
//! reference → scene, film, error      scene → error, srgb, layout (features, constants)       bvh → layout, error
//! vulkan → error      film → error, srgb      layout, report, error, srgb → nothing
//! ```
//! All `unsafe` lives in [`vulkan`]. What host and device share is declared once, in `shaders/shared/`, see [`layout`].

pub mod bvh;
pub mod error;
pub mod film;
pub mod layout;
pub mod reference;
pub mod render;
pub mod report;
pub mod scene;
mod srgb;
pub mod stress;
pub mod study;
pub mod vulkan;

pub use error::{Error, Result};
pub use film::Film;
pub use render::{render, Options, Renderer};
pub use report::Report;
pub use scene::Scene;
pub use vulkan::{prefer_wide_vectors, HugePages};
