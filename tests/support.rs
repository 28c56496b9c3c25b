//! What several tests need.

use glimt::render::Renderer;
use glimt::scene::Soup;
use glimt::vulkan::{DeviceChoice, Fetch, Habits};
use glimt::{film, reference, Film, Options, Report, Scene};
use std::path::Path;
use std::sync::OnceLock;

/// The device, opened once with the validation layers. No device is a failure.
pub fn renderer() -> &'static Renderer {
    static RENDERER: OnceLock<Renderer> = OnceLock::new();
    RENDERER.get_or_init(|| {
        let renderer = Renderer::new(&DeviceChoice::Best, true).expect("a Vulkan device and the validation layers");
        let info = &renderer.device().info;
        println!("device: {}, {}, Vulkan {}, subgroups of {}", info.name, info.driver, info.api, info.subgroup_size);
        renderer
    })
}

/// The same device, fetching from storage buffers and uploading through staging buffers, as others do.
pub fn storage_renderer() -> &'static Renderer {
    static RENDERER: OnceLock<Renderer> = OnceLock::new();
    let habits = Habits { fetch: Some(Fetch::Storage), staged: Some(true), ..Habits::default() };
    RENDERER.get_or_init(|| Renderer::with_habits(&DeviceChoice::Best, true, habits).expect("a Vulkan device"))
}

/// Renders on the device; any validation message fails.
pub fn draw(scene: &Scene, options: &Options) -> (Film, Report) {
    renderer().render(scene, options).unwrap_or_else(|error| panic!("{}: {error}", scene.name))
}

/// Renders by the reference.
pub fn draw_reference(scene: &Scene, options: &Options) -> Film {
    let soup = Soup::of(scene).unwrap();
    let view = options.view(scene, &soup).unwrap();
    reference::render(scene, &soup, &view, &options.interrupted, None).unwrap()
}

/// Fails unless at least 99.9 % of pixels agree within 1/255 and the RMSE is at most 1/255: room for pixels whose centre lies
/// on an edge, where f32 and f64 may choose differently. On failure both pictures and their difference are left behind.
pub fn assert_alike(name: &str, reference: &Film, picture: &Film) {
    let metrics = film::compare(reference, picture).unwrap();
    println!("{name}: RMSE {:.2e}, {:.4} % of pixels over 1/255", metrics.rmse, 100.0 * metrics.over_1_255);
    if metrics.over_1_255 > 0.001 || metrics.rmse > 1.0 / 255.0 {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let save = |film: &Film, kind: &str| {
            let path = folder.join(format!("{}-{kind}.png", name.replace('/', "-")));
            film.save(&path, film::Format::Png8, || Ok(())).unwrap();
            eprintln!("{kind}: {}", path.display());
        };
        save(reference, "reference");
        save(picture, "picture");
        save(&film::heat_map(reference, picture).unwrap(), "difference");
        panic!("{name}: {metrics:?}");
    }
}

pub use super::corpus_folder::corpus;
