//! x
pub mod layout;
pub mod error;
pub mod vulkan;
pub mod bvh;
pub mod scene;
pub mod report;
pub mod film;
pub mod render;
