//! Flags that choose what is read of a file, the same for every command that reads one.

use clap::Args;
use glimt::scene::gltf::ReadOptions;

/// Scene, animation, time and variant.
#[derive(Args, Clone, Default)]
pub struct ReadArgs {
    /// Scene of the file, by name or index [default: the file's own default]
    #[arg(long = "scene", value_name = "NAME|INDEX")]
    scene_choice: Option<String>,
    /// Animation to play, by name or index [default: the first with --at, otherwise none]
    #[arg(long, value_name = "NAME|INDEX")]
    animation: Option<String>,
    /// Time on the animation's clock [default: 0 with --animation]
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true)]
    pub at: Option<f64>,
    /// Variant of the file's materials, by name or index [default: the materials that its primitives name]
    #[arg(long, value_name = "NAME|INDEX")]
    variant: Option<String>,
    /// Halve textures until neither side has more pixels
    #[arg(long, value_name = "PIXELS", value_parser = clap::value_parser!(u32).range(1..=65535))]
    max_texture_size: Option<u32>,
    /// Memory that reading the file may take: bytes, or with K, M or G [default: 2G]
    #[arg(long, value_name = "SIZE", value_parser = super::values::bytes)]
    max_memory: Option<u64>,
    /// Refuse a file with anything that is ignored
    #[arg(long)]
    strict: bool,
}

impl ReadArgs {
    /// As the library takes them.
    pub fn options(&self) -> ReadOptions {
        ReadOptions {
            scene: self.scene_choice.clone(),
            animation: self.animation.clone(),
            at: self.at,
            variant: self.variant.clone(),
            max_texture_size: self.max_texture_size,
            max_memory: self.max_memory,
            strict: self.strict,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Only {
        #[command(flatten)]
        read: ReadArgs,
    }

    #[test]
    fn each_flag_sets_its_option() {
        let flags = "x --scene a --animation b --at -1.5 --variant c --max-texture-size 64 --max-memory 1M --strict";
        let flags = flags.split_whitespace();
        let own = Only::try_parse_from(flags).map(|only| only.read.options());
        let own = own.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((own.scene.as_deref(), own.animation.as_deref()), (Some("a"), Some("b")));
        assert_eq!((own.at, own.variant.as_deref()), (Some(-1.5), Some("c")));
        assert_eq!((own.max_texture_size, own.max_memory, own.strict), (Some(64), Some(1 << 20), true));
        assert!(Only::try_parse_from(["x", "--at", "soon"]).is_err());
    }
}
