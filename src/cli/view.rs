//! Flags that choose the picture, the same for every command that renders.

use super::reading::ReadArgs;
use super::values::{size, vector, BvhChoice, FilterChoice, InstancingChoice, SamplerChoice};
use clap::Args;
use glam::DVec3;
use glimt::scene::{Background, CameraChoice};
use glimt::{Error, Options, Result};

/// Picture, camera and light.
#[derive(Args)]
pub struct ViewArgs {
    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "1024x768", value_parser = size)]
    size: (u32, u32),
    /// Samples a pixel; 1 goes through the pixel's centre
    #[arg(long, value_name = "N", default_value_t = 1)]
    spp: u32,
    /// Where samples lie in a pixel
    #[arg(long, value_enum, default_value_t = SamplerChoice::Sobol)]
    sampler: SamplerChoice,
    /// How samples are weighed around a pixel's centre
    #[arg(long, value_enum, default_value_t = FilterChoice::Box)]
    filter: FilterChoice,
    /// Other positions of samples for each number
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Reflections one after the other; 0 for none
    #[arg(long, value_name = "N", default_value_t = 8)]
    max_depth: u32,
    /// gradient, transparent, black, white, #rrggbb (sRGB) or r,g,b (linear)
    #[arg(long, value_name = "COLOR", default_value = "gradient")]
    background: Background,
    #[command(flatten)]
    pub read: ReadArgs,
    /// Camera of the file, by name or index [default: its first; one that frames the scene if it has none]
    #[arg(long, value_name = "NAME|INDEX", conflicts_with_all = ["eye", "orbit", "target"])]
    camera: Option<String>,
    /// Position of the camera
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, conflicts_with = "orbit")]
    eye: Option<DVec3>,
    /// Point the camera looks at [default: the scene's centre]
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    target: Option<DVec3>,
    /// Direction that is up in the picture
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true, default_value = "0,1,0")]
    up: DVec3,
    /// Vertical field of view in degrees [default: the camera's own, or 45]
    #[arg(long, value_name = "DEGREES")]
    fov: Option<f64>,
    /// Camera on a sphere about the target: degrees about y from +z, degrees from +y, metres
    #[arg(long, value_name = "THETA,PHI,RADIUS", value_parser = vector, allow_hyphen_values = true)]
    orbit: Option<DVec3>,
    /// Leave a scene without lights dark but for its ambient and emission
    #[arg(long)]
    no_default_light: bool,
    /// Pixel samples traced at once: bounds the memory, changes no pixel
    #[arg(long, value_name = "N", default_value_t = 1 << 17)]
    samples_in_flight: u32,
    /// How much work goes into the tree; changes no pixel [default: by the numbers of triangles and rays]
    #[arg(long, value_enum)]
    bvh: Option<BvhChoice>,
    /// Whether instances share the triangles of their mesh in memory
    #[arg(long, value_enum, default_value_t = InstancingChoice::Auto)]
    instances: InstancingChoice,
    /// Refuse a scene of more triangles, all instances counted
    #[arg(long, value_name = "N")]
    max_triangles: Option<u64>,
    /// Compile and run everything, needed or not
    #[arg(long, hide = true)]
    all_features: bool,
}

impl ViewArgs {
    /// Options without a device.
    ///
    /// # Errors
    /// `Usage` for flags that do not go together or are out of range.
    pub fn options(&self) -> Result<Options> {
        let fov = match self.fov {
            Some(degrees) if !(1e-3..180.0).contains(&degrees) => {
                return Err(Error::Usage(format!("--fov {degrees}: must be from 0.001 to below 180 degrees")));
            }
            fov => fov.map(f64::to_radians),
        };
        let camera = match (&self.camera, self.eye, self.orbit) {
            (Some(name), ..) => CameraChoice::Named(name.clone()),
            (_, Some(eye), _) => CameraChoice::LookAt { eye, target: self.target },
            (.., Some(orbit)) => {
                CameraChoice::Orbit { theta: orbit.x, phi: orbit.y, radius: orbit.z, target: self.target }
            }
            _ if self.target.is_some() => return Err(Error::Usage("--target needs --eye or --orbit".into())),
            _ => CameraChoice::Auto,
        };
        Ok(Options {
            size: self.size,
            samples: self.spp,
            sampler: self.sampler.into(),
            filter: self.filter.into(),
            seed: self.seed,
            max_depth: self.max_depth,
            camera,
            up: self.up,
            fov,
            background: self.background,
            default_light: !self.no_default_light,
            samples_in_flight: self.samples_in_flight,
            bvh: self.bvh.map(Into::into),
            instancing: self.instances.into(),
            max_triangles: self.max_triangles,
            all_features: self.all_features,
            ..Options::default()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;
    use glimt::scene::{Filter, Sampler};

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        view: ViewArgs,
    }

    fn options(flags: &str) -> Result<Options, String> {
        let only = Only::try_parse_from(std::iter::once("x").chain(flags.split_whitespace()));
        only.map_err(|error| error.to_string())?.view.options().map_err(|error| error.to_string())
    }

    #[test]
    fn no_flags_are_the_library_s_defaults() {
        let (own, library) = (options("").unwrap(), Options::default());
        assert_eq!(
            (own.size, own.samples, own.max_depth, own.background, own.camera, own.samples_in_flight),
            (
                library.size,
                library.samples,
                library.max_depth,
                library.background,
                library.camera,
                library.samples_in_flight
            )
        );
    }

    #[test]
    fn each_flag_sets_its_option() {
        let own = options(
            "--size 3x4 --spp 5 --max-depth 6 --background black --eye -1,2,3 --target 0,0,1 --up 0,0,1 --fov 90 \
             --no-default-light --samples-in-flight 128 --all-features --scene 1 --sampler stratified --filter tent --seed 9 \
             --max-triangles 7",
        );
        let own = own.unwrap();
        assert_eq!((own.size, own.samples, own.max_depth), ((3, 4), 5, 6));
        assert_eq!(own.background, Background::Constant(DVec3::ZERO));
        assert_eq!((own.sampler, own.filter, own.seed), (Sampler::Stratified, Filter::Tent, 9));
        let eye = DVec3::new(-1.0, 2.0, 3.0);
        assert_eq!(own.camera, CameraChoice::LookAt { eye, target: Some(DVec3::Z) });
        assert_eq!((own.up, own.fov), (DVec3::Z, Some(std::f64::consts::FRAC_PI_2)));
        assert_eq!(own.max_triangles, Some(7));
        assert!(!own.default_light && own.all_features && own.samples_in_flight == 128);
        let orbit = CameraChoice::Orbit { theta: -30.0, phi: 60.0, radius: 2.5, target: None };
        assert_eq!(options("--orbit -30,60,2.5").unwrap().camera, orbit);
        assert_eq!(options("--camera top").unwrap().camera, CameraChoice::Named("top".into()));
    }

    #[test]
    fn nonsense_is_refused() {
        for flags in [
            "--fov 180",
            "--fov 0",
            "--target 0,0,0",
            "--size 5",
            "--eye 1,2,3 --orbit 1,2,3",
            "--background #12",
            "--spp -1",
        ] {
            assert!(options(flags).is_err(), "{flags}");
        }
    }
}
